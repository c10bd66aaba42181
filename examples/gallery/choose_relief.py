"""Choosing tip relief: peak-to-peak transmission error over amount and torque.

Both keys are swept in one call. A row of the picture is a relief, a column a torque; the line joins the best relief at
each torque.
"""

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from gearbench import read_scene, sweep

scene = read_scene(Path(__file__).parents[1] / "gears/nasa_28.toml")
amounts, torques = np.linspace(4.0, 36.0, 9), np.linspace(0.2, 1.4, 9) * scene.load.torque
found = sweep(scene, {"effects.tip_relief.amount": amounts, "torque": torques})
values = found["transmission_error_peak_to_peak"].transpose("effects.tip_relief.amount", "torque")

figure, axes = plt.subplots(figsize=(7, 4.2), layout="constrained")
drawn = axes.pcolormesh(torques, amounts, values, shading="gouraud", cmap="viridis")
figure.colorbar(drawn, label="peak-to-peak STE [µm]")
best = amounts[values.argmin("effects.tip_relief.amount")]
axes.plot(torques, best, "o--", color="white", label="best at each torque")
axes.legend(frameon=False, labelcolor="white")
axes.set(xlabel="torque on the pinion [N·m]", ylabel="tip relief f [µm]", title="which relief for which torque")
figure.savefig("choose_relief.png", dpi=80)
