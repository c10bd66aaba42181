"""Findings: limits for contact finite elements and fast teeth off the line; pictures of errors and curves."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np

from gearbench.lazy import xr
from gearbench.plotting import BLUE, GREEN, ORANGE, new_figure, write_figure
from studies.s09_contact_in_use.data import residual

#: Limits over the mean STE [%]: RMS error of the fast teeth over the cycle, and error bar of contact finite elements.
RESIDUAL, BAR = 1.0, 0.5


def names(dataset: xr.Dataset) -> list[str]:
    """Names of the pairs."""
    return [tomllib.loads(str(text))["name"] for text in dataset["scene"].values]


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check the error bars of all curves, and the residuals of the fast teeth off the line."""
    off = residual(dataset)
    bar = 100 * dataset.transmission_error_uncertainty / dataset.transmission_error.mean("position")
    found = []
    for row, name in enumerate(names(dataset)):
        best, plain, lines = (float(off.sel(model=model)[row]) for model in ("fast_off_line", "fast", "lines_off_line"))
        text = f"{name}: residual {best:.2f} % of the mean (limit {RESIDUAL:g} %), {plain:.2f} % with contact on the "
        found.append((f"{text}line, {lines:.2f} % with teeth of finite elements", best <= RESIDUAL))
        error = float(bar[row])
        found.append((f"{name}: error bar of contact finite elements {error:.2f} % (limit {BAR:g} %)", error <= BAR))
    return found


_STYLES = {
    "fast": ("contact on the line", "s", ORANGE),
    "fast_off_line": ("contact off the line", "o", GREEN),
    "lines_off_line": ("contact off the line, teeth of finite elements", "x", BLUE),
}


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Write ``residual.png`` and ``curves.png``."""
    _residuals(dataset, folder / "residual.png")
    _curves(dataset, folder / "curves.png")


def _residuals(dataset: xr.Dataset, path: Path) -> None:
    figure, axes = new_figure(1, 1, (7.5, 0.27 * dataset.sizes["design"] + 1.6))
    axis, off = axes[0, 0], residual(dataset)
    rows = np.arange(dataset.sizes["design"])
    for model, (label, marker, color) in _STYLES.items():
        axis.plot(off.sel(model=model), rows, marker, color=color, label=label, ms=5)
    axis.axvline(RESIDUAL, color="black", lw=0.8)
    axis.set_xscale("log")
    axis.set_yticks(rows, names(dataset), fontsize=8)
    axis.invert_yaxis()
    axis.set_xlabel("RMS off contact finite elements over the cycle [% of the mean STE]")
    axis.legend(frameon=False, fontsize=8, loc="lower right")
    kept = int((off.sel(model="fast_off_line") <= RESIDUAL).sum())
    axis.set_title(f"Contact off the line: {kept} of {len(rows)} pairs within {RESIDUAL:g} %", fontsize=10)
    write_figure(figure, path)


def _curves(dataset: xr.Dataset, path: Path) -> None:
    count = dataset.sizes["design"]
    columns = min(4, count)
    figure, axes = new_figure(math.ceil(count / columns), columns, (3.0 * columns, 1.9 * math.ceil(count / columns)))
    titles = names(dataset)
    for row, axis in enumerate(axes.ravel()):
        if row >= count:
            axis.set_axis_off()
            continue
        here = dataset.isel(design=row)
        for model in ("fast", "fast_off_line"):
            label, _, color = _STYLES[model]
            curve = here.model_transmission_error.sel(model=model)
            axis.plot(here.mesh_phase, curve, "--" if model == "fast" else "-", color=color, label=label, lw=1.2)
        axis.plot(here.mesh_phase, here.transmission_error, "o", ms=3, color="black", label="contact finite elements")
        axis.set_title(titles[row], fontsize=8)
        axis.tick_params(labelsize=7)
        if row % columns == 0:
            axis.set_ylabel("STE [µm]", fontsize=8)
        if row >= count - columns:
            axis.set_xlabel("mesh phase", fontsize=8)
    axes[0, 0].legend(frameon=False, fontsize=6)
    write_figure(figure, path)
