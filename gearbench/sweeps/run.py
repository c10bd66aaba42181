"""A scene over a grid of its keys: what does not depend on a key is computed once."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from gearbench.contact.loads import solve_loads, under
from gearbench.contact.problem import ContactSolution
from gearbench.errors import InputError
from gearbench.results.outputs import DEFAULT_OUTPUTS, Solved, check_outputs
from gearbench.results.provenance import provenance
from gearbench.results.responses import is_response
from gearbench.robustness.montecarlo import default_threads
from gearbench.scene import Load, Scene
from gearbench.schema import read
from gearbench.sweeps.axes import TORQUE, axes_of, grid, scene_at
from gearbench.sweeps.dataset import combined, loads_dataset, robust_loads_dataset, unfinished
from gearbench.sweeps.shared import Assembled, Shared

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.robustness.sampling import Sampler


def sweep(
    scene: Scene,
    ranges: Mapping[str, Sequence[float]] | None = None,
    *,
    outputs: Sequence[str] = DEFAULT_OUTPUTS,
    samples: int = 0,
    seed: int = 0,
    sampler: Sampler = "sobol",
    threads: int | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
    **keys: Sequence[float],
) -> xr.Dataset:
    """Simulate ``scene`` at every point of the grid of some of its numeric keys.

    Parameters
    ----------
    scene
        What is varied.
    ranges, **keys
        Values of each key that is swept, several at once: ``torque=[100, 200]``, or, where a key has a dot,
        ``**{"effects.tip_relief.amount": [0, 5, 10]}``. A key without a dot is one of ``[load]``, ``[pair]`` or
        ``[resolution]``.
    outputs
        As for ``simulate``; with ``samples``, the responses among them.
    samples, seed, sampler
        Number of error samples at every point, the same ones, as for ``robust``; 0: the scene as it is.
    threads, progress
        Number of threads, as many as processors by default; called with the points done and how many there are.

    Returns
    -------
    Dataset of ``simulate``, or, with samples, of ``robust`` less the errors drawn, with the swept keys as its first
    dimensions, named as given, values ascending. Where mesh phases depend on a key, so does ``mesh_phase``; positions
    and pairs that a point does not have are NaN, of weight 0. After Ctrl-C what was not computed is NaN, and the
    attribute ``complete`` is 0.

    Raises
    ------
    InputError
        If a key is none of the scene's numbers, a value is not allowed, or the scene gives ``resolution.accuracy``.
    ConvergenceError
        As ``simulate``.

    Examples
    --------
    >>> from gearbench import load_scene
    >>> dataset = sweep(load_scene("examples/sc.toml"), torque=[5.0, 10.0, 20.0])
    >>> dataset["transmission_error"].dims, dataset["transmission_error_mean"].dims
    (('torque', 'position'), ('torque',))
    """
    start = time.perf_counter()
    check_outputs(tuple(outputs))
    if samples < 0:
        raise InputError("samples", samples, "must be at least 0")
    axes = axes_of({**(ranges or {}), **keys})
    torque = next((each for each in axes if each.path == TORQUE), None)
    outer = [each for each in axes if each is not torque]
    scenes = [scene_at(scene, point) for point in grid(outer)]
    dim = torque.name if torque else "torque"
    runs = [[replace(each, load=load) for load in _loads(each, torque and torque.values)] for each in scenes]
    count = threads or default_threads()

    def dataset(at: Assembled, run: Sequence[Scene], found: Sequence[ContactSolution]) -> xr.Dataset:
        if not samples:
            return loads_dataset(at, found, dim, outputs)
        solved = [
            Solved(scene=s, lines=at.lines, weight=at.weight, problem=under(at.problem, s.F_bn), solution=each)
            for s, each in zip(run, found, strict=False)
        ]
        more = tuple(name for name in outputs if is_response(name) and outputs is not DEFAULT_OUTPUTS)
        return robust_loads_dataset(solved, dim, samples, seed, sampler, count, more)

    parts, complete = _solved(runs, count, progress, dataset)
    parts = [unfinished(part, dim, len(runs[0])) for part in parts]
    parts += [parts[0].where(False)] * (len(runs) - len(parts))
    if torque is None:
        parts = [part.isel({dim: 0}, drop=True) for part in parts]
    attrs: dict[str, Any] = {**provenance(scene, wall_time=time.perf_counter() - start), "complete": int(complete)}
    attrs |= {"swept": [each.path for each in axes]}
    attrs |= {"samples": samples, "seed": seed, "sampler": sampler} if samples else {}
    return combined(parts, axes).assign_attrs(attrs)


def _loads(scene: Scene, torques: Sequence[float] | None) -> Iterator[Load]:
    """The scene's own load, or those of ``torques``."""
    for torque in torques or ():
        yield read(Load, {"torque": torque}, "load")
    if torques is None:
        yield scene.load


def _solved(
    runs: Sequence[Sequence[Scene]], threads: int, progress: Callable[[int, int], None], dataset: Callable[..., Any]
) -> tuple[list[xr.Dataset], bool]:
    """Datasets of the runs, each one scene under several loads; and whether all were finished."""
    shared, done, parts, found = Shared(), 0, [], []
    try:
        for run in runs:
            found = []
            at = shared.assembled(run[0])
            for solution in solve_loads(at.problem, [scene.F_bn for scene in run], threads):
                found.append(solution)
                done += 1
                progress(done, sum(map(len, runs)))
            parts.append(dataset(at, run, found))
    except KeyboardInterrupt:
        if not parts and not found:
            raise
        return [*parts, *([dataset(at, run, found)] if found else [])], False
    return parts, True
