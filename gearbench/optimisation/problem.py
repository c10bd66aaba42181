"""From a design to its objectives: scene, constraints, and the response to the error samples."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache, partial
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
from gearbench.optimisation.racing import Rivals, stages, statistics
from gearbench.optimisation.samples import Forces, cycle_responses, sample_responses
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.variables import Value
from gearbench.results.solved import Solved
from gearbench.robustness.sampling import Sampler, unit_samples
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene, read_loads
from gearbench.schema import read
from gearbench.simulation import simulate
from gearbench.solution import solve_scene

if TYPE_CHECKING:
    from gearbench.dynamics.over_speed import ForceOverSpeed
    from gearbench.robustness.montecarlo import RobustProblem

#: Violation of a design that makes no scene, or none that can be solved: more than limits can add up to.
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


def evaluate(study: OptimisationStudy, design: Design, rivals: Rivals | None = None) -> Evaluation:
    """Evaluate a design: the same answer wherever and in whatever order it is computed.

    Where ``rivals`` are given, it stops as soon as its error samples say that one of them beats it, and limits that it
    keeps roughly (``constraints.solve_roughly``) hold.

    A design that makes no gear, or one that cannot be solved, is an answer too: it violates the constraints, with the
    reason. No design raises, unless the machine is too small for it, which says nothing about the gear.

    Raises
    ------
    MemoryBudgetError
        If it needs more memory than there may be.
    """
    unknown = (math.nan,) * len(study.constraints)
    nothing = (math.nan,) * len(study.statistics)
    try:
        scene, limits, cost = scene_of(study, design), study.constraints, cost_of(study, design)
        solved = cache(partial(solve_scene, scene))
        rough = None
        if rivals is not None and not scene.loads and may_be_rough(scene, limits):
            rough = cache(partial(solve_roughly, scene))
        forces = Forces(study=study)
        values = constrained(scene, limits, rough or solved, cost, forces.without_errors)
        if rough is not None and judge(values, limits)[0] > 0 and not decided(values, limits):
            values = constrained(scene, limits, solved, cost)
        answer = _judged(study, values)
        unknown = answer.constraints
        if not answer.feasible:
            return answer
        numbers = _numbers(study, scene, solved, cost)
        found = _feasible(study, scene, numbers, forces, rivals, rough() if rough is not None else None)
        if rough is not None and found.samples == study.robustness.samples:  # nothing beats it: its limits to the end
            values = constrained(scene, limits, solved, cost, forces.without_errors)
            answer = _judged(study, values)
        return replace(found, constraints=answer.constraints) if answer.feasible else answer
    except MemoryBudgetError:
        raise
    except (InputError, GearbenchError, ArithmeticError, np.linalg.LinAlgError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        return Evaluation(violation=NO_GEAR, reason=reason, constraints=unknown, statistics=nothing)


def _judged(study: OptimisationStudy, values: Mapping[str, float]) -> Evaluation:
    """Evaluation of a design of which only the ``values`` of the limited quantities are known."""
    violation, reason = judge(values, study.constraints)
    return Evaluation(
        violation=violation,
        reason=reason,
        constraints=tuple(values.values()),
        statistics=(math.nan,) * len(study.statistics),
    )


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
    return parse_scene(tables | {"pair": pair_of(tables.get("pair", {}))})


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


def gear_key(study: OptimisationStudy, design: Design) -> bytes:
    """What a design stands for in 16 bytes: equal for designs that are the same gear, and for no others."""
    same = tuple((path, float(v) if isinstance(v, int | float) else v) for path, v in assignments(study, design))
    return hashlib.blake2b(repr(same).encode(), digest_size=16).digest()


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
    """What the values of a design's variables cost; those of an effect that it does without cost nothing."""
    given = dict(zip((v.name for v in study.variables), values_of(study, design), strict=True))
    return sum(costs.get(str(given[name]), 0.0) for name, costs in study.costs.items())


