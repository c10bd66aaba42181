"""Run-out, wobble and pitch errors: all mesh cycles until the same teeth meet again, and sidebands of the mesh orders.

Run-out that is even over the face turns the gear, once in a revolution, and nothing else. Wobble sends the load from
one end of the face to the other; on spur gears either end counts alike, so that sidebands stand two orders of the
gear away from each mesh order. Pitch errors have all orders of their gear.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from gearbench import PitchErrors, Wave, Waviness, hunting_cycle, read_scene
from gearbench.plot import side_bands

scene = read_scene(Path(__file__).parents[1] / "gears/fzg_c.toml")
teeth = scene.pair.gears[0].teeth
steps = np.cumsum(np.random.default_rng(1).normal(0.0, 1.5, teeth))
cases = {
    "run-out of the wheel, 10 µm": Waviness(wheel=(Wave(order=1, amplitude=10.0),)),
    "wobble of the wheel, 10 µm": Waviness(wheel=(Wave(order=1, amplitude=10.0, over_face="tilting"),)),
    "pitch errors of the pinion": PitchErrors(pinion=tuple(steps - steps.mean())),
}

figure, axes = plt.subplots(1, 3, figsize=(13, 3.8), layout="constrained", sharey=True)
for axis, (title, effect) in zip(axes, cases.items(), strict=True):
    result = hunting_cycle(replace(scene, effects=(*scene.effects, effect)), orders=3.2)
    side_bands(result, axis)
    axis.set_title(title, fontsize=10)
    axis.legend(frameon=False, fontsize=8, loc="upper right")
for axis in axes[1:]:
    axis.set_ylabel("")
figure.savefig("sidebands.png", dpi=80)
