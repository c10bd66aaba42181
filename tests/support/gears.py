"""Gears for tests: a standard gear, of which a test changes some keys, and pairs with the wheel driving."""

from dataclasses import replace

from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair


def standard_gear(teeth: int = 17, width: float = 4.0, *, helix: float = 0.0, **changes: float) -> Gear:
    """Gear of the standard basic rack with module 1; ``changes`` are keys of ``Gear`` [mm, degrees, normal modules]."""
    rack = {"normal_module": 1.0, "pressure_angle": 20.0, "addendum": 1.0, "dedendum": 1.25, "fillet_radius": 0.38}
    return Gear(teeth=teeth, face_width=width, helix_angle=helix, **{"profile_shift": 0.0} | rack | changes)


def swapped(pair: Pair) -> Pair:
    """The same pair with the wheel driving: pinion and wheel exchanged."""
    exchanged = replace(pair, pinion=pair.wheel, wheel=pair.pinion)
    if pair.temperature is None:
        return exchanged
    temperature = replace(pair.temperature, pinion=pair.temperature.wheel, wheel=pair.temperature.pinion)
    return replace(exchanged, temperature=temperature)
