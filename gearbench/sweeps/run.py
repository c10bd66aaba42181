"""Simulation of a scene over a grid of its keys. Parts that do not depend on a key are computed once."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import covered
from gearbench.budget import require, room
from gearbench.contact.size import kept_memory
from gearbench.contact.transitions import mesh_phases
from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.results.origin import with_grids
from gearbench.results.outputs import DEFAULT_OUTPUTS, check_outputs
from gearbench.results.points import Point, of_each_load
from gearbench.results.provenance import beyond_elasticity, provenance
from gearbench.results.responses import is_response
from gearbench.results.solved import Solved
from gearbench.robustness.adaptive import ERROR_OVER_CHANGE
from gearbench.robustness.dataset import robust_columns
from gearbench.robustness.montecarlo import Sampled, respond_with_usual
from gearbench.scene import Load, Resolution, Scene, check_scene
from gearbench.scene_file import scene_at
from gearbench.solution import columns
from gearbench.sweeps.axes import MESH, SweepAxis, axes_of, grid
from gearbench.sweeps.dataset import combined, over_loads
from gearbench.sweeps.loads import TORQUE, Shared, solve_group, under_loads
from gearbench.threads import default_threads, single_threaded_blas

if TYPE_CHECKING:
    from gearbench.accuracy.choose import Choice
    from gearbench.trains.solve import SolvedTrain

#: Pause between two saves of the partial Dataset: a multiple of the duration of a save, and a least number of seconds.
KEEP_SHARE, KEEP_LEAST = 20.0, 2.0


def sweep(
    scene: Scene,
    ranges: Mapping[str, Sequence[float] | NDArray] | None = None,
    *,
    outputs: Sequence[str] = DEFAULT_OUTPUTS,
    samples: int = 0,
    threads: int | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
    keep: Callable[[xr.Dataset], object] | None = None,
    **keys: Any,
) -> xr.Dataset:
    """Simulate ``scene`` at every point of the grid of some of its numeric keys.

    Parameters
    ----------
    scene
        Scene to vary. If it has several loads and the torque is not swept, the torque is added as last key. If it has
        several meshes, the last dimension is ``mesh``.
    ranges, **keys
        Values of the swept keys: ``torque=[100, 200]``, or ``**{"effects.tip_relief.amount": [0, 5]}`` for a key with
        dots, where list items are numbers. Keys without a dot belong to ``[load]``, ``[pair]`` or ``[resolution]``.
    outputs, threads
        As for ``simulate``.
    samples
        If above 0, every point is computed like ``robust``, with the same samples at all points, and ``outputs`` are
        its ``responses``. ``seed`` and ``sampler`` may be given too, as for ``robust``.
    progress, keep
        ``progress`` is called with the number of points done and of all points. ``keep`` is called from time to time
        with the Dataset so far, so that an interruption loses little.

    Returns
    -------
    Dataset of ``simulate``, or, with samples, of ``robust`` without the drawn errors. Its first dimensions are the
    swept keys, named as given, with ascending values. Positions, pairs and segments that a point does not have are NaN
    with the weight 0. After Ctrl-C points that were not computed are NaN, and ``complete`` is 0. For several loads with
    the shares ``load_weight``, each response also has its mean ``…_load_mean`` and maximum ``…_load_max``. With
    ``resolution.accuracy`` the settings are chosen once for all torques that share contact lines, and separately for
    each point of the other keys.

    Raises
    ------
    InputError
        If a key is not a number of the scene, a value is not allowed, ``samples`` are combined with
        ``resolution.accuracy``, or memory does not suffice.

    Examples
    --------
    >>> from gearbench import read_scene
    >>> sweep(read_scene("examples/sc.toml"), torque=[5.0, 10.0, 20.0])["transmission_error_mean"].dims
    ('torque',)
    """
    check_scene(scene)
    start = time.perf_counter()
    check_outputs(tuple(outputs))
    drawing = {name: keys.pop(name) for name in ("seed", "sampler") if name in keys}
    swept = {**(ranges or {}), **keys}
    spectrum = () if {"torque", TORQUE} & swept.keys() else scene.loads
    swept |= {"torque": [each.torque for each in spectrum]} if spectrum else {}
    axes = axes_of(swept, tuple(scene.meshes), coupled=scene.coupled)
    total = math.prod(len(each.values) for each in axes)
    solver = _solver(scene, outputs, {"samples": samples, "seed": 0, "sampler": "sobol"} | drawing, threads)
    groups = _groups(scene, axes, sampled=samples > 0)

    def dataset_of(solved: Mapping[tuple[float, ...], Point]) -> xr.Dataset:
        attrs = provenance(scene, wall_time=time.perf_counter() - start) | solver.draws | solver.attrs
        paths = [each.path for each in axes] + [MESH] * scene.coupled
        attrs |= {"swept": paths, "complete": int(len(solved) == total)} | _warning(scene, axes)
        return with_grids(over_loads(combined(solved, axes).assign_attrs(attrs), spectrum), scene)

    return dataset_of(_solved(groups, solver, lambda done: progress(done, total), _Keeper(keep=keep, whole=dataset_of)))


@dataclass(kw_only=True)
class _Keeper:
    """Saves the partial Dataset from time to time.

    Parameters
    ----------
    keep
        Function that saves a Dataset; None: nothing is saved.
    whole
        Function that makes the Dataset of the points solved so far.
    due
        Time of the next save [s].
    """

    keep: Callable[[xr.Dataset], object] | None
    whole: Callable[[Mapping[tuple[float, ...], Point]], xr.Dataset]
    due: float = field(default_factory=lambda: time.perf_counter() + KEEP_LEAST)

    def save_if_due(self, solved: Mapping[tuple[float, ...], Point]) -> None:
        """Save the points ``solved`` if a save is due."""
        if self.keep is None or (begun := time.perf_counter()) < self.due:
            return
        self.keep(self.whole(solved))
        now = time.perf_counter()
        self.due = now + max(KEEP_LEAST, KEEP_SHARE * (now - begun))


@single_threaded_blas()
def _solved(
    groups: Sequence[dict[tuple[float, ...], Scene]], solver: _Solver, advance: Callable[[int], None], keeper: _Keeper
) -> dict[tuple[float, ...], Point]:
    """Solve the groups: values along the axes → result. After Ctrl-C the points done so far are returned."""
    solved: dict[tuple[float, ...], Point] = {}
    try:
        for group in groups:
            for position, point in zip(group, solver.solve(list(group.values())), strict=True):
                solved[position] = point
                advance(len(solved))
                keeper.save_if_due(solved)
    except KeyboardInterrupt:
        if not solved:
            raise
    return solved


@dataclass(kw_only=True)
class _Solver:
    """Solver for groups of scenes, see ``sweeps.loads.under_loads``.

    Parameters
    ----------
    outputs
        Outputs as for ``simulate``; with samples, the responses to evaluate statistically.
    draws
        Number of samples, seed and sampler; empty without samples.
    threads
        Number of threads.
    attrs
        Attributes of the Dataset, collected over the groups: settings chosen for an accuracy, number of positions
        solved again, number of rescued samples.
    """

    outputs: Sequence[str]
    draws: dict[str, Any]
    threads: int
    attrs: dict[str, Any] = field(default_factory=dict)
    _shared: Shared = field(default_factory=Shared)

    def solve(self, group: Sequence[Scene]) -> Iterator[Point]:
        """Solve the scenes of ``group`` one after the other."""
        if self.draws:
            yield from self._sampled(group)
            return
        if group[0].coupled:
            from gearbench.trains.dataset import train_point

            yield from (train_point(self._of_train(scene), self.outputs) for scene in group)
            return
        for solved in self._chosen(group) if group[0].resolution.accuracy else solve_group(group, self._shared):
            self._count("polished_positions", solved.solution.corrected)
            yield from of_each_load(*columns(solved, self.outputs), solved.solution.approach.shape[:-1])

    def _of_train(self, scene: Scene) -> SolvedTrain:
        from gearbench.accuracy.choose import choose
        from gearbench.trains.solve import solve_train

        if scene.resolution.accuracy is None:
            return solve_train(scene)
        choice = choose(scene, solve_train, lambda found: np.vstack([covered(each).T for each in found.cycles]))
        self._note(choice)
        return choice.run

    def _chosen(self, group: Sequence[Scene]) -> list[Solved]:
        """Solutions at a resolution that meets the requested accuracy."""
        from gearbench.accuracy.choose import choose

        def run(scene: Scene) -> list[Solved]:
            return list(solve_group([scene.under(each.load) for each in group], self._shared))

        choice = choose(
            group[0],
            run,
            lambda found: np.vstack([covered(each.cycle).T for each in found]),
            error_over_change=ERROR_OVER_CHANGE,
        )
        self._note(choice)
        return choice.run

    def _note(self, choice: Choice) -> None:
        """Add a choice to the attributes: worst estimated error, all settings, total trials and seconds."""
        new, old = choice.attrs, self.attrs
        worst = max((each for each in (old, new) if each), key=lambda attrs: attrs["accuracy_estimated"])
        settings = dict.fromkeys([*old.get("accuracy_settings", "").split("; "), new["accuracy_settings"]])
        sums = {name: old.get(name, 0) + new[name] for name in ("accuracy_trials", "accuracy_seconds")}
        self.attrs = old | worst | {"accuracy_settings": "; ".join(filter(None, settings))} | sums

    def _sampled(self, group: Sequence[Scene]) -> Iterator[Point]:
        if group[0].coupled:
            from gearbench.trains.scatter import sampled_train

            problems: Iterable[Sampled] = (sampled_train(scene, responses=self.outputs) for scene in group)
        else:
            problems = self._shared.samples(group)
        for problem in problems:
            errors = problem.draw(**self.draws)
            answers, complete = respond_with_usual(problem, errors, self.outputs, self.threads)
            if not complete:
                raise KeyboardInterrupt
            self._count("rescued", answers.rescued)
            yield Point(*robust_columns(problem, errors, answers, self.draws["sampler"], self.outputs))

    def _count(self, name: str, number: int) -> None:
        self.attrs[name] = self.attrs.get(name, 0) + number


def _solver(scene: Scene, outputs: Sequence[str], draws: dict[str, Any], threads: int | None) -> _Solver:
    """Create the solver for the groups. With samples, only the responses among ``outputs`` are kept."""
    if (samples := draws["samples"]) < 0:
        raise InputError("samples", samples, "must be at least 0")
    if samples and scene.resolution.accuracy is not None:
        raise InputError("samples", samples, "conflicts with resolution.accuracy: use robust")
    if samples:
        outputs = () if outputs is DEFAULT_OUTPUTS else tuple(filter(is_response, outputs))
    return _Solver(outputs=outputs, draws=draws if samples else {}, threads=threads or default_threads())


def _groups(scene: Scene, axes: Sequence[SweepAxis], *, sampled: bool) -> list[dict[tuple[float, ...], Scene]]:
    """Scenes at the grid points in groups that are solved together; a group maps values along the axes to scenes.

    Without samples all solutions are kept, and must fit into memory.
    """
    base = scene.under(scene.load) if scene.loads else scene
    if not sampled:
        _require_memory(next(iter(base.meshes.values())), math.prod(len(each.values) for each in axes))
    torques = next((each.values for each in axes if each.path == TORQUE), None)
    groups = []
    for point in grid([each for each in axes if each.path not in (TORQUE, MESH)]):
        at_point = scene_at(base, point)
        if at_point.coupled:
            for torque in torques or (at_point.load.torque,):
                values = point | {TORQUE: torque}
                groups.append({tuple(values[a.path] for a in axes): scene_at(at_point, {TORQUE: torque})})
            continue
        for name, of_mesh in at_point.meshes.items():
            # torque of the mesh over that of the scene, which is the value along the axis
            share = of_mesh.load.torque / at_point.load.torque
            groups_of_mesh = [[of_mesh]] if torques is None else under_loads(of_mesh, [share * T for T in torques])
            of_scene = iter(torques or (at_point.load.torque,))
            for scenes in groups_of_mesh:
                values = [point | {TORQUE: next(of_scene), MESH: name} for _ in scenes]
                groups.append({tuple(x[a.path] for a in axes): s for x, s in zip(values, scenes, strict=True)})
    return groups


def _require_memory(scene: Scene, points: int) -> None:
    """Refuse more points than fit into memory at the resolution of ``scene`` (default resolution with an accuracy)."""
    if scene.resolution.accuracy is not None:
        scene = replace(scene, resolution=Resolution())
    per_point = kept_memory(scene, len(mesh_phases(scene)[0]))
    require(points * per_point, "sweep", f"{points} points", f"{int(room() / per_point)} points would fit")


def _warning(scene: Scene, axes: Sequence[SweepAxis]) -> dict[str, str]:
    """Attribute ``warning`` for the largest torque, if there is a warning."""
    torques = [value for each in axes if each.path == TORQUE for value in each.values]
    scene = scene.under(Load(torque=float(max(torques, key=abs)))) if torques else scene
    warning = beyond_elasticity(scene)
    return {} if warning is None else {"warning": warning}
