"""Face width: the stiffness of a helical pair fluctuates least near whole overlap ratios.

The contact lines that enter and those that leave then have the same total length at every mesh phase.
"""

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from gearbench import read_scene, sweep
from gearbench.plot import over_two_periods

scene = read_scene(Path(__file__).parents[1] / "case2.toml")
found = sweep(scene, face_width=np.linspace(8.0, 44.0, 13))
overlap = scene.pair.meshing.overlap_ratio * found["face_width"] / scene.pair.face_width

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
over_two_periods(found.isel(face_width=[0, 3, 6, 9, 12]), "mesh_stiffness", left).set_title("mesh stiffness")
right.plot(overlap, found["mesh_stiffness_rms"], "o-")
right.set(xlabel="overlap ratio ε_β [–]", ylabel="RMS of k [%]", title="its fluctuation", ylim=(0, None))
for whole in (1, 2):
    right.axvline(whole, color="0.6", ls=":")
figure.savefig("face_width.png", dpi=80)
