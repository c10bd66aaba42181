"""The catalogue of hard cases: scenes at the edge of what a gear pair can be, each with why it is hard.

``digits`` is the number of correct decimal digits that δ, k and the forces must keep against the whole chain in
extended precision (``extended.chain.solve_scene``) at ``phases``; a double holds 15.9.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydantic import ValidationError

from gearbench.effects.base import Effect
from gearbench.effects.crowning import Crowning
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import LOADS, Load, Resolution, Scene

SPUR = Pair(normal_module=3.0, face_width=24.0, centre_distance=90.0, pinion=Member(teeth=24), wheel=Member(teeth=36))
HELICAL = replace(SPUR, helix_angle=18.0, centre_distance=94.9)
NOMINAL = 150.0  # N·m
PAPER, BANASCHEK, YANG = ToothBending(), Hertz(law="weber_banaschek"), Hertz(law="yang_sun")


@dataclass(frozen=True, kw_only=True)
class HardCase:
    """A named scene, why it is hard, and the digits asserted against extended precision at some mesh phases."""

    name: str
    why: str
    build: Callable[[], Scene]
    digits: float = 13.0
    phases: tuple[float, ...] = (0.137, 0.71)
    slow: bool = False


CASES: dict[str, HardCase] = {}


def hard(name: str, why: str, **options: Any) -> Callable[[Callable[[], Scene]], Callable[[], Scene]]:
    """Enter the scene that the decorated function makes into the catalogue."""

    def enter(build: Callable[[], Scene]) -> Callable[[], Scene]:
        assert name not in CASES
        CASES[name] = HardCase(name=name, why=why, build=build, **options)
        return build

    return enter


def scene(pair: Pair, *gaps: Effect, torque: float = NOMINAL, law: Hertz = BANASCHEK, **options: Any) -> Scene:
    """Scene with the paper's plate (or ``order``) and a contact law."""
    bending = replace(PAPER, order=options.pop("order", None))
    return Scene(pair=pair, load=Load(torque=torque), effects=(bending, law, *gaps), resolution=Resolution(**options))


def last_valid(build: Callable[[float], Any], good: float, bad: float) -> Any:
    """What ``build`` makes of the last number before it refuses, from ``good`` towards ``bad``."""
    for _ in range(60):
        middle = (good + bad) / 2
        try:
            build(middle)
            good = middle
        except (ValidationError, ValueError):
            bad = middle
    return build(good)


# -- geometry ---------------------------------------------------------------------------------------------------------
def undercut(teeth: int) -> Pair:
    """Pinion without profile shift far below the limit of undercut; enough helix to keep a total contact ratio of 1."""
    pinion = Member(teeth=teeth, profile_shift=0.0 if teeth > 6 else 0.15, addendum=0.9)
    sizes = {"normal_module": 2.0, "helix_angle": 20.0, "face_width": 30.0}
    distance = (teeth + 40) / math.cos(math.radians(20.0))
    return Pair(**sizes, centre_distance=distance, pinion=pinion, wheel=Member(teeth=40, addendum=0.9))


for _z in (5, 8):
    hard(
        f"undercut, z = {_z}",
        "the rack tip cuts the involute away: the form radius is a root found by iteration, the path of contact ends "
        "there, next to the interference point where ρ → 0",
    )(lambda z=_z: scene(undercut(z), torque=20.0))


@hard("undercut spur, z = 12", "as above; u_A is the undercut, not the mate's tip")
def _() -> Scene:
    pinion, wheel = Member(teeth=12, profile_shift=0.0), Member(teeth=40)
    pair = Pair(normal_module=2.0, face_width=20.0, centre_distance=52.0, pinion=pinion, wheel=wheel)
    return scene(pair, torque=20.0)


@hard("teeth nearly pointed", "thickness at the tip → 0: D = 0 there, ln t of the contact law → −∞")
def _() -> Scene:
    def pair(addendum: float) -> Pair:
        pinion = Member(teeth=14, addendum=addendum, profile_shift=0.5)
        return replace(SPUR, pinion=pinion, wheel=Member(teeth=46, profile_shift=-0.5, dedendum=2.1))

    return scene(last_valid(pair, 0.6, 1.6), torque=50.0)


