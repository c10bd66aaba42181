"""Random pairs of a pinion and a ring: teeth, rims and supports of the ring."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.support import Support
from gearbench.scene import Load, Scene
from studies.s05_tooth_models.pairs import between, pair_at_its_shifts

#: Supports of the ring's outside.
SUPPORTS = ("held", "springs", "lugs", "free")
#: Thinnest and thickest rim of a ring [modules].
RIMS = (1.2, 6.0)
_MODULE = 2.0


def internal(u: NDArray) -> Scene:
    """Scene of twelve numbers in [0, 1): z 15–60 in 30–180, β 0–30° (0 in half of them), α 20–25°, b/m 3–15.

    Rims of the ring are ``RIMS``, with uniform logarithms; a quarter of the rings has each of the ``SUPPORTS``. The
    size of a pair does not matter: the module is 2 mm.
    """
    teeth = round(between(u[0], 15, 60, 1))
    ring = round(between(u[1], max(30, teeth + 10), 180, 1))
    helix = 0.0 if u[2] < 0.5 else round(5 + 25 * (2 * u[2] - 1), 1)
    shifts = round(-0.1 + 0.6 * u[4], 2), round(-0.4 + 0.8 * u[5], 2)
    width = round(_MODULE * between(u[7], 3.0, 15.0, 2), 1)
    plain = pair_at_its_shifts(
        _MODULE, (teeth, -ring), helix, round(20 + 5 * u[3], 1), shifts, round(0.7 + 0.3 * u[6], 2), width
    )
    own, outer = plain.gears
    rim = _MODULE * between(u[9], *RIMS, 3)
    bore = 2 * (own.root_radius - between(u[8], 1.5 * _MODULE, 0.9 * own.root_radius, 3))
    outside = round(2 * (abs(outer.root_radius) + rim), 2)
    wheel = replace(plain.wheel, outer_diameter=outside, support=_support(u[11], outside, rim))
    torque = (10 + 50 * u[10]) * _MODULE**2 * width * teeth / 2e3
    return Scene(
        pair=replace(plain, pinion=replace(plain.pinion, bore_diameter=round(bore, 2)), wheel=wheel),
        load=Load(torque=float(f"{torque:.3g}")),
        effects=(ToothBending(model="solid"), GearBody(), Hertz(), OffLineContact()),
    )


def support_of(scene: Scene) -> str:
    """Support of the ring of a scene, one of ``SUPPORTS``."""
    found = scene.pair.wheel.support
    if found is None:
        return "held"
    return "lugs" if found.lugs else "springs" if found.radial else "free"


def _support(u: float, outside: float, rim: float) -> Support | None:
    """Support from one number: its kind, and its stiffness, or the number of its lugs."""
    kind, share = SUPPORTS[int(4 * u)], 4 * u % 1
    if kind == "held":
        return None
    if kind == "free":
        return Support(radial=0.0, tangential=0.0)
    if kind == "springs":
        stiffness = between(share, 10.0, 1e4, 2)
        return Support(radial=stiffness, tangential=2 * stiffness)
    count = 3 + int(6 * share)
    sizes: dict[str, Any] = {"lug_length": round(min(2 * rim, math.pi * outside / count / 2), 2)}
    return Support(lugs=tuple(np.round(360 / count * (np.arange(count) + share), 2).tolist()), **sizes)
