"""Misalignment: the shift of the load, and its correction by crowning.

The same pair aligned, with axes out of parallel, and with axes out of parallel and crowned flanks; one scale for all.
"""

from dataclasses import replace
from pathlib import Path

from matplotlib import pyplot as plt

from gearbench import Crowning, Misalignment, read_scene, simulate
from gearbench.plot import load_map

scene = read_scene(Path(__file__).parents[1] / "gears/e_drive_input.toml")
bare = tuple(effect for effect in scene.effects if effect.name != "crowning")
tilted = Misalignment(deviation=20.0)
cases = {
    "aligned": bare,
    "axes 20 µm out of parallel": (*bare, tilted),
    "the same, crowned by 8 µm": (*bare, tilted, Crowning(amount=8.0)),
}

figure, axes = plt.subplots(1, 3, figsize=(13, 3.8), layout="constrained")
for axis, (title, effects) in zip(axes, cases.items(), strict=True):
    result = simulate(replace(scene, effects=effects))
    load_map(result, gear=0, axes=axis, scale=1200.0)
    axis.set_title(f"{title}\nSTE {float(result['transmission_error_peak_to_peak']):.2f} µm peak to peak", fontsize=10)
figure.savefig("misalignment.png", dpi=80)
