"""From a design to its objectives: scene, constraints, and the response to the error samples."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import MemoryBudgetError
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.errors import GearbenchError, InputError
from gearbench.geometry.pair import Pair
from gearbench.optimisation.constraints import constrained, judge
from gearbench.optimisation.derived import DERIVED
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.variables import Value
from gearbench.results.responses import STATISTICS, is_over_speed
from gearbench.robustness.sampling import Sampler, unit_samples
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.schema import read
from gearbench.simulation import simulate
from gearbench.solution import solve_scene

if TYPE_CHECKING:
    from gearbench.dynamics.over_speed import ForceOverSpeed

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
    """

    violation: float
    reason: str
    constraints: tuple[float, ...]
    statistics: tuple[float, ...]

    @property
    def feasible(self) -> bool:
        """Whether it keeps all limits."""
        return self.violation == 0

    def objectives(self, study: OptimisationStudy) -> tuple[float, ...]:
        """Values of the study's objectives; NaN where it is not feasible."""
        known = dict(zip(study.statistics, self.statistics, strict=True))
        return tuple(objective.value(known) for objective in study.objectives)


def evaluate(study: OptimisationStudy, design: Design) -> Evaluation:
    """Evaluate a design: the same answer wherever and in whatever order it is computed.

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
        scene = scene_of(study, design)
        solved = cache(partial(solve_scene, scene))
        values = constrained(scene, study.constraints, solved, partial(_force_without_errors, study, scene))
        violation, reason = judge(values, study.constraints)
        unknown = tuple(values.values())
        if violation > 0:
            return Evaluation(violation=violation, reason=reason, constraints=unknown, statistics=nothing)
        statistics = _statistics(study, scene)
        return Evaluation(violation=0.0, reason="", constraints=unknown, statistics=statistics)
    except MemoryBudgetError:
        raise
    except (InputError, GearbenchError, ArithmeticError, np.linalg.LinAlgError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        return Evaluation(violation=NO_GEAR, reason=reason, constraints=unknown, statistics=nothing)


def scene_of(study: OptimisationStudy, design: Design) -> Scene:
    """The scene of a design.

    Raises
    ------
    InputError
        If there is no such gear.
    """
    tables: dict[str, Any] = deepcopy(study.base)
    for path, value in assignments(study, design):
        if value is None:
            tables.get("effects", {}).pop(path.removeprefix("effects."), None)
        elif path not in DERIVED:
            _put(tables, path, value)
    asked = dict(assignments(study, design))
    for path, derive in DERIVED.items():
        if (value := asked.get(path)) is not None:
            for key, derived in derive(tables, pair_of, float(value)).items():
                _put(tables, key, derived)
    return parse_scene(tables | {"pair": pair_of(tables.get("pair", {}))})


def assignments(study: OptimisationStudy, design: Design) -> tuple[tuple[str, Value | None], ...]:
    """Keys and values that a design stands for, sorted: equal for designs that are the same gear.

    An effect whose amount or length is 0 is absent: ("effects.<name>", None) takes the place of its keys.
    """
    given: dict[str, Value | None] = {
        path: variable.value(code)
        for variable, code in zip(study.variables, design, strict=True)
        for path in variable.paths
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


def _put(tables: dict[str, Any], path: str, value: Any) -> None:
    *parents, last = path.split(".")
    for key in parents:
        tables = tables.setdefault(key, {})
    tables[last] = value


def _statistics(study: OptimisationStudy, scene: Scene) -> tuple[float, ...]:
    """In the order of ``study.statistics``."""
    if study.robustness.samples == 0:
        of_cycle = [name for name in study.responses if not is_over_speed(name)]
        dataset = simulate(scene, outputs=of_cycle) if of_cycle else {}
        found = {f"{name}_mean": float(dataset[name]) for name in of_cycle}
        if study.speeds:
            found["mesh_force_mean"] = _force_without_errors(study, scene)
    else:
        found = _dispersion(study, scene)
    for name in {name for objective in study.objectives for name in objective.weights}:
        if not math.isfinite(found.get(name, math.nan)):
            raise GearbenchError(f"{name} is not finite")
    return tuple(found.get(name, math.nan) for name in study.statistics)


def _dispersion(study: OptimisationStudy, scene: Scene) -> dict[str, float]:
    """Statistics of each response over the error samples, by name."""
    from gearbench.robustness.montecarlo import prepare_scene, respond

    r = study.robustness
    kinds = scene.effect("manufacturing_errors")
    assert isinstance(kinds, ManufacturingErrors)
    errors = kinds.draw(_unit(r.sampler, r.samples, len(kinds.error_modes(scene.pair)), r.seed), scene.pair)
    of_cycle = [name for name in study.responses if not is_over_speed(name)]
    forces, parts, answers = _forces(study, scene), [], {}
    # the dynamics takes its samples of the contact from here, where they are the same
    shared = [force for force in forces if force.shares(scene)] if of_cycle else []
    if of_cycle:
        more = {f"{number}": force.of_cycles for number, force in enumerate(shared)}
        found, complete = respond(prepare_scene(scene), errors, names=of_cycle, more=more)
        if not complete:
            raise KeyboardInterrupt
        answers, parts = {name: found[name] for name in of_cycle}, [found[name] for name in more]
    if forces:
        parts += [force.of_samples(errors) for force in forces if force not in shared]
        answers["mesh_force"] = np.sqrt(np.mean(np.square(parts), axis=0))
    return {
        f"{name}_{statistic}": compute(answers[name])
        for name in study.responses
        for statistic, (compute, _) in STATISTICS.items()
    }


def _forces(study: OptimisationStudy, scene: Scene) -> tuple[ForceOverSpeed, ...]:
    """The force over speed at each torque, where it is asked for."""
    if (speeds := study.speeds) is None:
        return ()
    from gearbench.dynamics.over_speed import ForceOverSpeed

    scenes = [replace(scene, load=replace(scene.load, torque=torque)) for torque in speeds.torques] or [scene]
    return tuple(ForceOverSpeed(scene=one, speeds=speeds.values, harmonics=speeds.harmonics) for one in scenes)


def _force_without_errors(study: OptimisationStudy, scene: Scene) -> float:
    """``mesh_force`` of a scene itself [N]."""
    return float(np.sqrt(np.mean([force.without_errors() ** 2 for force in _forces(study, scene)])))


@lru_cache(maxsize=16)
def _unit(sampler: Sampler, samples: int, dimension: int, seed: int) -> NDArray:
    """Samples of the unit cube, the same for every design."""
    unit = unit_samples(sampler, samples, dimension, seed)
    unit.flags.writeable = False
    return unit
