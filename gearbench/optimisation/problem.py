"""Evaluation of a design: its scene, its limits, and the statistics of its responses to the error samples.

``evaluate`` is the function that the workers of a search call. Errors are drawn from points of the unit cube, the same
for every design; a design turns them into its own errors (in µm) by its tolerances.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import MemoryBudgetError
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
from gearbench.robustness.montecarlo import Sampled, prepare_problem, prepare_scene, respond
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

#: Violation of a design whose scene is not valid or cannot be solved; a violated limit counts at most 1000.
NO_GEAR = 1e6


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Result of evaluating a design.

    Parameters
    ----------
    violation
        Sum of the relative violations of the limits: 0 if feasible, 1e6 (``NO_GEAR``) for an invalid gear set.
    reason
        Why the design is not feasible; "" if it is.
    constraints
        Values of the limited quantities, in the study's order; NaN where not computed.
    statistics
        Values in the order of ``OptimisationStudy.statistics``; NaN if the design is not feasible.
    samples
        Number of error samples computed. It is less than the study's if a design of the front beats this one
        (``racing``); ``statistics`` are then estimates.
    values
        Responses to all samples, (response, sample), if ``racing`` is on and all were computed, else None. Only those
        of the front are kept in memory; none are stored on disk.
    """

    violation: float
    reason: str
    constraints: tuple[float, ...]
    statistics: tuple[float, ...]
    samples: int = 0
    values: NDArray | None = field(default=None, compare=False, repr=False)

    @property
    def feasible(self) -> bool:
        """Whether the design keeps all limits."""
        return self.violation == 0

    def objectives(self, study: OptimisationStudy) -> tuple[float, ...]:
        """Values of the study's objectives; NaN if the design is not feasible."""
        known = dict(zip(study.statistics, self.statistics, strict=True))
        return tuple(objective.value(known) for objective in study.objectives)


