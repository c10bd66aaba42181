"""Robustness of a scene: its response to many random manufacturing errors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import MEASURED
from gearbench.budget import gaps_memory, require
from gearbench.contact.assemble import assemble
from gearbench.contact.batch import (
    SCATTER,
    Batch,
    GapModes,
    Precision,
    chunks,
    on_threads,
    prepare,
    solve_one_chunk,
)
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.mesh_loads import with_mesh_loads
from gearbench.contact.problem import ContactProblem
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.expansion import Expansion
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.varied import SizeScatter
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.results.cycle import MeshCycle, Phases
from gearbench.results.points import Columns
from gearbench.results.responses import response
from gearbench.robustness.cells import CHECKED, Checked, check_cells
from gearbench.robustness.sampling import Sampler, unit_samples
from gearbench.scene import Scene
from gearbench.schema import changed
from gearbench.threads import single_threaded_blas

#: Default number of error samples.
SAMPLES = 1000


class Sampled(ABC):
    """A scene prepared for samples of its random errors: those of a pair, or those of a train."""

    scene: Scene
    #: Responses that ``robust`` always computes, and those of them that always get statistics and sensitivities.
    usual: ClassVar[tuple[str, ...]] = MEASURED
    studied: ClassVar[tuple[str, ...]] = ("transmission_error_rms", "mesh_stiffness_rms")
    #: Name → dimension of further values of each sample in the Dataset of ``robust``, and function as for ``parts``.
    further: ClassVar[Mapping[str, tuple[str, Callable[..., NDArray]]]] = MappingProxyType({})

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the errors, in the order of the columns of a sample."""

    @abstractmethod
    def errors_at(self, points: NDArray) -> NDArray:
        """Errors (sample, error) for points (sample, error) of the unit cube [µm; angles in revolutions]."""

    @abstractmethod
    def parts(
        self, errors: NDArray, threads: int, names: Sequence[str], more: Mapping[str, Callable[..., NDArray]]
    ) -> Iterator[tuple[NDArray, Responses]]:
        """Responses to ``errors``, some samples at a time: their indices, and their responses.

        Responses beyond the indices belong to samples that pad a chunk. Functions of ``more`` take, for a pair, the
        problem and a chunk solved with forces of the segments; for a train, its mesh cycles.
        """

    @property
    def coords(self) -> Columns:
        """Coordinates of the Dataset."""
        return {"error_name": (("error_name",), np.array(self.names, dtype=str))}

    def columns(self, errors: NDArray, studied: Sequence[str]) -> Columns:
        """Further variables of the Dataset, from the ``errors`` and the names of the ``studied`` responses."""
        return {}

    def draw(self, samples: int, seed: int, sampler: Sampler, start: int = 0) -> NDArray:
        """Errors of the samples ``start`` … ``samples`` − 1, (sample, error) as ``errors_at``."""
        return self.errors_at(unit_samples(sampler, samples, len(self.names), seed, start=start))


