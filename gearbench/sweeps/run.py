"""A scene over a grid of its keys: what does not depend on a key is computed once."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from gearbench.contact.loads import solve_loads
from gearbench.contact.problem import ContactSolution
from gearbench.errors import InputError
from gearbench.interruption import arrived
from gearbench.results.outputs import DEFAULT_OUTPUTS, check_outputs
from gearbench.results.provenance import beyond_elasticity, provenance
from gearbench.results.responses import is_response
from gearbench.robustness.montecarlo import default_threads
from gearbench.scene import Load, Scene
from gearbench.scene_file import scene_at
from gearbench.schema import changed, read
from gearbench.sweeps.axes import TORQUE, Axis, axes_of, grid
from gearbench.sweeps.dataset import combined, completed, loads_dataset, robust_loads_dataset
from gearbench.sweeps.shared import Shared

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
    outputs, samples, seed, sampler
        As for ``simulate``; with ``samples``, the same error samples at every point as for ``robust``, and the
        responses among the outputs.
    threads, progress
        As for ``robust``; called with the points done and their number.

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

    Examples
    --------
    >>> from gearbench import load_scene
    >>> sweep(load_scene("examples/sc.toml"), torque=[5.0, 10.0, 20.0])["transmission_error_mean"].dims
    ('torque',)
    """
    start = time.perf_counter()
    check_outputs(tuple(outputs))
    if samples < 0:
        raise InputError("samples", samples, "must be at least 0")
    axes, count = axes_of({**(ranges or {}), **keys}), threads or default_threads()
    # where flanks touch off the line of action, the load decides how far contact lines reach: each has its own
    shares = scene.effect("off_line_contact") is None
    # so do the torques of either flank
    loads = next((each for each in axes if each.path == TORQUE and shares and each.one_sign), None)
    dim, runs = _runs(scene, axes, loads)
    draws = {"samples": samples, "seed": seed, "sampler": sampler} if samples else {}
    parts, complete = _solved(runs, count, progress, _reduction(dim, outputs, draws, count))
    whole = combined(completed(parts, dim, runs, keep=loads is not None), axes, loads)
    own = draws | {"complete": int(complete), "swept": [each.path for each in axes]}
    return whole.assign_attrs(provenance(scene, wall_time=time.perf_counter() - start) | own | _warning(scene, axes))


def _warning(scene: Scene, axes: Sequence[Axis]) -> dict[str, str]:
    """The warning of the greatest torque, where it has one."""
    greatest = max((float(max(each.values)) for each in axes if each.path == TORQUE), default=scene.load.torque)
    warning = beyond_elasticity(changed(scene, load=Load(torque=greatest)))
    return {} if warning is None else {"warning": warning}


def _reduction(dim: str, outputs: Sequence[str], draws: dict[str, Any], threads: int) -> Callable[..., xr.Dataset]:
    """From a scene solved under several loads to their Dataset."""
    if not draws:
        return partial(loads_dataset, dim=dim, outputs=outputs)
    asked = () if outputs is DEFAULT_OUTPUTS else tuple(filter(is_response, outputs))
    return partial(robust_loads_dataset, dim=dim, more=asked, threads=threads, **draws)


def _runs(scene: Scene, axes: Sequence[Axis], torque: Axis | None) -> tuple[str, list[list[Scene]]]:
    """The dimension of the loads ``torque``, and the scenes: for each point of the other keys one under each load."""
    scenes = [scene_at(scene, point) for point in grid([each for each in axes if each is not torque])]
    if torque is None:
        return "torque", [[each] for each in scenes]
    loads = [read(Load, {"torque": value}, "load") for value in torque.values]
    return torque.name, [[changed(each, load=load) for load in loads] for each in scenes]


def _solved(
    runs: Sequence[Sequence[Scene]], threads: int, progress: Callable[[int, int], None], reduce: Callable[..., Any]
) -> tuple[list[xr.Dataset], bool]:
    """Datasets of the runs, each one scene under several loads; and whether all were finished."""
    shared, parts, done = Shared(), [], 0
    for run in runs:
        found: list[ContactSolution] = []
        at = None
        try:
            at = shared.assembled(run[0])
            for solution in solve_loads(at.problem, [scene.F_bn for scene in run], threads):
                found.append(solution)
                progress(done + len(found), sum(map(len, runs)))
            parts.append(reduce(at, run, found))
        except KeyboardInterrupt:
            arrived()
            if at is not None and found:
                parts.append(reduce(at, run, found))
            if not parts:
                raise
            return parts, False
        done += len(run)
    return parts, True
