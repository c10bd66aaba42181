"""Dataset of a sweep: the results of its points combined, and statistics over several loads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gearbench.lazy import xr
from gearbench.loads import WeightedLoad, load_weights
from gearbench.results.points import Point, join_points
from gearbench.results.responses import OVER_LOADS, described, is_response
from gearbench.robustness.statistics import summarise
from gearbench.sweeps.axes import SweepAxis

#: Attribute of a Dataset that explains its missing values.
MISSING = "positions, pairs and segments that a point does not have are NaN; such positions have the phase_weight 0"
#: Reason for missing values of trains.
PARTED = "NaN where flanks part; uniform phases give no noise floor, and harmonics below half their number only"


def combined(points: Mapping[tuple[float, ...], Point], axes: Sequence[SweepAxis]) -> xr.Dataset:
    """Combine the results at ``points`` into one Dataset whose first dimensions are the ``axes``.

    ``points`` maps values along the axes to results. Missing points are NaN, as are positions, pairs and segments that
    a point does not have; these positions have the weight 0. The attribute ``missing`` says so. A coordinate depends
    only on the axes along which it changes.
    """
    by_position: dict[tuple[float, ...], Point] = dict(points)
    for i in reversed(range(len(axes))):
        grouped: dict[tuple[float, ...], dict[float, Point]] = {}
        for position, point in by_position.items():
            grouped.setdefault(position[:i], {})[position[i]] = point
        by_position = {
            position: join_points([column.get(x) for x in axes[i].values], axes[i].name)
            for position, column in grouped.items()
        }
    (joined,) = by_position.values()
    coords, attrs = dict(joined.coords), {}
    if "phase_weight" in coords:
        dims, weight = coords["phase_weight"]
        coords["phase_weight"] = dims, np.nan_to_num(weight)
    if any(point.sizes.get(d, n) < n for point in points.values() for d, n in joined.sizes.items()):
        attrs = {"missing": MISSING}
    swept = {each.name: (each.name, np.array(each.values), {"units": each.unit or "1"}) for each in axes}
    names = [each.name for each in axes]
    variables = described(joined.variables, PARTED if "mesh_load" in joined.variables else "")
    return xr.Dataset(variables, coords=described(coords) | swept, attrs=attrs).transpose(*names, ...)


def over_loads(dataset: xr.Dataset, loads: Sequence[WeightedLoad]) -> xr.Dataset:
    """Add the weighted mean and the maximum of each response over several ``loads``, and the weights of the loads."""
    if not loads:
        return dataset
    weight = dataset["torque"].copy(data=load_weights(loads))
    metrics: dict[str, xr.DataArray] = {}
    for name, values in dataset.data_vars.items():
        if "torque" in values.dims and is_response(str(name)):
            metrics[f"{name}_load_mean"] = (values * weight).sum("torque", skipna=False)
            metrics[f"{name}_load_max"] = values.max("torque", skipna=False)
            if f"{name}_std" in dataset:
                for kind in OVER_LOADS:
                    metrics |= _statistics(f"{name}{kind}", metrics[f"{name}{kind}"], dataset.attrs["sampler"])
    added = described({name: (x.dims, x.values) for name, x in {"load_weight": weight, **metrics}.items()})
    return dataset.assign(added).set_coords("load_weight")


def _statistics(name: str, values: xr.DataArray, sampler: Any) -> dict[str, xr.DataArray]:
    """Statistics of ``values`` over the samples, with their standard errors."""
    first = values.isel(sample=0, drop=True)
    rows = [
        summarise(row, sampler) for row in values.transpose(..., "sample").values.reshape(-1, values.sizes["sample"])
    ]
    statistics = {}
    for statistic in rows[0]:
        both = np.array([row[statistic] for row in rows]).reshape(*first.shape, 2)
        statistics[f"{name}_{statistic}"] = first.copy(data=both[..., 0])
        statistics[f"{name}_{statistic}_standard_error"] = first.copy(data=both[..., 1])
    return statistics