@dataclass(frozen=True, kw_only=True)
class RobustProblem(Sampled):
    """A scene prepared for many error samples.

    Parameters
    ----------
    scene, errors
        The scene and its random errors.
    batch
        The contact problem at the mean errors prepared for samples, with the gap of each error.
    expansion
        Gap modes of the errors, and the amounts of these modes in a sample.
    phases
        Mesh phases and their weights.
    lines
        Contact lines at these phases.
    checked
        A few samples solved on cells and on contact patches; the mean difference corrects all samples. None if segments
        are points.
    """

    scene: Scene
    errors: ManufacturingErrors
    lines: ContactLines
    batch: Batch
    expansion: Expansion
    phases: Phases
    checked: Checked | None = None

    @property
    def mean(self) -> NDArray:
        """Mean of each error, (error,) [µm]."""
        return self.expansion.mean

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the errors."""
        return tuple(variable.name for variable in self.errors.variables(self.scene.pair))

    @cached_property
    def _distances(self) -> dict[float, RobustProblem]:
        """Problems at the centre distances drawn so far, by deviation from the middle of the tolerance [µm]."""
        return {}

    def at_distance(self, deviation: float) -> RobustProblem:
        """Problem at a ``deviation`` [µm] of the centre distance from the middle of its tolerance."""
        if deviation not in self._distances:
            pair = self.scene.pair
            distance = (pair.centre_distance_upper + pair.centre_distance_lower) / 2 + deviation
            moved_pair = changed(pair, centre_distance_upper=distance, centre_distance_lower=distance)
            # any amplitude will do, but one must be given: the moved pair has no deviations to derive it from
            errors = replace(self.errors, centre_distance=SizeScatter(amplitude=1.0))
            effects = tuple(errors if effect.name == errors.name else effect for effect in self.scene.effects)
            self._distances[deviation] = prepare_scene(changed(self.scene, pair=moved_pair, effects=effects))
        return self._distances[deviation]

    def errors_at(self, points: NDArray) -> NDArray:
        """Errors (sample, error) [µm] for points (sample, error) of the unit cube."""
        return self.errors.draw(points, self.scene.pair)

    def columns(self, errors: NDArray, studied: Sequence[str]) -> Columns:
        """Backlash of each sample, cost of a finer class of each error, and errors that cells leave in the means."""
        pair, columns = self.scene.pair, {}
        if self.errors.centre_distance is not None or self.errors.tooth_thickness is not None:
            drawn, zero = dict(zip(self.names, errors.T, strict=True)), np.zeros(len(errors))
            names = ("tooth_thickness_pinion", "tooth_thickness_wheel", "centre_distance")
            of_samples = zip(*(drawn.get(name, zero) for name in names), strict=True)
            columns["backlash"] = ("sample",), np.array([pair.backlash_with((s1, s2), a) for s1, s2, a in of_samples])
        columns["tightening_cost"] = ("error_name",), np.array([each.cost for each in self.errors.variables(pair)])
        left = {} if self.checked is None else self.checked.errors(self.scene, self.phases, studied)
        return columns | {f"{name}_mean_cell_error": ((), np.array(error)) for name, error in left.items()}

    def parts(
        self, errors: NDArray, threads: int, names: Sequence[str], more: Mapping[str, Callable[..., NDArray]]
    ) -> Iterator[tuple[NDArray, Responses]]:
        """Responses at one centre distance after the other, see ``Sampled``."""
        reductions, rows = {name: response(name).reduce for name in names}, np.arange(len(errors))
        at_distances: Iterable[tuple[RobustProblem, NDArray]] = [(self, rows)]
        if self.errors.centre_distance is not None:
            distance = errors[:, self.names.index("centre_distance")]
            at_distances = ((self.at_distance(float(a)), rows[distance == a]) for a in np.unique(distance))
        for problem, here in at_distances:
            solve = partial(solve_one_chunk, problem.batch, segments=bool(more))
            for solution in on_threads(solve, chunks(problem.expansion.amounts(errors[here])), threads):
                cycle = MeshCycle.of(problem.scene, problem.phases, solution.approach.T, solution.stiffness.T)
                values = {name: reduce(cycle) for name, reduce in reductions.items()}
                values |= {name: reduce(problem, solution) for name, reduce in more.items()}
                of_part, here = np.split(here, [solution.approach.shape[1]])
                yield of_part, Responses(values=values, rescued=solution.rescued)


def prepare_scene(scene: Scene, precision: Precision = SCATTER) -> RobustProblem:
    """Compute everything about ``scene`` that does not depend on the sample.

    Raises
    ------
    InputError
        If the scene has no random errors.
    """
    scene = with_mesh_loads(scene)
    return prepare_phases(scene, *mesh_phases(scene), precision)


@single_threaded_blas()
def prepare_phases(scene: Scene, phase: NDArray, weight: NDArray, precision: Precision = SCATTER) -> RobustProblem:
    """Prepare a scene at given mesh phases and weights (position,), see ``prepare_scene``."""
    require_errors(scene)
    lines = scene_lines(scene, phase)
    return prepare_problem(scene, lines, weight, assemble(scene, lines), precision)


@single_threaded_blas()
def prepare_problem(
    scene: Scene, lines: ContactLines, weight: NDArray, problem: ContactProblem, precision: Precision = SCATTER
) -> RobustProblem:
    """Prepare a scene on given contact lines and for a given contact problem, see ``prepare_phases``."""
    batch, expansion = prepare_batch(scene, lines, problem, precision, at_mean=False)
    phases = Phases(phase=lines.mesh_phase, weight=weight, size=scene.resolution.panel_size)
    prepared = RobustProblem(
        scene=scene, errors=require_errors(scene), lines=lines, batch=batch, expansion=expansion, phases=phases
    )
    if problem.cells is None:
        return prepared
    amounts = expansion.amounts(prepared.errors.draw(_checked_points(len(prepared.names)), scene.pair))
    checked = check_cells(batch, problem, _modes(scene), amounts)
    return replace(prepared, batch=replace(batch, cell_correction=checked.cell_correction), checked=checked)


@lru_cache(maxsize=16)
def _checked_points(dimension: int) -> NDArray:
    """Points of the unit cube (sample, dimension), from which the samples of ``Checked`` are drawn."""
    return unit_samples("sobol", CHECKED, dimension, 0)


def _modes(scene: Scene) -> Callable[[ContactLines], NDArray]:
    """Function that gives the gaps of the errors' modes at the nodes of lines, (position, pair, segment, mode) [mm]."""
    errors, effects = require_errors(scene), {effect.name: effect for effect in scene.flank_effects}
    return lambda lines: errors.expansion(lines, effects).modes


