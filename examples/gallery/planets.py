"""A planetary set with one pin 20 µm behind its place: load shares with the sun held and with a sun that floats.

The areas of the circles are the squares of the greatest load shares. Four planets do not share equally on a floating
sun; three would.
"""

from pathlib import Path

from matplotlib import pyplot as plt

from gearbench import parse_scene, read_scene, simulate
from gearbench.plot import load_shares

tables = read_scene(Path(__file__).parents[1] / "planetary.toml").to_mapping()
figure, axes = plt.subplots(1, 2, figsize=(11, 5.8), layout="constrained")
for axis, floating in zip(axes, ([], ["sun"]), strict=True):
    own = tables["planetary"] | {"floating": floating, "pin_tangential": [-20.0, 0.0, 0.0, 0.0]}
    dataset = simulate(parse_scene(tables | {"planetary": own}))
    load_shares(dataset, axis)
    error = float(dataset["train_transmission_error_peak_to_peak"])
    factor = float(dataset["mesh_load_factor"])
    axis.set_title(f"{'floating' if floating else 'held'} sun: K_γ {factor:.2f}, peak-to-peak Δ {error:.2f} µm")
figure.savefig("planets.png", dpi=80)
