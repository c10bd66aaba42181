"""Plots of results. A plot function draws on given or new axes and returns them; ``draw_…`` write PNG files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gearbench.dynamics.figures import draw_response
from gearbench.geometry.pair import Pair
from gearbench.hunting.figures import draw_side_bands, side_bands
from gearbench.lazy import xr
from gearbench.plotting import (
    contributions,
    density,
    draw_robust,
    draw_simulation,
    load_distribution,
    load_map,
    order_spectrum,
    over_two_periods,
)
from gearbench.sweeps.figures import draw_sweep, harris_map, orders_over_torque, peak_to_peak_over_torque
from gearbench.sweeps.relieve import draw_relief
from gearbench.trains.figures import load_shares

__all__ = [
    "contributions",
    "density",
    "draw_relief",
    "draw_response",
    "draw_robust",
    "draw_side_bands",
    "draw_simulation",
    "draw_sweep",
    "harris_map",
    "load_distribution",
    "load_map",
    "load_shares",
    "order_spectrum",
    "orders_over_torque",
    "over_two_periods",
    "peak_to_peak_over_torque",
    "side_bands",
    "write_loaded_tooth",
]


def write_loaded_tooth(pair: Pair, dataset: xr.Dataset, path: str | Path, **options: Any) -> None:
    """Write a loaded tooth for ParaView; see ``fem_reference.export.write_loaded_tooth`` (needs the extra ``fem``)."""
    from fem_reference.export import write_loaded_tooth as write

    write(pair, dataset, path, **options)