def prepare_batch(
    scene: Scene,
    lines: ContactLines,
    problem: ContactProblem,
    precision: Precision = SCATTER,
    *,
    at_mean: bool = True,
) -> tuple[Batch, Expansion]:
    """Prepare ``problem``, at the mean errors, for error samples; also return the expansion of their gaps.

    ``at_mean`` is that of ``gearbench.contact.batch.prepare``.
    """
    errors = require_errors(scene)
    positions, pairs, segments = lines.shape
    number = len(errors.variables(scene.pair))
    size = f"{positions} positions × {segments} segments"
    need = positions * gaps_memory(pairs * segments, number)
    require(need, "resolution", f"{size} × {number} errors", "fewer segments or positions would fit")
    expansion = errors.expansion(lines, {effect.name: effect for effect in scene.flank_effects})
    return prepare(problem, GapModes.on(lines, _modes(scene)), precision, at_mean=at_mean), expansion


def require_errors(scene: Scene) -> ManufacturingErrors:
    """Random errors of ``scene``.

    Raises
    ------
    InputError
        If the scene has none.
    """
    errors = scene.effect("manufacturing_errors")
    if not isinstance(errors, ManufacturingErrors):
        raise InputError("effects.manufacturing_errors", "missing", "is required for scatter: kinds of random errors")
    return errors


@dataclass(frozen=True, kw_only=True)
class Responses:
    """Responses of the samples.

    Parameters
    ----------
    values
        Responses by name, (sample, …) in the unit of the response.
    rescued
        Number of contact problems that needed the solver with line search.
    """

    values: Mapping[str, NDArray]
    rescued: int = 0

    def __getitem__(self, name: str) -> NDArray:
        return self.values[name]

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def numbers(self) -> NDArray:
        """The four responses of ``accuracy.measure.MEASURED``, (4, sample)."""
        return np.array([self.values[name] for name in MEASURED])


@single_threaded_blas()
def respond(
    problem: Sampled,
    errors: NDArray,
    threads: int = 1,
    progress: Callable[[int], None] = lambda _: None,
    names: Sequence[str] = MEASURED,
    more: Mapping[str, Callable[..., NDArray]] = MappingProxyType({}),
) -> tuple[Responses, bool]:
    """Responses ``names`` to the ``errors`` (sample, error) of ``Sampled.draw``, and whether all samples were computed.

    ``more`` are further responses by name, see ``Sampled.parts``. ``progress`` is called with the number of samples
    done so far. An interruption (Ctrl-C) ends the run early; the samples finished until then are returned.
    """
    values, rescued, done = dict.fromkeys((*names, *more), np.empty(0)), 0, np.zeros(len(errors), dtype=bool)
    try:
        for rows, part in problem.parts(errors, threads, names, more):
            for name, of_part in part.values.items():
                if not done.any():
                    values[name] = np.full((len(errors), *of_part.shape[1:]), np.nan)
                values[name][rows] = of_part[: len(rows)]
            rescued, done[rows] = rescued + part.rescued, True
            progress(int(done.sum()))
    except KeyboardInterrupt:
        pass
    count = len(errors) if done.all() else int(np.argmin(done))
    return Responses(values={name: each[:count] for name, each in values.items()}, rescued=rescued), bool(done.all())


def respond_with_usual(
    problem: Sampled,
    errors: NDArray,
    names: Sequence[str],
    threads: int = 1,
    progress: Callable[[int], None] = lambda _: None,
) -> tuple[Responses, bool]:
    """Responses of ``respond`` for the Dataset of ``robust``: usual and further ones of the problem, and ``names``."""
    further = {name: of_sample for name, (_, of_sample) in problem.further.items()}
    return respond(problem, errors, threads, progress, tuple(dict.fromkeys((*problem.usual, *names))), further)


def join(parts: Sequence[Responses]) -> Responses:
    """Join the responses ``MEASURED`` of several draws."""
    values = {name: np.concatenate([part[name] for part in parts]) for name in MEASURED}
    return Responses(values=values, rescued=sum(part.rescued for part in parts))
