"""Limits that solid teeth on their ring keep on gears in use, and on how many of them."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studies.s05_tooth_models.data import ERRORS
from studies.s11_gears_in_use.data import DRAWN

if TYPE_CHECKING:
    import xarray as xr

BEST = "solid + ring"
#: What it is held to: mean, peak-to-peak [%], worst MAC.
LIMITS = {"mean": 1.0, "peak_to_peak": 3.0, "mac": 0.98}


def helix_angles(dataset: xr.Dataset) -> NDArray:
    """β of each pair [°]."""
    pairs = [tomllib.loads(str(text))["pair"] for text in dataset["scene"].values]
    return np.array([pair.get("helix_angle", 0.0) for pair in pairs])


def drawn_later(dataset: xr.Dataset) -> xr.Dataset:
    """The pairs on which nothing was chosen."""
    return dataset.isel(design=dataset["seed"].values != min(DRAWN))


def excess(dataset: xr.Dataset, name: str) -> NDArray:
    """Excess of each pair over the limit of an error, less the error bar of the reference; 0 within it."""
    best = dataset.sel(tooth_model=BEST)
    limit = LIMITS["mean" if "mean" in name else "peak_to_peak"]
    return np.maximum(abs(best[name].values) - best[f"{name}_bar"].values - limit, 0.0)


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Means within 1 %, peak-to-peak within 3 %, worst MAC at least 0.98, as far as the reference can tell.

    Of all pairs, and of those drawn when the default order stood.
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
