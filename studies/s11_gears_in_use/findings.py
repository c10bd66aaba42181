"""Findings: limits for solid teeth on a ring, shares of the pairs that keep them, and pictures of the errors."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.lazy import xr
from gearbench.plotting import BLUE, ORANGE, new_figure, write_figure
from studies.s05_tooth_models.data import ERRORS
from studies.s05_tooth_models.findings import LABELS, boxes
from studies.s11_gears_in_use.data import DRAWN

BEST = "solid + ring"
#: Limits for the errors of BEST: mean and peak-to-peak [%], worst MAC.
LIMITS = {"mean": 1.0, "peak_to_peak": 3.0, "mac": 0.98}


def helix_angles(dataset: xr.Dataset) -> NDArray:
    """Helix angles β of the pairs, (pair,) [°]."""
    pairs = [tomllib.loads(str(text))["pair"] for text in dataset["scene"].values]
    return np.array([pair.get("helix_angle", 0.0) for pair in pairs])


def drawn_later(dataset: xr.Dataset) -> xr.Dataset:
    """Select the second set of pairs, on which nothing was tuned."""
    return dataset.isel(design=dataset["seed"].values != min(DRAWN))


def excess(dataset: xr.Dataset, name: str) -> NDArray:
    """Excess of an error over its limit and the error bar of the reference, (pair,); 0 within the limit."""
    best = dataset.sel(tooth_model=BEST)
    limit = LIMITS["mean" if "mean" in name else "peak_to_peak"]
    return np.maximum(abs(best[name].values) - best[f"{name}_bar"].values - limit, 0.0)


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check means within 1 %, peak-to-peak within 3 %, and worst MAC at least 0.98, beyond the error bars.

    The checks cover all pairs, and the second set alone.
    """
    later = drawn_later(dataset)
    return _checks(dataset, "") + (_checks(later, "drawn later: ") if later.sizes["design"] else [])


def _checks(dataset: xr.Dataset, which: str) -> list[tuple[str, bool]]:
    found, best = [], dataset.sel(tooth_model=BEST)
    pairs = dataset.sizes["design"]
    for name in ERRORS:
        limit = LIMITS["mean" if "mean" in name else "peak_to_peak"]
        error, beyond = abs(best[name].values), excess(dataset, name) > 0
        text = f"{which}{BEST}: {name.replace('_', ' ')} within {limit:g} % on {np.count_nonzero(error <= limit)} of"
        text += f" {pairs} pairs, largest {error.max():.2f} %; beyond the error bar on {np.count_nonzero(beyond)}"
        found.append((text, not beyond.any()))
    mac = best["mac"].values
    text = f"{which}{BEST}: MAC at least {LIMITS['mac']} on {np.count_nonzero(mac >= LIMITS['mac'])} of {pairs} pairs"
    found.append((f"{text}, least {mac.min():.3f}", bool((mac >= LIMITS["mac"]).all())))
    return found


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Draw the distribution of the errors of every model, and the errors of the best model over the helix angle."""
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
