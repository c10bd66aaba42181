"""Numbers of a design that do not scatter with its errors: objectives and limits take them from here.

Of the variables, of the geometry, of the scene, of the scene solved, from cheap to dear. Responses, which scatter, are
those of ``gearbench.results.responses``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from gearbench.strength.rating import GEOMETRIC, contact_pressure, root_stress

if TYPE_CHECKING:
    from gearbench.results.solved import Solved
    from gearbench.scene import Scene

#: From the variables: what their values cost, by the tables ``costs`` of the study.
COST = "cost"
#: Gauss points on each panel of a tooth's outline: its area to ten digits.
POINTS = 16
#: Effects that a designer gives the flanks; errors and measured flanks are none.
MODIFICATIONS = (
    "crowning",
    "tip_relief",
    "root_relief",
    "end_relief",
    "profile_crowning",
    "flank_twist",
    "profile_slope",
    "helix_slope",
)


def mass(scene: Scene) -> float:
    """Mass of both gears, their teeth as generated, from the bore (none: from the axis) on [kg]."""
    from gearbench.compliance.outline import tooth_outline

    pair, total = scene.pair, 0.0
    for gear, member, material in zip(pair.gears, pair.members, pair.materials, strict=True):
        _, weight, half_width, _ = tooth_outline(gear, POINTS)
        held = (member.bore_diameter if gear.teeth > 0 else member.outer_diameter or 2 * abs(gear.root_radius)) or 0.0
        body = math.pi * abs(gear.root_radius**2 - (held / 2) ** 2)
        total += gear.face_width * (body + abs(gear.teeth) * 2 * float(weight @ half_width)) * material.density
    return 1e-6 * total


def gear_ratio(scene: Scene) -> float:
    """u = z_2/z_1."""
    return scene.pair.wheel.teeth / scene.pair.pinion.teeth


def axial_force(scene: Scene) -> float:
    """F_a = F_t tan β with F_t = 2T/d at the reference circle [N]."""
    gear = scene.pair.gears[0]
    return 1e3 * scene.load.torque / gear.pitch_radius * math.tan(gear.beta)


def modifications(scene: Scene) -> int:
    """Number of kinds of micro-geometry on the flanks."""
    return sum(scene.effect(name) is not None for name in MODIFICATIONS)


def largest_pressure(solved: Solved) -> float:
    """Largest Hertz pressure over the mesh cycle, from the solved load distribution [MPa]."""
    return float(contact_pressure(solved.lines, solved.solution.force).max())


def _of_flank(name: str) -> Callable[[Solved], float]:
    def number(solved: Solved) -> float:
        from gearbench.results import flank

        return float(getattr(flank, name)(solved).max())

    return number


#: From the scene.
OF_SCENE: Mapping[str, Callable[[Scene], float]] = MappingProxyType(
    {
        "gear_ratio": gear_ratio,
        "mass": mass,
        "root_stress": lambda scene: max(root_stress(scene)),
        "axial_force": axial_force,
        "modifications": modifications,
        "pinion_teeth": lambda scene: scene.pair.pinion.teeth,
        "wheel_teeth": lambda scene: scene.pair.wheel.teeth,
        "pinion_addendum": lambda scene: scene.pair.gears[0].addendum,
        "wheel_addendum": lambda scene: scene.pair.gears[1].addendum,
    }
)
#: From the scene solved.
UNDER_LOAD: Mapping[str, Callable[[Solved], float]] = MappingProxyType(
    {
        "contact_pressure": largest_pressure,
        "face_load_factor": _of_flank("face_load_factor"),
        "flash_temperature": _of_flank("flash_temperature"),
        "friction_loss": _of_flank("friction_loss"),
    }
)
#: All names.
NUMBERS = (COST, *GEOMETRIC, *OF_SCENE, *UNDER_LOAD)
#: Those that need the table ``operation`` of the scene.
OF_OPERATION = ("flash_temperature", "friction_loss")
