"""The Dataset of a sweep: those of its points side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearbench.contact.loads import stacked
from gearbench.contact.problem import ContactSolution
from gearbench.accuracy.measure import MEASURED
from gearbench.results.outputs import Solved
from gearbench.robustness.dataset import robust_dataset
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.simulation import dataset
from gearbench.sweeps.axes import TORQUE, Axis
from gearbench.sweeps.shared import Assembled

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.robustness.sampling import Sampler


def loads_dataset(at: Assembled, solutions: Sequence[ContactSolution], dim: str, outputs: Sequence[str]) -> xr.Dataset:
    """Dataset of one scene under several loads: that of ``simulate`` with ``dim`` before its dimensions."""
    solved = Solved(
        scene=at.scene, lines=at.lines, weight=at.weight, problem=at.problem, solution=stacked(solutions)
    )
    return dataset(solved, outputs, 0.0, before=(dim,))


def combined(parts: Sequence[xr.Dataset], axes: Sequence[Axis]) -> xr.Dataset:
    """The Datasets of the grid's points, in its order, along ``axes``; those of a load range hold the torque already.

    Where positions or pairs differ in number, those missing are NaN, and their weight is zero.
    """
    import xarray as xr

    outer = [each for each in axes if each.path != TORQUE]
    parts = [_labelled(part) for part in parts]
    for each in reversed(outer):
        n = len(each.values)
        parts = [
            xr.concat(
                parts[i : i + n], each.name, data_vars="all", coords="different", compat="equals", join="outer",
                combine_attrs="override",
            )
            for i in range(0, len(parts), n)
        ]  # fmt: skip
    (whole,) = parts
    whole = whole.drop_vars([name for name in ("position", "pair") if name in whole.coords])
    if "phase_weight" in whole:
        whole["phase_weight"] = whole["phase_weight"].fillna(0.0)
    names = [each.name for each in axes]
    for each in axes:
        whole = whole.assign_coords({each.name: (each.name, np.array(each.values), {"units": each.unit or "1"})})
    return whole.transpose(*names, ...)


def _labelled(part: xr.Dataset) -> xr.Dataset:
    """With the numbers of positions and tooth pairs as labels, which concatenation goes by."""
    if "position" not in part.dims:
        return part
    return part.assign_coords(position=np.arange(part.sizes["position"]), pair=part["pair_index"].values)


def unfinished(part: xr.Dataset, dim: str, count: int) -> xr.Dataset:
    """A Dataset of fewer loads than were asked for, filled up by NaN to ``count``."""
    missing = count - part.sizes[dim]
    return part.pad({dim: (0, missing)}) if missing else part


def robust_loads_dataset(
    loads: Sequence[Solved], dim: str, samples: int, seed: int, sampler: Sampler, threads: int, more: Sequence[str]
) -> xr.Dataset:
    """Datasets of ``robust`` of one scene under several loads, along ``dim``, without the errors drawn."""
    import xarray as xr

    names = tuple(dict.fromkeys((*MEASURED, *more)))
    parts = []
    for solved in loads:
        problem = prepare_scene(solved.scene, solved)
        errors = problem.draw(samples, seed, sampler)
        answers, complete = respond(problem, errors, threads, names=names)
        if not complete:
            raise KeyboardInterrupt
        run = {"complete": True, "sampler": sampler, "seed": seed, "wall_time": 0.0}
        parts.append(robust_dataset(problem, errors, answers, more=more, **run).drop_vars("error"))
    return xr.concat(parts, dim, data_vars="all", coords="minimal", compat="override", combine_attrs="override")
