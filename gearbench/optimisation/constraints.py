"""Quantities that a study may limit, and how far a design is from its limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache, partial
from types import MappingProxyType

from gearbench.errors import InputError
from gearbench.optimisation.study import Limit
from gearbench.results.responses import is_over_speed, is_response, response, responses
from gearbench.results.solved import Solved
from gearbench.scene import Scene
from gearbench.solution import solve_scene
from gearbench.strength.rating import GEOMETRIC, contact_pressure, root_stress


def largest_pressure(solved: Solved) -> float:
    """Largest Hertz pressure over the mesh cycle, from the solved load distribution [MPa]."""
    return float(contact_pressure(solved.lines, solved.solution.force).max())


#: From the scene solved.
UNDER_LOAD: Mapping[str, Callable[[Solved], float]] = MappingProxyType(
    {"contact_pressure": largest_pressure, "root_stress": lambda solved: max(root_stress(solved.scene))}
)


def check_limited(name: str) -> None:
    """Refuse quantities that cannot be limited.

    Raises
    ------
    InputError
        Naming those that can: numbers of the geometry, of the strength, and responses as ``simulate`` has them.
    """
    if name not in GEOMETRIC and name not in UNDER_LOAD and not is_response(name):
        allowed = ", ".join([*GEOMETRIC, *UNDER_LOAD, *responses()])
        raise InputError(f"constraints.{name}", "unknown quantity", f"allowed: {allowed}")


def constrained(
    scene: Scene,
    limits: Mapping[str, Limit],
    solved: Callable[[], Solved] | None = None,
    over_speed: Callable[[], float] = lambda: math.nan,
) -> dict[str, float]:
    """Limited quantities of ``scene`` by name; NaN where they were not computed.

    Quantities beyond the geometry need the scene solved: ``solved`` is called only for that, and only where the
    geometric limits hold; by default the scene is solved here. So is ``over_speed`` for the force over speeds.
    """
    solved = solved or cache(partial(solve_scene, scene))
    values = {name: GEOMETRIC[name](scene.pair) if name in GEOMETRIC else math.nan for name in limits}
    if not any(limits[name].violation(value) > 0 for name, value in values.items() if name in GEOMETRIC):
        for name in limits:
            if name not in GEOMETRIC:
                values[name] = over_speed() if is_over_speed(name) else _under_load(name, solved())
    return values


def _under_load(name: str, solved: Solved) -> float:
    return UNDER_LOAD[name](solved) if name in UNDER_LOAD else float(response(name).reduce(solved.cycle))


def judge(values: Mapping[str, float], limits: Mapping[str, Limit]) -> tuple[float, str]:
    """Sum of the relative violations, and in words which limits do not hold ("" where all do)."""
    broken = {
        name: limit.violation(values[name])
        for name, limit in limits.items()
        if not math.isnan(values[name]) and limit.violation(values[name]) > 0
    }
    return sum(broken.values()), "; ".join(limits[name].describe(name, values[name]) for name in broken)
