"""Scatter under manufacturing errors: three ISO classes, and which error matters.

256 points of a Sobol sequence stand for as many gears from the line.
"""

from dataclasses import replace
from pathlib import Path

from matplotlib import pyplot as plt

from gearbench import ManufacturingErrors, read_scene, robust
from gearbench.plot import contributions

scene = read_scene(Path(__file__).parents[1] / "gear55_robust.toml")
figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
for iso_class, colour in ((5, "#009E73"), (6, "#0072B2"), (7, "#D55E00")):
    effects = [
        replace(effect.convention(), iso_class=iso_class) if isinstance(effect, ManufacturingErrors) else effect
        for effect in scene.effects
    ]
    samples = robust(replace(scene, effects=tuple(effects)), samples=256)
    values = samples["transmission_error_rms"]
    label = f"class {iso_class}, mean {float(values.mean()):.2f} µm"
    left.hist(values, bins=25, density=True, color=colour, alpha=0.5, label=label)
left.legend(frameon=False)
left.set(xlabel="RMS STE [µm]", ylabel="density [1/µm]", title="ISO 1328 classes of gear 55")
contributions(samples, right)
right.set_title("which error contributes, class 7")
figure.savefig("scatter.png", dpi=80)
