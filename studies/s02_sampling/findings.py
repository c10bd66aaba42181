"""Errors of the means, and how the samplers compare."""

from __future__ import annotations

from typing import TYPE_CHECKING

from studies.s02_sampling.data import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr


def relative_error(dataset: xr.Dataset, sampler: str, quantity: str) -> xr.DataArray:
    """RMS over the seeds of the relative error of a mean, (gear, count)."""
    rows = dataset["error"].isel(setting=dataset["setting_knob"].values == f"samples, {sampler}")
    return rows.sel(quantity=QUANTITIES[quantity]).swap_dims(setting="size")


def compared(dataset: xr.Dataset, quantity: str) -> tuple[float, float]:
    """RMS errors over all gears: with 256 Sobol points, with 1000 pseudo-random samples."""
    sobol = relative_error(dataset, "sobol", quantity).sel(size=256)
    random = relative_error(dataset, "random", quantity).sel(size=1000)
    return float((sobol**2).mean() ** 0.5), float((random**2).mean() ** 0.5)


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """256 Sobol points against 1000 pseudo-random ones: the error over all gears, each quantity."""
    found = []
    for quantity in QUANTITIES:
        sobol, random = compared(dataset, quantity)
        text = f"{100 * sobol:.2f} % with 256 Sobol points, {100 * random:.2f} % with 1000 pseudo-random samples"
        found.append((f"{quantity}: error {text}", sobol <= random))
    return found