@hard("r_f < r_b", "no involute below the base circle; the thickness has a branch point inside the tooth")
def _() -> Scene:
    return scene(replace(SPUR, centre_distance=60.0, pinion=Member(teeth=18), wheel=Member(teeth=22)))


@hard("r_f just above r_b", "the branch point of the thickness lies just outside the tooth, hidden from quadrature")
def _() -> Scene:
    def pair(dedendum: float) -> Pair:
        member = Member(teeth=50, addendum=1.0, dedendum=dedendum)
        return replace(SPUR, centre_distance=150.0, pinion=member, wheel=member)

    gap = 50 / 2 * (1 - math.cos(math.radians(20.0)))  # (r − r_b)/m
    return scene(pair(gap - 1e-7))


@hard("β = 0.01°", "tan β_b ≈ 1e-4 divides: ends of the contact lines are differences of large numbers")
def _() -> Scene:
    return scene(replace(SPUR, helix_angle=0.01, centre_distance=90.01))


@hard("β = 1e-9°", "a helical pair by name, a spur one by size")
def _() -> Scene:
    return scene(replace(SPUR, helix_angle=1e-9, centre_distance=90.01))


@hard("β = 45°", "the contact lines are short and many; ε_β is large")
def _() -> Scene:
    return scene(replace(HELICAL, helix_angle=45.0, centre_distance=128.0, face_width=60.0))


def short(of: Pair, low: float) -> Scene:
    """Both addenda a millionth longer than they must be to keep contact."""

    def pair(addendum: float) -> Pair:
        return replace(of, pinion=Member(teeth=24, addendum=addendum), wheel=Member(teeth=36, addendum=addendum))

    return scene(pair(last_valid(pair, 1.0, low).pinion.addendum * (1 + 1e-6)))


@hard("ε_γ just above 1, spur", "one pair carries nearly everywhere; the panel of two pairs is 1e-6 of the cycle wide")
def _() -> Scene:
    return short(SPUR, 0.2)


@hard("ε_γ just above 1, helical", "the lines of two pairs are never there together but for corners", digits=12)
def _() -> Scene:
    return short(replace(HELICAL, face_width=8.0), 0.1)


@hard("b/m = 0.5", "a plate four times as high as wide: its width functions hardly differ over the face")
def _() -> Scene:
    return scene(replace(HELICAL, face_width=1.5, helix_angle=5.0, centre_distance=90.5), torque=10.0)


@hard("b/m = 100", "a plate a hundred times as wide as high, seven pairs in contact")
def _() -> Scene:
    return scene(replace(HELICAL, face_width=300.0), torque=1500.0)


def shifted(x: float) -> Pair:
    """SPUR with opposite profile shifts."""
    return replace(SPUR, pinion=Member(teeth=24, profile_shift=x), wheel=Member(teeth=36, profile_shift=-x))


@hard("x at its upper limit", "pinion tooth all but pointed, wheel with negative shift")
def _() -> Scene:
    return scene(last_valid(shifted, 0.0, 3.0), torque=50.0)


@hard("x at its lower limit", "undercut until the contact ratio is 1 or no involute is left")
def _() -> Scene:
    return scene(last_valid(shifted, 0.0, -3.0), torque=50.0)


@hard("two thousand teeth", "R and r_b agree in their first digits: the roll angle is a difference")
def _() -> Scene:
    sizes = {"normal_module": 1.0, "face_width": 10.0, "centre_distance": 1010.0}
    return scene(Pair(**sizes, pinion=Member(teeth=20), wheel=Member(teeth=2000)), torque=5.0)


# -- load and gaps ----------------------------------------------------------------------------------------------------
def heaviest(*gaps: Effect) -> Scene:
    """``HELICAL`` under the greatest load a scene may have, less what rounding needs where its units are changed."""
    ordinary = scene(HELICAL, *gaps)
    return replace(ordinary, load=Load(torque=NOMINAL * LOADS[1] / ordinary.relative_load * (1 - 1e-12)))