def evaluate(study: OptimisationStudy, design: Design, incumbents: Incumbents | None = None) -> Evaluation:
    """Evaluate a design; the result does not depend on the worker or on the order of evaluation.

    With ``incumbents`` (designs of the front), sampling stops as soon as the samples show that one of them beats the
    design. The limits of such a design may be checked only on the rough solution (``constraints.solve_roughly``).

    A design that is not a valid gear set, or cannot be solved, gets the violation ``NO_GEAR`` and the reason. Only a
    lack of memory raises an error, because it says nothing about the design.

    Raises
    ------
    MemoryBudgetError
        If the design needs more memory than the budget allows.
    """
    limited_values = (math.nan,) * len(study.constraints)
    try:
        scene, cost = scene_of(study, design), cost_of(study, design)
        candidate = _Candidate(study=study, scene=scene, cost=cost, incumbents=incumbents)
        limited = candidate.limited(roughly=candidate.limits_rough_first)
        limited_values = limited.constraints
        if not limited.feasible:
            return limited
        sampled = candidate.with_statistics()
        if candidate.limits_rough_first and sampled.samples == study.robustness.samples:
            limited = candidate.limited(roughly=False)  # no incumbent beats it: check its limits exactly
        return replace(sampled, constraints=limited.constraints) if limited.feasible else limited
    except MemoryBudgetError:
        raise
    except (InputError, GearbenchError, ArithmeticError, np.linalg.LinAlgError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        unknown_statistics = (math.nan,) * len(study.statistics)
        return Evaluation(violation=NO_GEAR, reason=reason, constraints=limited_values, statistics=unknown_statistics)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Candidate:
    """A design under evaluation; it caches the solutions that several steps share."""

    study: OptimisationStudy
    scene: Scene
    cost: float
    incumbents: Incumbents | None
    forces: dict[float, ForceOverSpeed] = field(default_factory=dict)

    @cached_property
    def limits_rough_first(self) -> bool:
        """Whether the limits are first checked on the rough solution, which the error samples need anyway."""
        return self.incumbents is not None and not self.scene.loads and may_be_rough(self.scene, self.study.constraints)

    @cached_property
    def rough(self) -> Solved:
        """Solution of the scene at the mesh phases of the error samples."""
        return solve_roughly(self.scene)

    @cached_property
    def solved(self) -> Solved | SolvedTrain:
        """Solution of the scene as in ``simulate``."""
        return solve_train(self.scene) if self.scene.coupled else solve_scene(self.scene)

    def force(self, scene: Scene) -> ForceOverSpeed:
        """Mesh force over the study's speeds under the load of ``scene``, cached by torque."""
        from gearbench.dynamics.over_speed import ForceOverSpeed

        speeds, torque = self.study.speeds, scene.load.torque
        assert speeds is not None
        if torque not in self.forces:
            self.forces[torque] = ForceOverSpeed(scene=scene, speeds=speeds.values, harmonics=speeds.harmonics)
        return self.forces[torque]

    def limited(self, *, roughly: bool) -> Evaluation:
        """Evaluate the limits: limited quantities, violation and reason; the statistics are still NaN."""
        limits = self.study.constraints
        solved = (lambda: self.rough) if roughly else (lambda: self.solved)
        values = constrained(self.scene, limits, solved, self.cost, lambda scene: self.force(scene).without_errors)
        violation, reason = judge(values, limits)
        constraints = tuple(values.get(name, math.nan) for name in limits)
        # too close to a limit for the rough solution; limits kept roughly are checked exactly in ``evaluate``
        if roughly and violation > 0 and not decided(values, limits):
            return self.limited(roughly=False)
        unknown_statistics = (math.nan,) * len(self.study.statistics)
        return Evaluation(violation=violation, reason=reason, constraints=constraints, statistics=unknown_statistics)

    def with_statistics(self) -> Evaluation:
        """Evaluate the statistics of a design that keeps its limits, without the values of the limited quantities."""
        evaluation = self._with_errors() if self.study.robustness.samples else self._without_errors()
        known = dict(zip(self.study.statistics, evaluation.statistics, strict=True))
        for name in {name for objective in self.study.objectives for name in objective.weights}:
            if not math.isfinite(known[name]):
                raise GearbenchError(f"{name} is not finite")
        return evaluation

    @property
    def _on_cycles(self) -> list[str]:
        """Names of the study's responses that follow from a mesh cycle; the others are evaluated over speed."""
        return [name for name in self.study.responses if not is_over_speed(name)]

    @property
    def _over_speed(self) -> bool:
        """Whether a response is evaluated over speed."""
        return len(self._on_cycles) < len(self.study.responses)

    def _without_errors(self) -> Evaluation:
        """Evaluate the scene without error samples: each response is stored as its mean; other statistics are NaN."""
        values = dict(zip(self.study.numbers, self._numbers(), strict=True))
        if self._over_speed:
            forces = [self.force(loaded).without_errors for loaded in self.scene.each_load]
            values["mesh_force_mean"] = float(_over_loads(self.study, forces))
        if names := self._on_cycles:
            # ``sweep`` combines loads, ``simulate`` refines up to the accuracy; otherwise the solution is at hand
            if self.scene.loads and not self.scene.coupled:
                from gearbench.sweeps.run import sweep

                results, suffix = sweep(self.scene, outputs=names, threads=1), f"_load_{self.study.over_loads}"
            elif self.scene.resolution.accuracy is not None and not self.scene.coupled:
                results, suffix = simulate(self.scene, outputs=names), ""
            else:
                results, suffix = {name: response(name).reduce(self.solved.cycle) for name in names}, ""
            values |= {f"{name}_mean": float(results[f"{name}{suffix}"]) for name in names}
        statistics_values = tuple(values.get(name, math.nan) for name in self.study.statistics)
        return Evaluation(violation=0.0, reason="", constraints=(), statistics=statistics_values)

    def _with_errors(self) -> Evaluation:
        """Evaluate stage by stage over the error samples, until an incumbent beats the design or all are computed."""
        study, incumbents, numbers, r = self.study, self.incumbents, self._numbers(), self.study.robustness
        problems = self._problems()
        points = _unit_points(r.sampler, r.samples, len(problems[0].names), r.seed)
        values = np.empty((len(study.responses), 0))
        for stop in stages(study) if incumbents is not None else (r.samples,):
            values = np.hstack([values, self._responses(problems, points[values.shape[1] : stop])])
            if incumbents is None or stop == r.samples:
                continue
            if (incumbent := incumbents.beating(values, numbers)) is not None:
                results, stored = incumbents.estimate(values, incumbent, numbers), None
                break
        else:
            results, stored = statistics(values, numbers), values if r.racing else None
        floats, count = tuple(map(float, results)), values.shape[1]
        return Evaluation(violation=0.0, reason="", constraints=(), statistics=floats, samples=count, values=stored)

    def _problems(self) -> Sequence[Sampled]:
        """The scene prepared for error samples, one problem per load, torques ascending."""
        if self.scene.coupled:
            assert isinstance(self.solved, SolvedTrain)
            return [sampled_train(self.scene, self.solved)]
        if self.limits_rough_first:
            return [prepare_problem(self.scene, self.rough.lines, self.rough.weight, self.rough.problem)]
        if not self.scene.loads:
            return [prepare_scene(self.scene)]
        from gearbench.sweeps.loads import Shared, under_loads

        shared, torques = Shared(), [loaded.load.torque for loaded in self.scene.each_load]
        return [problem for group in under_loads(self.scene, torques) for problem in shared.samples(group)]

    def _responses(self, problems: Sequence[Sampled], points: NDArray) -> NDArray:
        """Responses to samples at ``points`` (sample, error) of the unit cube, (response, sample).

        Raises
        ------
        KeyboardInterrupt
            If the computation is interrupted.
        """
        by_load = []
        for loaded, problem in zip(self.scene.each_load, problems, strict=True):
            more = {"mesh_force": self.force(loaded).of_samples} if self._over_speed else {}
            answers, complete = respond(problem, problem.errors_at(points), names=self._on_cycles, more=more)
            if not complete:
                raise KeyboardInterrupt
            by_load.append([answers[name] for name in self.study.responses])
        return _over_loads(self.study, by_load)

    def _numbers(self) -> tuple[float, ...]:
        """Values of ``study.numbers``, which do not depend on the errors, combined as ``over_loads`` says."""
        study, by_load = self.study, []
        for loaded in self.scene.each_load if study.numbers else ():
            solved = cache(partial(solve_scene, loaded)) if self.scene.loads else lambda: self.solved
            by_load.append([number(name, loaded, solved, self.cost) for name in study.numbers])
        return tuple(map(float, _over_loads(study, by_load))) if by_load else ()


def scene_of(study: OptimisationStudy, design: Design) -> Scene:
    """Build the scene of a design.

    Raises
    ------
    InputError
        If the design is not a valid gear set.
    """
    assigned = dict(assignments(study, design))
    given_keys = {path: value for path, value in assigned.items() if value is not None}
    tables = with_values(study.base, {path: value for path, value in given_keys.items() if path not in DERIVED})
    if "effects" in tables:
        absent = {path for path, value in assigned.items() if value is None}  # effects that the design leaves out
        tables["effects"] = {name: t for name, t in tables["effects"].items() if f"effects.{name}" not in absent}
    for path, (keys, derive) in DERIVED.items():
        if path in given_keys:
            tables = with_values(tables, dict.fromkeys(keys, derive(tables, pair_of, float(given_keys[path]))))
    return parse_scene(tables if study.of_set else tables | {"pair": pair_of(tables.get("pair", {}))})


def assignments(study: OptimisationStudy, design: Design) -> tuple[tuple[str, Value | None], ...]:
    """Scene keys and values that a design sets, sorted by key; designs of the same gear set have equal assignments.

    An effect with amount or length 0 is left out: ("effects.<name>", None) replaces its keys.
    """
    assigned: dict[str, Value | None] = {
        path: value
        for variable, code in zip(study.variables, design, strict=True)
        for path, value in variable.assigned(code).items()
    }
    for effect in {".".join(path.split(".")[:2]) for path in assigned if path.startswith("effects.")}:
        table = study.base.get("effects", {}).get(effect.removeprefix("effects."), {})
        keys = {path.removeprefix(f"{effect}."): v for path, v in assigned.items() if path.startswith(f"{effect}.")}
        if any({**table, **keys}.get(key) == 0 for key in ("amount", "length", "length_fraction")):
            assigned = {path: value for path, value in assigned.items() if not path.startswith(f"{effect}.")}
            assigned[effect] = None
    return tuple(sorted(assigned.items()))


def values_of(study: OptimisationStudy, design: Design) -> tuple[Value, ...]:
    """Values of the variables, (variable,); a number is 0 if its effect is left out."""
    absent = {path for path, value in assignments(study, design) if value is None}
    values: list[Value] = []
    for variable, code in zip(study.variables, design, strict=True):
        value = variable.value(code)
        is_absent = all(".".join(path.split(".")[:2]) in absent for path in variable.paths)
        values.append(type(value)(0) if is_absent and isinstance(value, int | float) else value)
    return tuple(values)


def macro_geometry(study: OptimisationStudy, design: Design) -> tuple[tuple[str, str], ...]:
    """Keys and values that a design sets outside the effects; equal ones mean equal teeth."""
    return tuple((path, repr(value)) for path, value in assignments(study, design) if not path.startswith("effects."))


def pair_of(table: Mapping[str, Any]) -> Pair:
    """Build the pair of a scene's ``pair`` table; pairs are cached because many designs share one.

    Raises
    ------
    InputError
        If the table is not a valid pair.
    """
    pair = _pair(json.dumps(table, sort_keys=True, default=str))
    if isinstance(pair, InputError):
        raise pair
    return pair


@lru_cache(maxsize=1024)
def _pair(text: str) -> Pair | InputError:
    """Pair of a table given as JSON, or the error that it raises."""
    try:
        return read(Pair, json.loads(text))
    except InputError as error:
        return error.within("pair")


def cost_of(study: OptimisationStudy, design: Design) -> float:
    """Cost of a design: the sum over the values of its variables. Variables of an effect left out have the value 0."""
    values = dict(zip((v.name for v in study.variables), values_of(study, design), strict=True))
    return sum(costs.get(str(values[name]), 0.0) for name, costs in study.costs.items())


def _over_loads(study: OptimisationStudy, by_load: Sequence) -> NDArray:
    """Combine values (load, …), torques ascending, into one (…): the weighted mean or the maximum over the loads."""
    if len(by_load) == 1:
        return np.array(by_load[0])
    loads = read_loads(study.base["loads"], "base.loads")
    return np.max(by_load, axis=0) if study.over_loads == "max" else np.tensordot(load_weights(loads), by_load, axes=1)


@lru_cache(maxsize=16)
def _unit_points(sampler: Sampler, samples: int, dimension: int, seed: int) -> NDArray:
    """Error samples as points of the unit cube, (sample, error), the same for every design."""
    points = unit_samples(sampler, samples, dimension, seed)
    points.flags.writeable = False
    return points
