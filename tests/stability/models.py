"""The hard cases for the solid tooth and for elastic gear bodies, with the digits they keep."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Scene
from tests.stability.catalogue import CASES, shifted

ORDER = (3, 4, 4)


@dataclass(frozen=True, kw_only=True)
class SolidCase:
    """A scene with solid teeth of ``order``: digits asserted of δ, k, P and of the compliance of both teeth."""

    name: str
    why: str
    build: Callable[[], Scene]
    digits: float = 9.0
    order: tuple[int, int, int] = ORDER
    phase: float = 0.137
    slow: bool = True


@dataclass(frozen=True, kw_only=True)
class BodyCase:
    """Pinion of a pair with its body, held at a bore of so much of the root radius; solid teeth of ``order``."""

    name: str
    why: str
    pair: Pair
    bore: float = 0.5
    order: tuple[int, int, int] = (2, 3, 3)
    along: int = 6
    digits: float = 12.0
    slow: bool = True


def solid(scene: Scene, order: tuple[int, int, int] = ORDER) -> Scene:
    """The scene with solid teeth."""
    return replace(scene, effects=(ToothBending(model="solid", order=order), *scene.effects[1:]))


#: Reasons and digits where solids differ from plates.
OTHERWISE: dict[str, tuple[str | None, float]] = {
    "teeth nearly pointed": (
        "strains grow like 1/thickness: what is left of it at the tip, rounding alone, counts by its logarithm",
        4.0,
    ),
    "thin teeth": (
        "sharp rack tip: the longest fillet in its parameter, where quadrature is coarsest",
        9.0,
    ),
    "ν = 0.4999999999": ("λ/μ = 5·10⁹: the condition number of K grows by as much", 6.5),
}
#: Cases of load, gaps, phases and segments are of the same two pairs, and are solved with plates.
ONE_PAIR = ("torque", "no gap at all, yang_sun", "gaps of", "contact", "stubs", "phases", "Ritz")
#: The tip of the exact pinion is beyond its pointed radius by 1e-16; SOLIDS has one just below.
LEFT_OUT = {"x at its upper limit", "1 segments", "2 segments"}
QUICK = {"undercut, z = 5", "β = 45°"}


def just_below_pointed(x: float) -> Scene:
    """Profile shift so much below the one at which the tip is pointed."""
    base = CASES["x at its upper limit"].build()
    return replace(base, pair=shifted(base.pair.pinion.profile_shift - x))


SOLIDS: dict[str, SolidCase] = {
    c.name: SolidCase(
        name=c.name,
        why=OTHERWISE.get(c.name, (None,))[0] or c.why,
        build=lambda c=c: solid(c.build()),
        digits=OTHERWISE.get(c.name, (None, 9.0))[1],
        phase=c.phases[0],
        slow=c.name not in QUICK,
    )
    for c in CASES.values()
    if not c.slow and not c.name.startswith(ONE_PAIR) and c.name not in LEFT_OUT
}
SOLIDS |= {
    c.name: c
    for c in (
        SolidCase(
            name="x 1e-6 below its upper limit",
            why="a tip of 1e-6 modules: strains grow like 1/thickness towards it",
            build=lambda: solid(just_below_pointed(1e-6)),
            digits=9.5,
        ),
        *(
            SolidCase(
                name=f"solid of order {order}",
                why="more functions, higher degrees",
                build=lambda order=order: solid(CASES["no gap at all, weber_banaschek"].build(), order),
                order=order,
                slow=order != (2, 3, 3),
            )
            for order in ((2, 3, 3), (4, 5, 5), (5, 6, 6))
        ),
    )
}


def body_pair(teeth: int = 12, beta: float = 0.0, width: float = 20.0, nu: float = 0.3) -> Pair:
    return Pair(
        normal_module=2.0, helix_angle=beta, face_width=width,
        centre_distance=(teeth + 40) / math.cos(math.radians(beta)),
        pinion=Member(teeth=teeth), wheel=Member(teeth=40), material=Material(poisson_ratio=nu),
    )  # fmt: skip


BODIES: dict[str, BodyCase] = {
    c.name: c
    for c in (
        BodyCase(name="body, z = 12", why="an undercut pinion", pair=body_pair()),
        BodyCase(
            name="body, z = 12, few functions", why="the same, smaller", pair=body_pair(), order=(2, 1, 2), along=3,
            slow=False,
        ),
        BodyCase(
            name="body, z = 60, few functions", why="12 of 31 waves", pair=body_pair(teeth=60), order=(2, 1, 2),
            along=3,
        ),
        BodyCase(name="body, β = 30°", why="all functions couple: only the half-turn is left", pair=body_pair(beta=30)),
        BodyCase(name="body, z = 100", why="13 of 51 waves, harmonics to 1200", pair=body_pair(teeth=100)),
        BodyCase(name="body, thin rim", why="a shell: bore of 0.97 root radius", pair=body_pair(), bore=0.97),
        BodyCase(name="body, small bore", why="R over a factor of twenty: powers R⁻ⁿ", pair=body_pair(), bore=0.05),
        BodyCase(name="body, b/m = 100, β = 30°", why="∂_z small beside κn", pair=body_pair(width=200.0, beta=30.0)),
        BodyCase(name="body, ν = 0.499", why="λ/μ = 500", pair=body_pair(nu=0.499)),
    )
}  # fmt: skip