for _t in (1e-9, math.inf):
    _loaded = heaviest if _t == math.inf else lambda *gaps, t=_t: scene(HELICAL, *gaps, torque=NOMINAL * t)
    _name = "torque at its upper limit" if _t == math.inf else f"torque × {_t:.0e}"
    hard(
        _name,
        "vanishing load: the logarithm of Weber–Banaschek's law grows without bound"
        if _t < 1
        else "overload: the law is continued by its tangent, the compression dwarfs the tooth",
    )(_loaded)
    # with gaps of 1e4 compressions, cells that carry in part share the load by s²: 2e4 ulp, and four digits fewer
    few = _t == 1e-9
    hard(
        f"{_name}, gaps",
        "the same with gaps: a few segments, or all of them, carry",
        digits=11.5 if few else 13,
    )(lambda loaded=_loaded: loaded(Crowning(amount=5.0), HelixSlope(pinion=4.0)))

for _law in (YANG, BANASCHEK):
    hard(f"no gap at all, {_law.law}", "every segment touches at once; a residual of exactly zero must not divide")(
        lambda law=_law: scene(SPUR, law=law)
    )
    hard(f"gaps of 1e-12 deflections, {_law.law}", "gaps far below the deflection, above its rounding")(
        lambda law=_law: scene(HELICAL, Crowning(amount=1e-11), HelixSlope(wheel=-1e-11), law=law)
    )
    hard(
        f"gaps of 1000 deflections, {_law.law}", "most segments hang free; the first Newton step is far off", digits=12
    )(lambda law=_law: scene(HELICAL, Crowning(amount=300.0), HelixSlope(pinion=200.0), torque=1.0, law=law))
    hard(f"contact on one segment, {_law.law}", "the loaded matrix is 1 × 1; everything else is separated")(
        lambda law=_law: scene(SPUR, Crowning(amount=1000.0), torque=1e-3, law=law)
    )
    hard(f"contact lost on one pair, {_law.law}", "a block of the Hessian without a loaded segment")(
        lambda law=_law: scene(SPUR, TipRelief(amount=400.0, length=2.0), torque=5.0, law=law)
    )


# -- phases -----------------------------------------------------------------------------------------------------------
def beside(pair: Pair) -> tuple[float, ...]:
    """Every transition phase, one unit in the last place below and above it."""
    edges = pair.meshing.transition_phases
    return tuple(float(p) for t in edges for p in (np.nextafter(t, -1), t, np.nextafter(t, 2)) if p >= 0)


@hard(
    "stubs of contact lines",
    "lines of 1e-9 of the face width: compliance per segment 1e9 that of its neighbours",
    phases=tuple(float((t + d) % 1.0) for t in HELICAL.meshing.transition_phases for d in (-1e-9, 1e-9)),
)
def _() -> Scene:
    return scene(HELICAL)


for _name, _pair in (("spur", SPUR), ("helical", HELICAL)):
    hard(f"phases on and beside transitions, {_name}", "a contact line begins or ends here", phases=beside(_pair))(
        lambda pair=_pair: scene(pair)
    )

# -- material, basis, resolution --------------------------------------------------------------------------------------
for _nu in (0.0, 0.4999999999):
    hard(f"ν = {_nu:.10g}", "1 − ν² and 1 − 2ν; the plate has no term that diverges, the logarithm's is finite")(
        lambda nu=_nu: scene(replace(HELICAL, material=Material(poisson_ratio=nu)))
    )


@hard("thin teeth", "thickness less than half the height; the limit itself is in test_limits.py")
def _() -> Scene:
    def pair(dedendum: float) -> Pair:
        member = Member(teeth=60, addendum=1.0, dedendum=dedendum, fillet_radius=0.0)
        sizes = {"normal_module": 2.0, "pressure_angle": 14.5, "face_width": 30.0, "centre_distance": 120.0}
        return Pair(**sizes, pinion=member, wheel=member)

    return scene(last_valid(pair, 1.25, 3.0), order=(4, 3))


for _order in ((1, 1), (4, 4), (6, 6)):
    hard(f"Ritz order {_order}", "K is ill-conditioned in monomials; in Legendre functions it must not")(
        lambda order=_order: scene(HELICAL, order=order, segments=9)
    )


for _n in (1, 2, 500):
    hard(f"{_n} segments", "one unknown a line" if _n < 3 else "segments short beside everything else", slow=_n > 99)(
        lambda n=_n: scene(HELICAL, Crowning(amount=4.0), segments=n)
    )
