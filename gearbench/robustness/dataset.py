"""The Dataset of a robustness run: samples, their statistics, and which error contributes how much."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.provenance import provenance
from gearbench.quantities import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.robustness.montecarlo import Responses, RobustProblem
    from gearbench.robustness.sampling import Sampler

#: Samples that first-order indices are estimated from at most: more would cost memory and no longer change a figure.
ENOUGH = 8192
#: Responses that get statistics and sensitivities.
STUDIED = ("transmission_error_rms", "mesh_stiffness_rms")


def robust_dataset(
    problem: RobustProblem,
    errors: NDArray,
    responses: Responses,
    *,
    complete: bool,
    sampler: Sampler,
    seed: int,
    wall_time: float,
) -> xr.Dataset:
    """Dataset over the samples that were computed; ``errors`` (sample, error) [µm]."""
    import xarray as xr

    from gearbench.robustness.sensitivity import first_order_indices
    from gearbench.robustness.statistics import summarise

    count = len(responses)
    errors = errors[:count]
    sample = ("transmission_error_rms", "mesh_stiffness_rms", "transmission_error_mean", "mesh_stiffness_mean")
    variables: dict[str, tuple] = {
        name: ("sample", getattr(responses, name), QUANTITIES[name].attrs) for name in sample
    }
    variables["error"] = (("sample", "error_name"), errors, QUANTITIES["error"].attrs)
    for name in STUDIED if count > 1 else ():
        values, base = getattr(responses, name), QUANTITIES[name]
        for statistic, (value, standard_error) in summarise(values, sampler).items():
            attrs = {**base.attrs, "long_name": f"{statistic} over the samples of {base.long_name}"}
            variables[f"{name}_{statistic}"] = ((), value, attrs)
            attrs = {**attrs, "long_name": f"standard error of the {attrs['long_name']}"}
            variables[f"{name}_{statistic}_standard_error"] = ((), standard_error, attrs)
        index, uncertainty = first_order_indices(errors[:ENOUGH], values[:ENOUGH])
        attrs = {"units": "1", "long_name": f"share of each error in the variance of {base.long_name}", "symbol": "S"}
        variables[f"{name}_first_order"] = ("error_name", index, attrs)
        attrs = {**attrs, "long_name": f"standard error of the {attrs['long_name']}"}
        variables[f"{name}_first_order_standard_error"] = ("error_name", uncertainty, attrs)
    attrs = provenance(problem.scene, wall_time=wall_time, seed=seed)
    attrs |= {"sampler": sampler, "samples": count, "complete": int(complete), "rescued": responses.rescued}
    return xr.Dataset(variables, coords={"error_name": np.array(problem.names, dtype=str)}, attrs=attrs)
