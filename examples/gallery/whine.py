"""Gear whine: the mesh force of a stage on its shafts over speed, and the tip relief that minimises it.

Where an order of the mesh frequency meets a mode of the shafts the force is large; relief changes what excites it.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from gearbench import read_scene, response

scene = read_scene(Path(__file__).parents[1] / "shafts.toml")
relief = scene.effect("tip_relief")
speed = np.linspace(500, 8000, 200)

figure, (over_speed, orders) = plt.subplots(1, 2, figsize=(11, 3.8), layout="constrained")
for amount in (0.0, 10.0, 20.0, 30.0):
    effects = tuple(replace(each, amount=amount) if each is relief else each for each in scene.effects)
    result = response(replace(scene, effects=effects), speed=speed)
    force = result["mesh_force_rms"].squeeze("mesh")
    over_speed.plot(speed, force, label=f"relief {amount:g} µm: up to {float(force.max()):.0f} N")
    if amount == 20.0:
        for order in (1, 2, 3):
            one = result["mesh_force_amplitude"].squeeze("mesh").sel(harmonic=order)
            orders.plot(speed, one, label=f"order {order} of the mesh frequency")
over_speed.set(xlabel="speed of the pinion [1/min]", ylabel="RMS of the mesh force [N]", ylim=(0, None))
over_speed.legend(frameon=False, fontsize=9)
orders.set(xlabel="speed of the pinion [1/min]", ylabel="amplitude of the mesh force [N]", ylim=(0, None))
orders.set_title("relief 20 µm, order by order", fontsize=10)
orders.legend(frameon=False, fontsize=9)
figure.savefig("whine.png", dpi=80)
