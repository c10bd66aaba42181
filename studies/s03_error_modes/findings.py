"""Bounds of the shapes of manufacturing errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """No shape exceeds its amplitude or goes below zero."""
    return [
        (f"{kind}: gap between 0 and 1 µm for an error of 1 µm", bool((v >= -1e-12).all() and (v <= 1 + 1e-12).all()))
        for kind, v in dataset.data_vars.items()
    ]
