"""Errors of every model, and of the best one over the helix angle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.plotting import BLUE, ORANGE, new_figure, write_figure
from studies.s05_tooth_models.data import ERRORS
from studies.s05_tooth_models.pictures import LABELS, boxes
from studies.s11_gears_in_use.findings import BEST, LIMITS, helix_angles

if TYPE_CHECKING:
    import xarray as xr


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Distribution of the errors of every model; those of the best one over the helix angle."""
    _models(dataset, folder)
    _helix(dataset, folder)


def _models(dataset: xr.Dataset, folder: Path) -> None:
    figure, axes = new_figure(1, 4, (13, 3.8), sharey=True)
    boxes(axes[0], dataset[list(ERRORS)], LIMITS, (-50, -2, 0, 2, 50))
    refused = int(np.isnan(dataset[ERRORS[0]].sel(tooth_model="plate + Sainsot–Velex").values).sum())
    figure.suptitle(
        f"{dataset.sizes['design']} pairs of gears in use against finite elements of the whole gears; Sainsot–Velex"
        f" refuses {refused} of them\n(box: quartiles; whiskers: all pairs; shaded: limits 1 % and 3 %)",
        fontsize=10,
    )
    write_figure(figure, folder / "errors_in_use.png")


def _helix(dataset: xr.Dataset, folder: Path) -> None:
    figure, ((left, right),) = new_figure(1, 2, (10, 3.8))
    best, beta = dataset.sel(tooth_model=BEST), helix_angles(dataset)
    for name, label, colour in zip(ERRORS, LABELS, (ORANGE, BLUE, ORANGE, BLUE), strict=True):
        marker = "o" if "transmission" in name else "s"
        style = {"fmt": marker, "ms": 4, "lw": 0.8, "color": colour, "mfc": "none" if "stiff" in name else colour}
        left.errorbar(beta, best[name], best[f"{name}_bar"], label=label, alpha=0.6, **style)
    for limit in (LIMITS["peak_to_peak"], -LIMITS["peak_to_peak"]):
        left.axhline(limit, color="0.4", lw=0.8, ls=":")
    left.set(xlabel="helix angle [°]", ylabel="error [%], bars: of the reference")
    left.legend(frameon=False, fontsize=8)
    right.plot(beta, best["mac"], "o", ms=4, color=BLUE, alpha=0.6)
    right.axhline(LIMITS["mac"], color="0.4", lw=0.8, ls=":")
    right.set(xlabel="helix angle [°]", ylabel="worst MAC of the deflection shapes")
    figure.suptitle(f"{BEST}, default order, on {dataset.sizes['design']} pairs of gears in use", fontsize=10)
    write_figure(figure, folder / "helix_angle.png")
