"""Gears for tests: the standard one, and what a test changes of it."""

from gearbench.geometry.gear import Gear


def standard_gear(
    teeth: int = 17,
    width: float = 4.0,
    *,
    module: float = 1.0,
    helix: float = 0.0,
    shift: float = 0.0,
    fillet: float = 0.38,
    addendum: float = 1.0,
    dedendum: float = 1.25,
    pressure_angle: float = 20.0,
) -> Gear:
    """Gear of the standard basic rack; mm, degrees, normal modules."""
    return Gear(
        teeth=teeth,
        normal_module=module,
        pressure_angle=pressure_angle,
        helix_angle=helix,
        face_width=width,
        profile_shift=shift,
        addendum=addendum,
        dedendum=dedendum,
        fillet_radius=fillet,
    )
