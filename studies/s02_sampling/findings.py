"""Errors of the means, and how the samplers compare."""

from __future__ import annotations

from typing import TYPE_CHECKING

from studies.s02_sampling.data import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr


def relative_error(dataset: xr.Dataset, sampler: str) -> xr.DataArray:
    """RMS over the seeds of the relative error of the means, (gear, count, quantity)."""
    error = dataset[sampler] / dataset["reference"] - 1
    return (error**2).mean("seed") ** 0.5


def overall(dataset: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray]:
    """RMS errors over all gears with 256 Sobol points and with 1000 pseudo-random samples, (quantity,)."""
    sobol = relative_error(dataset, "sobol").sel(sobol_count=256)
    random = relative_error(dataset, "random").sel(random_count=1000)
    return (sobol**2).mean("gear") ** 0.5, (random**2).mean("gear") ** 0.5


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """256 Sobol points against 1000 pseudo-random ones: the error over all gears, each quantity."""
    found = []
    for quantity in QUANTITIES:
        sobol, random = (float(error.sel(quantity=quantity)) for error in overall(dataset))
        text = f"{100 * sobol:.2f} % with 256 Sobol points, {100 * random:.2f} % with 1000 pseudo-random samples"
        found.append((f"{quantity}: error {text}", sobol <= random))
    return found
