"""Compliances of teeth and gear bodies for the effects ``tooth_bending`` and ``gear_body``.

They depend neither on errors nor on load and are therefore cached.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.base import Effects, ToothCompliance
from gearbench.errors import InputError
from gearbench.geometry.blank import blank_of
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.geometry.web import Web, make_web
from gearbench.threads import default_threads

if TYPE_CHECKING:
    from fem_reference.section import Body
    from gearbench.compliance.flank import FlankCompliance
    from gearbench.compliance.gear_body import ToothedRing
    from gearbench.compliance.lugs import Lugs
    from gearbench.compliance.plate import PlateTooth
    from gearbench.compliance.solid_tooth import SolidTooth


@dataclass(frozen=True)
class Tooth(ToothCompliance):
    """Base class of the effect ``tooth_bending``, with what the effect ``gear_body`` must know of the teeth."""

    @property
    @abstractmethod
    def by_finite_elements(self) -> bool:
        """Whether teeth and bodies are divided into finite elements."""

    @property
    @abstractmethod
    def solid_order(self) -> tuple[int, int, int] | None:
        """Numbers of functions of the solid teeth on a ring; None for the default, ``teeth.solid_order``."""

    @abstractmethod
    def flank(self, pair: Pair, index: int, effects: Effects, coast: bool = False) -> FlankCompliance:
        """Compliance of the flank of pinion (``index`` 0) or wheel (1), as a solid or by finite elements.

        ``coast`` selects the coast flank, which differs if the body is not symmetric, for example with an offset web.
        """


def tooth_among(effects: Effects) -> Tooth | None:
    """The effect of the teeth among the effects of a scene; None without one."""
    return next((effect for effect in effects.values() if isinstance(effect, Tooth)), None)


@lru_cache(maxsize=256)
def plate_tooth(gear: Gear, material: Material, order: tuple[int, int] | None, fillet: bool) -> PlateTooth:
    """Plate that models the tooth of a gear."""
    from gearbench.compliance.plate import PlateTooth

    # the thickness varies like (R − r_b)^{3/2} at the base circle and, on a fillet, like √(R − r_f) at the root circle
    base, junction = gear.base_radius - gear.root_radius, gear.form_radius - gear.root_radius
    return PlateTooth(
        height=gear.tooth_height,
        width=gear.face_width,
        thickness=lambda x: gear.normal_thickness(gear.root_radius + np.asarray(x), fillet=fillet),
        E=material.E,
        nu=material.nu,
        basis=order or "paper",
        breaks=(junction, base) if fillet else (base,),
        branches=(0.0, max(base, 0.0)) if fillet else (base,),
    )


#: Helix angle [°] above which solid teeth need more functions. Without them, peak-to-peak values of the STE and
#: stiffness of steeper gears in ``studies/s11_gears_in_use`` are up to 7 % off.
STEEP = 27.0
#: Height of the fillet, as a share of the tooth height, above which solid teeth need more functions too: gears of few
#: teeth, nearly undercut.
HIGH_FILLET = 0.27


def solid_order(gear: Gear) -> tuple[int, int, int]:
    """Default numbers of functions of a solid tooth: across its thickness, along its height, over its face.

    The number over the face follows from the shortest wave of the load over the face that still bends the tooth:
    shorter ones only compress it.
    Along the height two families of functions meet at the form circle. Steep helices, high fillets and wide faces need
    more functions.
    """
    from gearbench.compliance.local import waves_across
    from gearbench.compliance.section import JOINTED
    from gearbench.compliance.solid_tooth import WIDE

    steep, wide = gear.helix_angle > STEEP, gear.face_width > WIDE * gear.normal_module
    high = gear.form_radius - gear.root_radius > HIGH_FILLET * gear.tooth_height
    return 8 if steep else 7 if high else 6, JOINTED, waves_across(gear) + (4 if steep or wide else 1)


@lru_cache(maxsize=256)
def solid_tooth(gear: Gear, material: Material, order: tuple[int, int, int] | None, rooted: bool = False) -> SolidTooth:
    """Solid tooth with the loaded flank of a driving gear; ``rooted`` if the tooth stands on a ring.

    ``FlankCompliance.driven`` mirrors it for the driven gear.
    """
    from gearbench.compliance.solid_tooth import SolidTooth

    return SolidTooth(gear=gear, E=material.E, nu=material.nu, order=order or solid_order(gear), rooted=rooted)


@lru_cache(maxsize=256)
def solid_flank(pair: Pair, index: int, order: tuple[int, int, int] | None, rooted: bool) -> FlankCompliance:
    """Compliance of the solid teeth of pinion (``index`` 0) or wheel (1)."""
    flank = solid_tooth(pair.gears[index], pair.materials[index], order, rooted).flank
    return replace(flank, driven=index == 1)


def toothed_ring(pair: Pair, index: int, order: tuple[int, int, int] | None, coast: bool = False) -> ToothedRing:
    """Body of pinion (``index`` 0) or wheel (1) with solid teeth, a ring or a rim with web and hub.

    Its loaded flanks are those of a driving gear, see ``solid_tooth``.
    """
    support = require_bores(pair)[index] / 2, *support_of(pair, index, coast)
    return _toothed_ring(pair.gears[index], pair.materials[index], order, support, web_of(pair, index, coast))


@lru_cache(maxsize=256)
def _toothed_ring(
    gear: Gear,
    material: Material,
    order: tuple[int, int, int] | None,
    support: tuple[float, tuple[float, float] | None, Lugs | None],
    web: Web | None,
) -> ToothedRing:
    from gearbench.compliance.gear_body import ToothedRing

    bore_radius, springs, lugs = support
    tooth = solid_tooth(gear, material, order, True)
    return ToothedRing(tooth=tooth, bore_radius=bore_radius, web=web, support=springs, lugs=lugs)


@lru_cache(maxsize=256)
def ring_flank(
    pair: Pair, index: int, order: tuple[int, int, int] | None, neighbours: int, coast: bool = False
) -> FlankCompliance:
    """Compliance that the body of pinion (``index`` 0) or wheel (1) adds, see ``ToothedRing.flank``.

    ``neighbours`` is the number of teeth on either side that a loaded tooth moves.

    Raises
    ------
    InputError
        If the body is so much more compliant than its teeth that rounding dominates.
    """
    # a symmetric body is the same for drive and coast flanks
    web, (_, lugs) = web_of(pair, index, False), support_of(pair, index)
    coast = coast and (lugs is not None or (web is not None and web != web.mirrored(pair.gears[index].face_width)))
    try:
        return placed_in_mesh(toothed_ring(pair, index, order, coast).flank(neighbours), pair, index, coast)
    except np.linalg.LinAlgError:
        reason = f"body of the {GEARS[index]} is too compliant to compute: bore too large, or rim or web too thin"
        raise InputError("effects.gear_body.model", "ring", reason) from None


@lru_cache(maxsize=64)
def ring_between(pair: Pair, index: int, order: tuple[int, int, int] | None, coast: bool, across: bool) -> NDArray:
    """Compliance of a body between teeth d apart, (d, function, function) [mm/N], see ``ToothedRing.blocks``.

    With ``across`` they are the deflections of right flanks under loads on left flanks.
    """
    half = abs(pair.gears[index].teeth) // 2
    body = toothed_ring(pair, index, order, coast)
    if not across:
        return body.blocks(half)
    both = replace(body, both_flanks=True).blocks(half)
    count = both.shape[1] // 2
    return np.ascontiguousarray(both[:, :count, count:])


@lru_cache(maxsize=64)
def fe_flank(body: Body, material: Material, accuracy: float) -> FlankCompliance:
    """Compliance of a body by finite elements, cached on disk as well."""
    from fem_reference.cache import cached_compliance

    return cached_compliance(body, material, accuracy)


@lru_cache(maxsize=64)
def fe_between(body: Body, material: Material, level: int, across: bool) -> NDArray:
    """``ring_between`` by finite elements of a ``level``, cached on disk as well."""
    from fem_reference.cache import cached_between

    return cached_between(body, material, level, across=across).blocks


@lru_cache(maxsize=256)
def for_both_gears(flank: Callable[..., FlankCompliance], pair: Pair, *options: object) -> tuple[FlankCompliance, ...]:
    """Call ``flank`` (pair, index, …) for both gears, on two threads if there are two processors.

    Threads help because kernels and matrix products release the interpreter lock. Equal gears share one cached tooth,
    so they are computed one after the other.
    """
    equal = pair.gears[0] == pair.gears[1] and pair.materials[0] == pair.materials[1]
    if equal or default_threads() == 1:
        return tuple(flank(pair, index, *options) for index in (0, 1))
    with ThreadPoolExecutor(2) as pool:
        return tuple(pool.map(lambda index: flank(pair, index, *options), (0, 1)))


def clear_tooth_cache() -> None:
    """Clear the caches of plates, solid teeth and rings, to time their construction or to free memory."""
    from gearbench.compliance.flank import joined
    from gearbench.compliance.gear_body import rim_harmonics

    for cached in (
        plate_tooth,
        solid_tooth,
        solid_flank,
        _toothed_ring,
        ring_flank,
        for_both_gears,
        rim_harmonics,
        joined,
    ):
        cached.cache_clear()


def fe_body(pair: Pair, index: int, *, on_body: bool, coast: bool = False) -> Body:
    """Part of a gear that finite elements cover: a clamped tooth, or with ``on_body`` the whole gear.

    Meshes of a section (``fem_reference.plane``) have teeth on one sector only: all teeth in contact at a time, and one
    more on either side.
    """
    from fem_reference.section import Body

    gear = pair.gears[index]
    if not on_body:
        return Body(gear=gear)
    # an odd number with the loaded tooth in the middle; at least two teeth of the gear are left out
    wanted = 3 + 2 * int(np.ceil((pair.meshing.transverse_contact_ratio + pair.meshing.overlap_ratio) / 2))
    most = abs(gear.teeth) - 2 - (abs(gear.teeth) + 1) % 2
    web = web_of(pair, index, coast)
    bore, (support, lugs) = require_bores(pair)[index] / 2, support_of(pair, index, coast)
    return Body(gear=gear, bore_radius=bore, web=web, teeth=min(wanted, most), support=support, lugs=lugs)


def support_of(pair: Pair, index: int, coast: bool = False) -> tuple[tuple[float, float] | None, Lugs | None]:
    """Support of a body: springs along its edge, radial and tangential [N/mm³], and lugs.

    The springs are None if the body is clamped, and both are 0 if lugs hold it. Long lugs are divided into short ones.
    Angles of lugs are those of a driving gear; they are mirrored for a driven gear, and once more for coast flanks.
    """
    support = pair.members[index].support
    springs = None if support is None else support.per_area(pair.gears[index].face_width)
    if support is None or not support.lugs:
        return springs, None
    from gearbench.compliance.lugs import LONGEST, Lugs

    # the diameter of an internal gear is negative
    outside, gear = -require_bores(pair)[index] / 2, pair.gears[index]
    angles = tuple(_side(index, coast) * math.radians(angle) for angle in support.lugs)
    lugs = Lugs(angles=angles, length=support.lug_length or 0.0, springs=springs)
    return (0.0, 0.0), lugs.parted(outside, LONGEST * max(outside + gear.root_radius, gear.normal_module))


def placed_in_mesh(flank: FlankCompliance, pair: Pair, index: int, coast: bool) -> FlankCompliance:
    """The compliance as it is in the mesh: driven or not, and with the tooth that belongs to tooth pair 0."""
    support, anchors = pair.members[index].support, flank.anchors
    if support is not None and anchors is not None:
        anchors = anchors.turned(_side(index, coast) * support.tooth)
    return replace(flank, driven=index == 1, anchors=anchors)


def _side(index: int, coast: bool) -> int:
    """−1 if the gear is mirrored (driven gear or coast flanks, but not both), otherwise 1."""
    return 1 if (index == 0) != coast else -1


def web_of(pair: Pair, index: int, coast: bool) -> Web | None:
    """Web of pinion (``index`` 0) or wheel (1), as on a driving gear; None without a web.

    The web is mirrored for a driven gear, and once more for ``coast`` flanks.
    """
    member, gear = pair.members[index], pair.gears[index]
    if member.rim_thickness is None or member.web_thickness is None:
        return None
    bore = require_bores(pair)[index]
    try:
        web = make_web(gear, bore, member.rim_thickness, member.web_thickness, member.web_offset, member.hub_diameter)
    except InputError as error:
        raise InputError("", f"pair.{GEARS[index]}.{error.key} = {error.value:.6g}", error.allowed) from None
    return web.mirrored(gear.face_width) if _side(index, coast) < 0 else web


def require_bores(pair: Pair) -> tuple[float, float]:
    """Diameters [mm] at which pinion and wheel are held: the bore, or minus the outside diameter of an internal gear.

    Raises
    ------
    InputError
        If a diameter is missing.
    """
    diameters = []
    for name, member, gear in zip(("pinion", "wheel"), (pair.pinion, pair.wheel), pair.gears, strict=True):
        key = "bore_diameter" if gear.teeth > 0 else "outer_diameter"
        if (diameter := getattr(member, key)) is None:
            raise InputError("", "given", f"needs pair.{name}.{key}, where the body is held")
        diameters.append(2 * blank_of(gear.blank).support(gear, diameter))
    return diameters[0], diameters[1]
