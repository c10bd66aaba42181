"""A scene over a grid of its keys: what does not depend on a key is computed once."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from gearbench.budget import SMALL, memory_limit, require
from gearbench.contact.assemble import mesh_phases
from gearbench.contact.size import kept_memory
from gearbench.errors import InputError
from gearbench.results.origin import keeping
from gearbench.results.outputs import DEFAULT_OUTPUTS, check_outputs
from gearbench.results.provenance import beyond_elasticity, provenance
from gearbench.results.responses import is_response
from gearbench.scene import Load, Resolution, Scene
from gearbench.scene_file import scene_at
from gearbench.sweeps.axes import TORQUE, Axis, axes_of, grid
from gearbench.sweeps.dataset import combined, over_loads
from gearbench.sweeps.groups import Solver
from gearbench.sweeps.shared import under_loads
from gearbench.threads import default_threads, single_threaded_blas

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.robustness.sampling import Sampler

#: Times the duration of keeping a part of the Dataset until it is kept again, and seconds at least.
KEEP_SHARE, KEEP_LEAST = 20.0, 2.0


def sweep(
    scene: Scene,
    ranges: Mapping[str, Sequence[float] | NDArray] | None = None,
    *,
    outputs: Sequence[str] = DEFAULT_OUTPUTS,
    samples: int = 0,
    seed: int = 0,
    sampler: Sampler = "sobol",
    threads: int | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
    keep: Callable[[xr.Dataset], object] | None = None,
    **keys: Sequence[float] | NDArray,
) -> xr.Dataset:
    """Simulate ``scene`` at every point of the grid of some of its numeric keys.

    Parameters
    ----------
    scene
        What is varied. Where it has several loads, and the torque is not swept, the torque is the last key.
    ranges, **keys
        Values of each key that is swept, several at once: ``torque=[100, 200]``, or, where a key has a dot,
        ``**{"effects.tip_relief.amount": [0, 5]}``; lists by number. No dot: ``[load]``, ``[pair]``, ``[resolution]``.
    outputs, samples, seed, sampler, threads
        As for ``simulate``; with ``samples``, the same at every point as for ``robust``, and responses for outputs.
    progress, keep
        Called with the points done and their number; and now and then with the Dataset so far, in case of a kill.

    Returns
    -------
    Dataset of ``simulate``, or, with samples, of ``robust`` less the errors drawn, with the swept keys as its first
    dimensions, named as given, values ascending. Positions, pairs and segments that a point does not have are NaN, of
    weight 0; after Ctrl-C, so is what was not computed, and ``complete`` is 0. Over several loads, with the shares
    ``load_weight``, each response has its mean ``…_load_mean`` and its greatest value ``…_load_max``. Settings for
    ``resolution.accuracy`` are those of all torques that share contact lines; each point of other keys has its own.

    Raises
    ------
    InputError
        If a key is no number of the scene, a value not allowed, ``samples`` meet an accuracy, or memory is short.

    Examples
    --------
    >>> from gearbench import load_scene
    >>> sweep(load_scene("examples/sc.toml"), torque=[5.0, 10.0, 20.0])["transmission_error_mean"].dims
    ('torque',)
    """
    start = time.perf_counter()
    check_outputs(tuple(outputs))
    swept: dict[str, Any] = {**(ranges or {}), **keys}
    spectrum = () if {"torque", TORQUE} & swept.keys() else scene.loads
    axes = axes_of(swept | ({"torque": [each.torque for each in spectrum]} if spectrum else {}))
    solver = _solver(scene, outputs, {"samples": samples, "seed": seed, "sampler": sampler}, threads)
    points, total = _points(scene, axes, kept=not samples), math.prod(len(each.values) for each in axes)
    own = solver.draws | {"swept": [each.path for each in axes]} | _warning(scene, axes)

    def whole(parts: Sequence[xr.Dataset]) -> xr.Dataset:
        found = over_loads(combined(parts, points, axes), spectrum)
        attrs = provenance(scene, wall_time=time.perf_counter() - start) | own | solver.attrs
        return keeping(found.assign_attrs(attrs | {"complete": int(solver.done == total)}), scene)

    return whole(_solved(points, solver, lambda: progress(solver.done, total), _Keeper(keep=keep, whole=whole)))


def _require_memory(scene: Scene, points: int) -> None:
    """Refuse more points than the memory holds at the resolution of ``scene``, the default one for an accuracy."""
    if scene.resolution.accuracy is not None:
        scene = replace(scene, resolution=Resolution())
    each = kept_memory(scene, len(mesh_phases(scene)[0]))
    instead = f"{int(max(memory_limit(), SMALL) / each)} points would fit"
    require(points * each, "sweep", f"{points} points", instead)


@dataclass(kw_only=True)
class _Keeper:
    """Keeps the Dataset as far as it is, now and then."""

    keep: Callable[[xr.Dataset], object] | None
    whole: Callable[[Sequence[xr.Dataset]], xr.Dataset]
    due: float = field(default_factory=lambda: time.perf_counter() + KEEP_LEAST)

    def look(self, parts: Sequence[xr.Dataset], so_far: Callable[[], xr.Dataset]) -> None:
        """Keep ``parts`` and what ``so_far`` makes, where it is time."""
        if self.keep is None or (begun := time.perf_counter()) < self.due:
            return
        self.keep(self.whole([*parts, so_far()]))
        now = time.perf_counter()
        self.due = now + max(KEEP_LEAST, KEEP_SHARE * (now - begun))


@single_threaded_blas()
def _solved(
    points: Sequence[Sequence[Sequence[Scene]]], solver: Solver, advance: Callable[[], None], keeper: _Keeper
) -> list[xr.Dataset]:
    """Datasets of the groups of all points; after Ctrl-C of those until then, the last one as far as it is."""
    parts: list[xr.Dataset] = []
    for group in (group for groups in points for group in groups):
        so_far = None
        try:
            for so_far in solver.solve(group):
                advance()
                keeper.look(parts, so_far)
        except KeyboardInterrupt:
            if so_far is None and not parts:
                raise
            return parts if so_far is None else [*parts, so_far()]
        assert so_far is not None
        parts.append(so_far())
    return parts


def _solver(scene: Scene, outputs: Sequence[str], draws: dict[str, Any], threads: int | None) -> Solver:
    """What solves the groups, without or with samples, whose responses are those among the outputs."""
    if (samples := draws["samples"]) < 0:
        raise InputError("samples", samples, "must be at least 0")
    if samples and scene.resolution.accuracy is not None:
        raise InputError("samples", samples, "conflicts with resolution.accuracy, for which robust chooses both")
    if samples:
        outputs = () if outputs is DEFAULT_OUTPUTS else tuple(filter(is_response, outputs))
    return Solver(outputs=outputs, draws=draws if samples else {}, threads=threads or default_threads())


def _points(scene: Scene, axes: Sequence[Axis], *, kept: bool) -> list[list[list[Scene]]]:
    """For each point of the keys but the torque: the scenes under its torques, in groups that are solved together.

    Where solutions are ``kept`` they must fit into the memory.
    """
    base = scene.under(scene.load) if scene.loads else scene
    if kept:
        _require_memory(base, math.prod(len(each.values) for each in axes))
    torque = next((each.values for each in axes if each.path == TORQUE), None)
    scenes = [scene_at(base, point) for point in grid([each for each in axes if each.path != TORQUE])]
    return [[[each]] if torque is None else under_loads(each, torque, sampled=not kept) for each in scenes]


def _warning(scene: Scene, axes: Sequence[Axis]) -> dict[str, str]:
    """The warning of the greatest torque, where it has one."""
    torques = [value for each in axes if each.path == TORQUE for value in each.values]
    scene = scene.under(Load(torque=float(max(torques, key=abs)))) if torques else scene
    warning = beyond_elasticity(scene)
    return {} if warning is None else {"warning": warning}