def _feasible(
    study: OptimisationStudy,
    scene: Scene,
    numbers: tuple[float, ...],
    forces: Forces,
    rivals: Rivals | None,
    rough: Solved | None,
) -> Evaluation:
    """Evaluation of a design that keeps its limits; their values are not yet in it.

    ``numbers`` are those of the study; ``rough`` is the scene at the mesh phases of its error samples, where it was
    solved there.
    """
    if study.robustness.samples == 0:
        found = _at_nominal(study, scene, forces)
        found |= zip(study.numbers, numbers, strict=True)
        answer = Evaluation(
            violation=0.0, reason="", constraints=(), statistics=tuple(found.get(n, math.nan) for n in study.statistics)
        )
    else:
        answer = _dispersion(study, scene, numbers, forces, rivals, rough)
    known = dict(zip(study.statistics, answer.statistics, strict=True))
    for name in {name for objective in study.objectives for name in objective.weights}:
        if not math.isfinite(known[name]):
            raise GearbenchError(f"{name} is not finite")
    return answer


def _dispersion(
    study: OptimisationStudy,
    scene: Scene,
    numbers: tuple[float, ...],
    forces: Forces,
    rivals: Rivals | None,
    rough: Solved | None,
) -> Evaluation:
    """Statistics over the error samples, as many as it takes."""
    r, kinds = study.robustness, scene.effect("manufacturing_errors")
    assert isinstance(kinds, ManufacturingErrors)
    unit = _unit(r.sampler, r.samples, len(kinds.variables(scene.pair)), r.seed)
    problems = _robust_problems(scene, rough) if cycle_responses(study) else [None] * len(scene.each_load)
    each = list(zip(problems, (forces.of(one) for one in scene.each_load), strict=True))
    values = np.empty((len(study.responses), 0))
    for stop in stages(study) if rivals is not None else (r.samples,):
        errors = kinds.draw(unit[values.shape[1] : stop], scene.pair)
        values = np.hstack([values, _responses(study, each, errors)])
        if rivals is not None and stop < r.samples and (by := rivals.beating(values, numbers)) is not None:
            found, kept = rivals.estimate(values, by, numbers), None
            break
    else:
        found, kept = statistics(values, numbers), values if r.racing else None
    return Evaluation(
        violation=0.0,
        reason="",
        constraints=(),
        statistics=tuple(map(float, found)),
        samples=values.shape[1],
        values=kept,
    )


def _at_nominal(study: OptimisationStudy, scene: Scene, forces: Forces) -> dict[str, float]:
    """Responses of the scene as it is, as means over one sample, by name."""
    found, names = {}, cycle_responses(study)
    if forces.wanted:
        each = [forces.without_errors(one) for one in scene.each_load]
        found["mesh_force_mean"] = float(_over_loads(study, each))
    if not names:
        return found
    if not scene.loads:
        dataset = simulate(scene, outputs=names)
        return found | {f"{name}_mean": float(dataset[name]) for name in names}
    from gearbench.sweeps.run import sweep

    dataset = sweep(scene, outputs=names, threads=1)
    return found | {f"{name}_mean": float(dataset[f"{name}_load_{study.over_loads}"]) for name in names}


def _robust_problems(scene: Scene, rough: Solved | None) -> list[RobustProblem]:
    """Problem of the error samples, or those under each of several loads, torques ascending."""
    from gearbench.robustness.montecarlo import prepare_problem, prepare_scene

    if rough is not None:
        return [prepare_problem(scene, rough.lines, rough.weight, rough.problem)]
    if not scene.loads:
        return [prepare_scene(scene)]
    from gearbench.sweeps.loads import Shared, under_loads

    shared, torques = Shared(), [each.load.torque for each in scene.each_load]
    return [problem for group in under_loads(scene, torques) for problem in shared.samples(group)]


def _responses(
    study: OptimisationStudy, each: Sequence[tuple[RobustProblem | None, ForceOverSpeed | None]], errors: NDArray
) -> NDArray:
    """Responses to the ``errors`` (sample, error), over the loads as the study has it, (response, sample)."""
    return _over_loads(study, [sample_responses(study, problem, force, errors) for problem, force in each])


def _numbers(study: OptimisationStudy, scene: Scene, solved: Callable[[], Solved], cost: float) -> tuple[float, ...]:
    """Numbers of the design among the objectives, over the loads as the study has it; ``solved``: of a single load."""
    if not study.numbers:
        return ()
    each = [(one, cache(partial(solve_scene, one)) if scene.loads else solved) for one in scene.each_load]
    found = _over_loads(study, [[number(name, one, of, cost) for name in study.numbers] for one, of in each])
    return tuple(map(float, found))


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
