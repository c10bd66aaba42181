"""A torque sweep: Harris map, and the torque with the least transmission error.

Tip relief is right for one torque. Below it the relieved tips leave a gap, above it the teeth bend more than they were
relieved by; between them the peak-to-peak transmission error has a valley.
"""

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from gearbench import read_scene, sweep
from gearbench.plot import harris_map, peak_to_peak_over_torque

scene = read_scene(Path(__file__).parents[1] / "gears/nasa_28.toml")
loads = sweep(scene, torque=np.linspace(0.1, 1.5, 15) * scene.load.torque)

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
harris_map(loads, left, about_mean=True)
left.legend(frameon=False, fontsize=7, ncols=2)
left.set_title("Harris map of NASA's spur pair", pad=16)
peak_to_peak_over_torque(loads, right)
right.set_title("peak-to-peak STE over torque")
figure.savefig("harris_map.png", dpi=80)
