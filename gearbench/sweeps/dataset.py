"""The Dataset of a sweep: those of its points side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearbench.accuracy.measure import MEASURED
from gearbench.contact.loads import stacked, under
from gearbench.contact.problem import ContactSolution
from gearbench.results.solved import Solved
from gearbench.robustness.dataset import robust_dataset
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.scene import Scene
from gearbench.solution import dataset
from gearbench.sweeps.axes import Axis
from gearbench.sweeps.shared import Assembled

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.robustness.sampling import Sampler


def loads_dataset(
    at: Assembled, run: Sequence[Scene], found: Sequence[ContactSolution], *, dim: str, outputs: Sequence[str]
) -> xr.Dataset:
    """Dataset of one scene under the loads of ``run``: that of ``simulate`` with ``dim`` before its dimensions."""
    solved = Solved(scene=at.scene, lines=at.lines, weight=at.weight, problem=at.problem, solution=stacked(found))
    return dataset(solved, outputs, 0.0, before=(dim,))


def combined(parts: Sequence[xr.Dataset], axes: Sequence[Axis], loads: Axis | None) -> xr.Dataset:
    """The Datasets of the grid's points, in its order, along ``axes``; each holds its range of ``loads`` already.

    Where positions or pairs differ in number, those missing are NaN, and their weight is zero.
    """
    import xarray as xr

    outer = [each for each in axes if each is not loads]
    parts = [_labelled(part) for part in parts] if outer else parts
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
    whole = whole.drop_vars(["position", "pair", "segment"], errors="ignore")
    if outer and "phase_weight" in whole:
        whole["phase_weight"] = whole["phase_weight"].fillna(0.0)
    coords = {each.name: (each.name, np.array(each.values), {"units": each.unit or "1"}) for each in axes}
    return whole.assign_coords(coords).transpose(*coords, ...)


def _labelled(part: xr.Dataset) -> xr.Dataset:
    """With the numbers of positions, tooth pairs and segments as labels, which concatenation goes by."""
    labels = {dim: np.arange(part.sizes[dim]) for dim in ("position", "segment") if dim in part.dims}
    return part.assign_coords(labels | ({"pair": part["pair_index"].values} if "pair" in part.dims else {}))


def completed(
    parts: Sequence[xr.Dataset], dim: str, runs: Sequence[Sequence[Scene]], *, keep: bool
) -> list[xr.Dataset]:
    """The Datasets of all ``runs``: loads and runs not computed are NaN; without ``dim`` unless it is kept."""
    count = len(runs[0])
    missing = count - parts[-1].sizes[dim]
    last = parts[-1].pad({dim: (0, missing)}) if missing else parts[-1]
    whole = [*parts[:-1], last]
    if len(whole) < len(runs):
        whole += [last.where(False)] * (len(runs) - len(whole))
    return whole if keep else [part.isel({dim: 0}, drop=True) for part in whole]


def robust_loads_dataset(
    at: Assembled,
    run: Sequence[Scene],
    found: Sequence[ContactSolution],
    *,
    dim: str,
    samples: int,
    seed: int,
    sampler: Sampler,
    threads: int,
    more: Sequence[str],
) -> xr.Dataset:
    """Datasets of ``robust`` of one scene under several loads, along ``dim``, without the errors drawn."""
    import xarray as xr

    names = tuple(dict.fromkeys((*MEASURED, *more)))
    parts: list[xr.Dataset] = []
    for scene, solution in zip(run, found, strict=False):
        loaded = under(at.problem, scene.F_bn)
        solved = Solved(scene=scene, lines=at.lines, weight=at.weight, problem=loaded, solution=solution)
        problem = prepare_scene(scene, solved)
        errors = problem.draw(samples, seed, sampler)
        answers, complete = respond(problem, errors, threads, names=names)
        if not complete:
            raise KeyboardInterrupt
        how = {"complete": True, "sampler": sampler, "seed": seed, "wall_time": 0.0}
        parts.append(robust_dataset(problem, errors, answers, more=more, **how).drop_vars("error"))
    return xr.concat(parts, dim, data_vars="all", coords="minimal", compat="override", combine_attrs="override")
