"""Solid teeth, alone and on a ring, that the tests of gear bodies share."""

from __future__ import annotations

from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.gear import Gear
from tests.support.gears import standard_gear

E, NU = 210e3, 0.3


def gear(helix=0.0, teeth=25, module=2.0, width=12.0) -> Gear:
    return standard_gear(teeth, width, normal_module=module, helix=helix, profile_shift=0.1)


def tooth(g: Gear | None = None, order=(4, 5, 5), **options) -> SolidTooth:
    return SolidTooth(gear=g or gear(), E=E, nu=NU, order=order, **options)


def body(g: Gear | None = None, bore=0.6, order=(4, 5, 5), along=8, **options) -> ToothedRing:
    """Ring with teeth; ``bore`` is the bore radius over the root radius."""
    t = tooth(g, order, **options)
    return ToothedRing(tooth=t, bore_radius=bore * t.gear.root_radius, order=along)
