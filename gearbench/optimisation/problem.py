"""From a design to its objectives: scene, constraints, and the response to the error samples."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import MemoryBudgetError
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.errors import GearbenchError, InputError
from gearbench.geometry.pair import Pair
from gearbench.keys import with_values
from gearbench.loads import load_weights
from gearbench.optimisation.constraints import constrained, decided, judge, may_be_rough, number, solve_roughly
from gearbench.optimisation.derived import DERIVED
from gearbench.optimisation.racing import Incumbents, stages, statistics
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.variables import Value
from gearbench.results.responses import is_over_speed, response
from gearbench.results.solved import Solved
from gearbench.robustness.sampling import Sampler, unit_samples
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene, read_loads
from gearbench.schema import read
from gearbench.simulation import simulate
from gearbench.solution import solve_scene
from gearbench.trains.scatter import sampled_train
from gearbench.trains.solve import SolvedTrain, solve_train

if TYPE_CHECKING:
    from gearbench.dynamics.over_speed import ForceOverSpeed
    from gearbench.robustness.montecarlo import RobustProblem

#: Violation of a design without a valid, solvable scene; larger than any sum of limits.
NO_GEAR = 1e6


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Results of a design.

    Parameters
    ----------
    violation
        Sum of the relative violations of the limits; 0 where it is feasible, 1e6 where there is no such gear.
    reason
        Why it is not feasible; "" where it is.
    constraints
        Values of the limited quantities, in the study's order; NaN where unknown.
    statistics
        In the order of ``OptimisationStudy.statistics``; NaN where it is not feasible.
    samples
        Error samples that were computed; fewer than the study's where the front beats it, and then ``statistics`` are
        estimates (``racing``).
    values
        Responses to all the samples, (response, sample), where the study races and all were computed; they are kept of
        the front alone, and not stored.
    """

    violation: float
    reason: str
    constraints: tuple[float, ...]
    statistics: tuple[float, ...]
    samples: int = 0
    values: NDArray | None = field(default=None, compare=False, repr=False)

    @property
    def feasible(self) -> bool:
        """Whether it keeps all limits."""
        return self.violation == 0

    def objectives(self, study: OptimisationStudy) -> tuple[float, ...]:
        """Values of the study's objectives; NaN where it is not feasible."""
        known = dict(zip(study.statistics, self.statistics, strict=True))
        return tuple(objective.value(known) for objective in study.objectives)


