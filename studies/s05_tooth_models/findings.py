"""Limits that the best fast teeth keep on every pair."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.s05_tooth_models.data import ERRORS

if TYPE_CHECKING:
    import xarray as xr

#: The models that are to be trusted, and what they are held to: mean, peak-to-peak [%], worst MAC.
BEST = {"clamped": "solid", "rim": "solid + ring"}
LIMITS = {"mean": 3.0, "peak_to_peak": 6.0, "mac": 0.97}


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """The best fast tooth on every pair: mean within 3 %, peak-to-peak within 6 %, worst MAC at least 0.97."""
    found = []
    for support, model in BEST.items():
        here = dataset.sel({f"{support}_model": model})
        for name in ERRORS:
            limit = LIMITS["mean" if "mean" in name else "peak_to_peak"]
            error = np.abs(here[f"{support}_{name}"])
            text = (
                f"{support}, {model}: {name.replace('_', ' ')} at most {float(error.max()):.2f} % (limit {limit:g} %)"
            )
            found.append((text, bool((error <= limit).all())))
        worst = float(here[f"{support}_mac"].min())
        found.append((f"{support}, {model}: worst MAC {worst:.4f} (limit {LIMITS['mac']})", worst >= LIMITS["mac"]))
    return found
