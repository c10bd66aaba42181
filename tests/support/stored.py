"""Datasets of studies that are kept in the repository; the pages of results are based on them."""

from __future__ import annotations

from functools import cache

import xarray as xr

from gearbench.results.netcdf import open_result
from tests.support.paths import ROOT


@cache
def stored(study: str) -> xr.Dataset:
    return open_result(ROOT / "studies" / study / "dataset.nc")