def evaluate(study: OptimisationStudy, design: Design, incumbents: Incumbents | None = None) -> Evaluation:
    """Evaluate a design: the same answer wherever and in whatever order it is computed.

    Where ``incumbents`` are given, it stops as soon as its error samples say that one of them beats it, and limits that
    it keeps roughly (``constraints.solve_roughly``) hold.

    A design that is no valid gear, or that cannot be solved, violates the constraints, with the reason. Only too
    little memory raises an error, because it says nothing about the gear.

    Raises
    ------
    MemoryBudgetError
        If it needs more memory than there may be.
    """
    unknown = (math.nan,) * len(study.constraints)
    try:
        scene, cost = scene_of(study, design), cost_of(study, design)
        candidate = _Candidate(study=study, scene=scene, cost=cost, incumbents=incumbents)
        limited = candidate.limited(roughly=candidate.may_be_rough)
        unknown = limited.constraints
        if not limited.feasible:
            return limited
        found = candidate.feasible()
        if candidate.may_be_rough and found.samples == study.robustness.samples:
            limited = candidate.limited(roughly=False)  # nothing beats it: its limits to the end
        return replace(found, constraints=limited.constraints) if limited.feasible else limited
    except MemoryBudgetError:
        raise
    except (InputError, GearbenchError, ArithmeticError, np.linalg.LinAlgError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        nothing = (math.nan,) * len(study.statistics)
        return Evaluation(violation=NO_GEAR, reason=reason, constraints=unknown, statistics=nothing)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Candidate:
    """A design that is being evaluated; what several steps need of its scene is computed once."""

    study: OptimisationStudy
    scene: Scene
    cost: float
    incumbents: Incumbents | None
    forces: dict[float, ForceOverSpeed] = field(default_factory=dict)

    @cached_property
    def may_be_rough(self) -> bool:
        """Whether its limits are first judged at the mesh phases of its error samples, which it needs anyway."""
        return self.incumbents is not None and not self.scene.loads and may_be_rough(self.scene, self.study.constraints)

    @cached_property
    def rough(self) -> Solved:
        """The scene solved at those phases."""
        return solve_roughly(self.scene)

    @cached_property
    def solved(self) -> Solved | SolvedTrain:
        """The scene solved as ``simulate`` does."""
        return solve_train(self.scene) if self.scene.coupled else solve_scene(self.scene)

    def force(self, scene: Scene) -> ForceOverSpeed:
        """The force over the study's speeds under one load."""
        from gearbench.dynamics.over_speed import ForceOverSpeed

        speeds, torque = self.study.speeds, scene.load.torque
        assert speeds is not None
        if torque not in self.forces:
            self.forces[torque] = ForceOverSpeed(scene=scene, speeds=speeds.values, harmonics=speeds.harmonics)
        return self.forces[torque]

    def limited(self, *, roughly: bool) -> Evaluation:
        """Its limited quantities, and whether they keep their limits."""
        limits = self.study.constraints
        solved = (lambda: self.rough) if roughly else (lambda: self.solved)
        values = constrained(self.scene, limits, solved, self.cost, lambda scene: self.force(scene).without_errors)
        violation, reason = judge(values, limits)
        if roughly and violation > 0 and not decided(values, limits):
            return self.limited(roughly=False)
        nothing = (math.nan,) * len(self.study.statistics)
        return Evaluation(violation=violation, reason=reason, constraints=tuple(values.values()), statistics=nothing)

    def feasible(self) -> Evaluation:
        """Evaluation with its statistics, if it keeps its limits; without the values of the limits."""
        answer = self._of_samples() if self.study.robustness.samples else self._without_errors()
        known = dict(zip(self.study.statistics, answer.statistics, strict=True))
        for name in {name for objective in self.study.objectives for name in objective.weights}:
            if not math.isfinite(known[name]):
                raise GearbenchError(f"{name} is not finite")
        return answer

    @property
    def _on_cycles(self) -> list[str]:
        """Responses of the study that a mesh cycle has; the others are those over speed."""
        return [name for name in self.study.responses if not is_over_speed(name)]

    @property
    def _over_speed(self) -> bool:
        return len(self._on_cycles) < len(self.study.responses)

    def _without_errors(self) -> Evaluation:
        """Responses of the scene as it is, as means over one sample."""
        found = dict(zip(self.study.numbers, self._numbers(), strict=True))
        if self._over_speed:
            each = [self.force(one).without_errors for one in self.scene.each_load]
            found["mesh_force_mean"] = float(_over_loads(self.study, each))
        if names := self._on_cycles:
            if self.scene.coupled:
                dataset, ending = {name: response(name).reduce(self.solved.cycle) for name in names}, ""
            elif self.scene.loads:
                from gearbench.sweeps.run import sweep

                dataset, ending = sweep(self.scene, outputs=names, threads=1), f"_load_{self.study.over_loads}"
            else:
                dataset, ending = simulate(self.scene, outputs=names), ""
            found |= {f"{name}_mean": float(dataset[f"{name}{ending}"]) for name in names}
        known = tuple(found.get(name, math.nan) for name in self.study.statistics)
        return Evaluation(violation=0.0, reason="", constraints=(), statistics=known)

    def _of_samples(self) -> Evaluation:
        """Statistics over as many error samples as needed."""
        study, incumbents, numbers, r = self.study, self.incumbents, self._numbers(), self.study.robustness
        count, answer = self._sampled_set() if self.scene.coupled else self._sampled_pair()
        unit = _unit(r.sampler, r.samples, count, r.seed)
        values = np.empty((len(study.responses), 0))
        for stop in stages(study) if incumbents is not None else (r.samples,):
            values = np.hstack([values, answer(unit[values.shape[1] : stop])])
            if incumbents is not None and stop < r.samples and (by := incumbents.beating(values, numbers)) is not None:
                found, kept = incumbents.estimate(values, by, numbers), None
                break
        else:
            found, kept = statistics(values, numbers), values if r.racing else None
        known, count = tuple(map(float, found)), values.shape[1]
        return Evaluation(violation=0.0, reason="", constraints=(), statistics=known, samples=count, values=kept)

    def _sampled_pair(self) -> tuple[int, Callable[[NDArray], NDArray]]:
        """Number of its errors, and its responses (response, sample) at points of the unit cube (sample, error)."""
        kinds, loads = self.scene.effect("manufacturing_errors"), self.scene.each_load
        assert isinstance(kinds, ManufacturingErrors)
        problems = self._robust_problems()

        def answer(unit: NDArray) -> NDArray:
            errors = kinds.draw(unit, self.scene.pair)
            under = [self._responses(one, problem, errors) for one, problem in zip(loads, problems, strict=True)]
            return _over_loads(self.study, under)

        return len(kinds.variables(self.scene.pair)), answer

    def _sampled_set(self) -> tuple[int, Callable[[NDArray], NDArray]]:
        """``_sampled_pair`` of a planetary set."""
        assert isinstance(self.solved, SolvedTrain)
        train, names = sampled_train(self.scene, self.solved), self.study.responses

        def answer(unit: NDArray) -> NDArray:
            found = train.respond(train.draw(unit), names)
            return np.array([found[name] for name in names])

        return len(train.error_names), answer

    def _robust_problems(self) -> list[RobustProblem]:
        """Problem of the error samples, or those under each of several loads, torques ascending."""
        from gearbench.robustness.montecarlo import prepare_problem, prepare_scene

        if self.may_be_rough:
            return [prepare_problem(self.scene, self.rough.lines, self.rough.weight, self.rough.problem)]
        if not self.scene.loads:
            return [prepare_scene(self.scene)]
        from gearbench.sweeps.loads import Shared, under_loads

        shared, torques = Shared(), [each.load.torque for each in self.scene.each_load]
        return [problem for group in under_loads(self.scene, torques) for problem in shared.samples(group)]

    def _responses(self, scene: Scene, problem: RobustProblem, errors: NDArray) -> NDArray:
        """Responses to ``errors`` (sample, error) [µm] under one load, (response, sample).

        An interruption raises ``KeyboardInterrupt``.
        """
        from gearbench.robustness.montecarlo import respond

        more = {"mesh_force": self.force(scene).of_samples} if self._over_speed else {}
        answers, complete = respond(problem, errors, names=self._on_cycles, more=more)
        if not complete:
            raise KeyboardInterrupt
        return np.array([answers[name] for name in self.study.responses])

    def _numbers(self) -> tuple[float, ...]:
        """Numbers of the design among the objectives, over the loads as the study has it."""
        study, found = self.study, []
        for one in self.scene.each_load if study.numbers else ():
            solved = cache(partial(solve_scene, one)) if self.scene.loads else lambda: self.solved
            found.append([number(name, one, solved, self.cost) for name in study.numbers])
        return tuple(map(float, _over_loads(study, found))) if found else ()


def scene_of(study: OptimisationStudy, design: Design) -> Scene:
    """The scene of a design.

    Raises
    ------
    InputError
        If there is no such gear.
    """
    asked = dict(assignments(study, design))
    given = {path: value for path, value in asked.items() if value is not None}
    tables = with_values(study.base, {path: value for path, value in given.items() if path not in DERIVED})
    if "effects" in tables:
        absent = {path for path, value in asked.items() if value is None}
        tables["effects"] = {name: t for name, t in tables["effects"].items() if f"effects.{name}" not in absent}
    for path, derive in DERIVED.items():
        if path in given:
            tables = with_values(tables, derive(tables, pair_of, float(given[path])))
    return parse_scene(tables if study.of_set else tables | {"pair": pair_of(tables.get("pair", {}))})


def assignments(study: OptimisationStudy, design: Design) -> tuple[tuple[str, Value | None], ...]:
    """Keys and values that a design stands for, sorted: equal for designs that are the same gear.

    An effect whose amount or length is 0 is absent: ("effects.<name>", None) takes the place of its keys.
    """
    given: dict[str, Value | None] = {
        path: value
        for variable, code in zip(study.variables, design, strict=True)
        for path, value in variable.assigned(code).items()
    }
    for effect in {".".join(path.split(".")[:2]) for path in given if path.startswith("effects.")}:
        table = study.base.get("effects", {}).get(effect.removeprefix("effects."), {})
        own = {path.removeprefix(f"{effect}."): v for path, v in given.items() if path.startswith(f"{effect}.")}
        if any({**table, **own}.get(key) == 0 for key in ("amount", "length", "length_fraction")):
            given = {path: value for path, value in given.items() if not path.startswith(f"{effect}.")}
            given[effect] = None
    return tuple(sorted(given.items()))


def values_of(study: OptimisationStudy, design: Design) -> tuple[Value, ...]:
    """Value of each variable as the gear has it: 0 for numbers of effects that the design does without."""
    absent = {path for path, value in assignments(study, design) if value is None}
    found: list[Value] = []
    for variable, code in zip(study.variables, design, strict=True):
        value = variable.value(code)
        idle = all(".".join(path.split(".")[:2]) in absent for path in variable.paths)
        found.append(type(value)(0) if idle and isinstance(value, int | float) else value)
    return tuple(found)


def macro_geometry(study: OptimisationStudy, design: Design) -> tuple[tuple[str, str], ...]:
    """Variables of the teeth's compliance: designs are computed in this order."""
    return tuple((path, repr(value)) for path, value in assignments(study, design) if not path.startswith("effects."))


def pair_of(table: Mapping[str, Any]) -> Pair:
    """Pair of the tables of a scene; kept, because many designs share one.

    Raises
    ------
    InputError
        If there is no such pair.
    """
    found = _pair(json.dumps(table, sort_keys=True, default=str))
    if isinstance(found, InputError):
        raise found
    return found


@lru_cache(maxsize=1024)
def _pair(text: str) -> Pair | InputError:
    try:
        return read(Pair, json.loads(text))
    except InputError as error:
        return error.within("pair")


def cost_of(study: OptimisationStudy, design: Design) -> float:
    """Cost of the values of a design's variables; those of an absent effect cost nothing."""
    given = dict(zip((v.name for v in study.variables), values_of(study, design), strict=True))
    return sum(costs.get(str(given[name]), 0.0) for name, costs in study.costs.items())


def _over_loads(study: OptimisationStudy, found: Sequence) -> NDArray:
    """Values of the loads (load, …), torques ascending, as one: their weighted mean, or the greatest."""
    if len(found) == 1:
        return np.array(found[0])
    loads = read_loads(study.base["loads"], "base.loads")
    return np.max(found, axis=0) if study.over_loads == "max" else np.tensordot(load_weights(loads), found, axes=1)


@lru_cache(maxsize=16)
def _unit(sampler: Sampler, samples: int, dimension: int, seed: int) -> NDArray:
    """Samples of the unit cube, the same for every design."""
    unit = unit_samples(sampler, samples, dimension, seed)
    unit.flags.writeable = False
    return unit
