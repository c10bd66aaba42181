"""Quantities that a study may limit, and how far a design is from its limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

from gearbench.optimise.study import Limit
from gearbench.outputs import Solved
from gearbench.scene import Scene

#: From the geometry alone.
GEOMETRIC: Mapping[str, Callable[[Scene], float]] = MappingProxyType(
    {
        "total_contact_ratio": lambda scene: scene.pair.total_contact_ratio,
        "transverse_contact_ratio": lambda scene: scene.pair.transverse_contact_ratio,
        "overlap_ratio": lambda scene: scene.pair.overlap_ratio,
        "specific_sliding": lambda scene: scene.pair.largest_sliding,
    }
)
#: From the solved load distribution and the root section: computed only where the geometric limits hold.
OF_STRENGTH = ("contact_pressure", "root_stress")

CONSTRAINTS = (*GEOMETRIC, *OF_STRENGTH)


def constrained(
    scene: Scene, limits: Mapping[str, Limit], solved: Callable[[], Solved | None] = lambda: None
) -> dict[str, float]:
    """Limited quantities of ``scene`` by name; NaN where they were not computed.

    Those of strength need the scene solved: ``solved`` is called at most once, and only for them.
    """
    values = {name: GEOMETRIC[name](scene) for name in limits if name in GEOMETRIC}
    wanted = [name for name in limits if name in OF_STRENGTH]
    if wanted:
        values |= dict.fromkeys(wanted, math.nan)
        if all(limits[name].violation(value) == 0 for name, value in values.items() if name in GEOMETRIC):
            values |= {name: value for name, value in _strength(scene, solved()).items() if name in wanted}
    return {name: values[name] for name in limits}


def _strength(scene: Scene, solved: Solved | None) -> dict[str, float]:
    from gearbench.strength import strength

    numbers = strength(scene, solved)
    return {"contact_pressure": numbers.contact_pressure, "root_stress": max(numbers.root_stress)}


def judge(values: Mapping[str, float], limits: Mapping[str, Limit]) -> tuple[float, str]:
    """Sum of the relative violations, and in words which limits do not hold ("" where all do)."""
    broken = {
        name: limit.violation(values[name])
        for name, limit in limits.items()
        if not math.isnan(values[name]) and limit.violation(values[name]) > 0
    }
    return sum(broken.values()), "; ".join(limits[name].describe(name, values[name]) for name in broken)
