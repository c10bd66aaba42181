"""Measured flanks: a grid of deviations from a file, and the resulting load on the flank.

The file holds positions across the face in its first row, radii in its first column, deviations in µm.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from gearbench import Topography, read_scene, simulate
from gearbench.plot import load_map

scene = read_scene(Path(__file__).parents[1] / "gears/e_drive_output.toml")
start, end = scene.pair.meshing.active_radii[0]
radius, face = np.linspace(start, end, 9), np.linspace(0.0, scene.pair.meshing.face_width, 9)
t, s = (radius[:, None] - start) / (end - start), 2 * face / face[-1] - 1
deviation = 6 * s**2 + 5 * s * (t - 0.5) + 4 * t**3 + np.random.default_rng(2).normal(0.0, 0.3, (9, 9))
rows = [["radius", *face], *([r, *line] for r, line in zip(radius, deviation, strict=True))]
Path("pinion.csv").write_text("\n".join(",".join(map(str, row)) for row in rows), encoding="utf-8")

nominal = replace(scene, effects=tuple(e for e in scene.effects if e.name in ("tooth_bending", "gear_body", "hertz")))
measured = replace(nominal, effects=(*nominal.effects, Topography(pinion="pinion.csv")))
results = {"as designed, without modifications": simulate(nominal), "as measured": simulate(measured)}

figure, (flank, *maps) = plt.subplots(1, 3, figsize=(13, 3.8), layout="constrained")
grid = results["as measured"]["topography_pinion"]  # kept in the result
drawn = flank.pcolormesh(face, radius, grid, shading="gouraud", cmap="viridis")
figure.colorbar(drawn, ax=flank, label="material missing [µm]")
flank.set(xlabel="position along the face width y [mm]", ylabel="radius [mm]")
flank.set_title("measured flank of the pinion", fontsize=10)
for axis, (title, result) in zip(maps, results.items(), strict=True):
    load_map(result, gear=0, axes=axis, scale=1800.0)
    axis.set_title(f"{title}\nSTE {float(result['transmission_error_peak_to_peak']):.2f} µm peak to peak", fontsize=10)
figure.savefig("measured_flank.png", dpi=80)
