"""Limits: contact finite elements know their error, and the fast teeth with contact off the line keep to them."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING

from studies.s09_contact_in_use.data import residual

if TYPE_CHECKING:
    import xarray as xr

#: RMS over the cycle of what the fast teeth miss, and the error bar of the contact finite elements, over the mean [%].
RESIDUAL, BAR = 1.0, 0.5


def names(dataset: xr.Dataset) -> list[str]:
    """Name of each pair."""
    return [tomllib.loads(str(text))["name"] for text in dataset["scene"].values]


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """The error bar of every curve, and the residual of the fast teeth off the line."""
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
