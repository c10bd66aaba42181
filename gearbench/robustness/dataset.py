"""Dataset of a robustness run: samples, statistics, and the contribution of each error to the variance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.lazy import xr
from gearbench.results.origin import with_grids
from gearbench.results.points import Columns
from gearbench.results.provenance import provenance
from gearbench.results.responses import described
from gearbench.threads import single_threaded_blas

if TYPE_CHECKING:
    from gearbench.robustness.montecarlo import Responses, Sampled
    from gearbench.robustness.sampling import Sampler

#: Maximum number of samples for the Sobol indices; more would cost memory without changing the result.
MOST_FOR_SHARES = 8192
#: Reason why shares of the variance, or standard errors, may be NaN.
MISSING = "NaN where the samples are too few to tell, or the response does not vary"


@dataclass(frozen=True, kw_only=True)
class Run:
    """Record of a run: whether all samples were computed, how they were drawn, and the time [s]."""

    complete: bool
    sampler: Sampler
    seed: int
    wall_time: float


@single_threaded_blas()
def robust_dataset(
    problem: Sampled,
    errors: NDArray,
    responses: Responses,
    *,
    run: Run,
    more: Sequence[str] = (),
    shares: bool = True,
) -> xr.Dataset:
    """Dataset of the samples that were computed.

    Parameters
    ----------
    problem, errors
        The prepared scene, and the errors drawn (sample, error) [µm].
    responses
        Responses of the samples.
    run
        Record of the run.
    more
        Names of further responses that get statistics.
    shares
        Whether to include the variables of ``share_columns``.
    """
    from gearbench.robustness.cells import cell_warning

    coords, variables = robust_columns(problem, errors, responses, run.sampler, more, shares=shares)
    variables["error"] = (("sample", "error_name"), errors[: len(responses)])
    attrs = provenance(problem.scene, wall_time=run.wall_time, seed=run.seed)
    attrs |= {"sampler": run.sampler, "samples": len(responses)}
    attrs |= {"complete": int(run.complete), "rescued": responses.rescued}
    if (line := cell_warning(variables)) is not None:
        attrs["warning"] = "\n".join(filter(None, (attrs.get("warning"), line)))
    return with_grids(xr.Dataset(described(variables, MISSING), coords=coords, attrs=attrs), problem.scene)


def robust_columns(
    problem: Sampled,
    errors: NDArray,
    responses: Responses,
    sampler: Sampler,
    more: Sequence[str] = (),
    *,
    shares: bool = True,
) -> tuple[Columns, Columns]:
    """Coordinates and variables of ``robust_dataset``, except the errors drawn."""
    count = len(responses)
    errors, studied = errors[:count], tuple(dict.fromkeys((*problem.studied, *more))) if count > 1 else ()
    dims = {name: ("sample", dim) for name, (dim, _) in problem.further.items()}
    variables: Columns = {name: (dims.get(name, ("sample",)), values) for name, values in responses.values.items()}
    values = {name: responses[name] for name in studied}
    variables |= problem.columns(errors, studied) | statistic_columns(values, sampler)
    variables |= share_columns(values, errors) if shares else {}
    return problem.coords, variables


def statistic_columns(values: Mapping[str, NDArray], sampler: Sampler) -> Columns:
    """Mean, standard deviation and maximum of responses (sample,), each with its standard error."""
    from gearbench.robustness.statistics import summarise

    columns: Columns = {}
    for name, samples in values.items():
        for statistic, (value, standard_error) in summarise(samples, sampler).items():
            columns[f"{name}_{statistic}"] = (), np.array(value)
            columns[f"{name}_{statistic}_standard_error"] = (), np.array(standard_error)
    return columns


def share_columns(values: Mapping[str, NDArray], errors: NDArray) -> Columns:
    """Shares of the ``errors`` (sample, error) in the variance of responses, and changes of means by finer classes."""
    from gearbench.robustness.sensitivity import sensitivities
    from gearbench.robustness.tightening import FINER

    columns: Columns = {}
    n = MOST_FOR_SHARES
    by_response = sensitivities(errors[:n], [samples[:n] for samples in values.values()], FINER)
    for name, sensitivity in zip(values, by_response, strict=True):
        for part in ("first_order", "total", "tightened"):
            value, uncertainty = getattr(sensitivity, part)
            columns[f"{name}_{part}"] = ("error_name",), value
            columns[f"{name}_{part}_standard_error"] = ("error_name",), uncertainty
    return columns
