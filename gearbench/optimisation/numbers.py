"""Scalar quantities of a design that do not depend on the manufacturing errors, for objectives and limits.

They come from the variables, the geometry, the scene, or the solved scene, in order of computing time. Responses, which
do depend on the errors, are in ``gearbench.results.responses``. For a planetary set, ``constraints`` evaluates the
quantities of ``GEOMETRIC`` and ``UNDER_LOAD`` in every mesh; the worst value counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

from gearbench.geometry.names import CARRIER, RING, SUN
from gearbench.geometry.planetary import PlanetarySet
from gearbench.results.solved import Solved
from gearbench.scene import Scene
from gearbench.strength.bending import RootBending
from gearbench.strength.rating import GEOMETRIC, contact_pressure, root_stress

#: Quantity from the variables: the sum of the costs of their values, from the table ``costs`` of the study.
COST = "cost"
#: Members of a planetary set that may drive, be driven or stand still.
CENTRAL = (SUN, RING, CARRIER)
#: Gauss points on each piece of the tooth outline; they give its area to ten digits.
POINTS = 16
#: Effects that are flank modifications by design, unlike errors and measured flanks.
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


def each_mesh(scene: Scene) -> tuple[Scene, ...]:
    """Scenes of the distinct meshes: sun-planet and planet-ring of a planetary set; otherwise the scene itself."""
    planetary = scene.planetary
    if planetary is None:
        return (scene,)
    # meshes of the sun with all planets come first, then those of the ring: take the first of each kind
    planets = planetary.keys.number
    return tuple(scene.meshes.values())[::planets]


def mass(scene: Scene) -> float:
    """Mass of all gears [kg]: generated teeth and a body that reaches to the bore (to the axis if it has none).

    The body of a ring reaches to its outer diameter.
    """
    from gearbench.compliance.outline import tooth_outline

    planetary, meshes, total = scene.planetary, each_mesh(scene), 0.0
    count = dict.fromkeys((name for mesh in meshes for name in mesh.gear_names), 1)
    if planetary is not None:
        count |= {name: planetary.keys.number for name in count if name not in (SUN, RING)}
    for mesh in meshes:
        gears = zip(mesh.gear_names, mesh.pair.gears, mesh.pair.members, mesh.pair.materials, strict=True)
        for name, gear, member, material in gears:
            _, weight, half_width, _ = tooth_outline(gear, POINTS)
            bore_or_rim = member.bore_diameter if gear.teeth > 0 else member.outer_diameter or 2 * abs(gear.root_radius)
            body = math.pi * abs(gear.root_radius**2 - ((bore_or_rim or 0.0) / 2) ** 2)
            area = body + abs(gear.teeth) * 2 * float(weight @ half_width)
            total += count.pop(name, 0) * area * gear.face_width * material.density  # a planet is in two meshes
    return 1e-6 * total  # mm³ · g/cm³ → kg


def gear_ratio(scene: Scene) -> float:
    """u = z_2/z_1; for a planetary set, speed of the fastest central member over that of the slowest turning one."""
    if scene.planetary is None:
        return scene.pair.wheel.teeth / scene.pair.pinion.teeth
    turning = [abs(float(rate)) for name, rate in scene.geometry.rates.items() if name in CENTRAL and rate]
    return max(turning) / min(turning)


def axial_force(scene: Scene) -> float:
    """F_a = F_t tan β with F_t = 2T/d at the reference circle [N]."""
    gear = scene.pair.gears[0]
    return 1e3 * scene.load.torque / gear.pitch_radius * math.tan(gear.beta)


def modifications(scene: Scene) -> int:
    """Number of kinds of flank modification in use."""
    return sum(scene.effect(name) is not None for name in MODIFICATIONS)


def largest_pressure(solved: Solved) -> float:
    """Largest Hertz pressure over the mesh cycle, from the solved load distribution [MPa]."""
    return float(contact_pressure(solved.lines, solved.solution.force).max())


def _of_flank(name: str) -> Callable[[Solved], float]:
    """Return a function that gives the largest value over the mesh cycle of ``gearbench.results.flank.<name>``."""

    def largest(solved: Solved) -> float:
        from gearbench.results import flank

        return float(getattr(flank, name)(solved).max())

    return largest


def largest_root_stress(scene: Scene) -> float:
    """Largest root stress of all gears [MPa]; a planetary set leaves out its ring, which no rack can cut."""
    if scene.planetary is None:
        return max(root_stress(scene))
    sides = ((mesh, index) for mesh in each_mesh(scene) for index in (0, 1) if mesh.pair.gears[index].teeth > 0)
    return max(RootBending(pair=mesh.pair, gear=index).stress(abs(mesh.load.torque)) for mesh, index in sides)


def _of_set(compute: Callable[[PlanetarySet, Scene], float]) -> Callable[[Scene], float]:
    """Return a function of the scene that computes a quantity of its planetary set, and gives NaN for a pair."""

    def of_scene(scene: Scene) -> float:
        planetary = scene.planetary
        return math.nan if planetary is None else compute(planetary, scene)

    return of_scene


#: Quantities from the gears and planet positions of a planetary set: clearance between the tips of neighbouring planets
#: [mm], largest deviation of a planet from even spacing [°], and shares of the first mesh harmonic that add up over the
#: planets, as a torque or as a radial force on the sun.
OF_SET: Mapping[str, Callable[[Scene], float]] = MappingProxyType(
    {
        "planet_room": _of_set(lambda planetary, scene: planetary.room(mesh.pair for mesh in each_mesh(scene))),
        "spacing_error": _of_set(lambda planetary, _: planetary.spacing_error),
        "torsion_share": _of_set(
            lambda planetary, scene: planetary.share_that_adds_up(scene.pair.pinion.teeth, waves=0)
        ),
        "radial_share": _of_set(
            lambda planetary, scene: planetary.share_that_adds_up(scene.pair.pinion.teeth, waves=1)
        ),
    }
)
#: Quantities from the scene.
OF_SCENE: Mapping[str, Callable[[Scene], float]] = MappingProxyType(
    {
        **OF_SET,
        "gear_ratio": gear_ratio,
        "mass": mass,
        "root_stress": largest_root_stress,
        "axial_force": axial_force,
        "modifications": modifications,
        "pinion_teeth": lambda scene: scene.pair.pinion.teeth,
        "wheel_teeth": lambda scene: scene.pair.wheel.teeth,
        "pinion_addendum": lambda scene: scene.pair.gears[0].addendum,
        "wheel_addendum": lambda scene: scene.pair.gears[1].addendum,
    }
)
#: Quantities from the solved scene.
UNDER_LOAD: Mapping[str, Callable[[Solved], float]] = MappingProxyType(
    {
        "contact_pressure": largest_pressure,
        "face_load_factor": _of_flank("face_load_factor"),
        "flash_temperature": _of_flank("flash_temperature"),
        "friction_loss": _of_flank("friction_loss"),
    }
)
#: Names of all quantities of this module and of ``strength.rating.GEOMETRIC``.
NUMBERS = (COST, *GEOMETRIC, *OF_SCENE, *UNDER_LOAD)
#: Quantities that a planetary set does not have.
OF_PAIR = ("axial_force", "modifications", "pinion_teeth", "wheel_teeth", "pinion_addendum", "wheel_addendum")
#: Quantities that need the table ``operation`` of the scene.
OF_OPERATION = ("flash_temperature", "friction_loss")
