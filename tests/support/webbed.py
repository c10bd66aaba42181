"""A gear with rim, web and hub."""

from fem_reference.section import Body
from gearbench.geometry.web import make_web
from tests.support.gears import standard_gear


def webbed(teeth: int, width: float, helix: float, offset: float, hub: float | None = 0.55) -> Body:
    """Rim of two modules, web of a third of the face, bore of 0.35 root radii."""
    gear = standard_gear(teeth, width, helix=helix)
    r_f = gear.root_radius
    web = make_web(gear, 0.7 * r_f, 2.0, width / 3, offset, None if hub is None else 2 * hub * r_f)
    return Body(gear=gear, bore_radius=0.35 * r_f, web=web, teeth=5)
