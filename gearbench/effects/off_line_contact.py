"""Contact off the line of action: before and after the path of contact, and at tips."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import GapEffect
from gearbench.geometry.action import ContactLines
from gearbench.geometry.material import STRICT
from gearbench.geometry.separation import separation

#: Upper limit of the gap, in base radii; flanks so far apart never touch.
_APART = 0.1


@dataclass(frozen=True, kw_only=True, config=STRICT)
class OffLineContact(GapEffect):
    """Exact kinematic separation of the flanks, tips included, for all pairs that may touch under load.

    Without this effect contact lies on the line of action and ends with the path of contact. Profile modifications are
    part of the separation; shapes that vary over the face are added. At tip edges and at the start of reliefs the
    contact law is softer (E4, E5 of docs/theory.md).
    """

    of_flank: ClassVar[bool] = False
    name: ClassVar[str] = "off_line_contact"
    summary: ClassVar[str] = "gap: exact separation of the flanks, also before and after the path of contact"
    source: ClassVar[str] = "kinematics of involute and edge; elastic wedge"
    use: ClassVar[str] = "Always, except to compare with models that keep contact on the line of action."
    example: ClassVar[dict[str, Any]] = {}
    requires: ClassVar[dict[str, str]] = {"hertz": "pairs that begin to touch need a contact law"}

    def gap(self, lines: ContactLines) -> NDArray:
        """Separation normal to the flank, (position, pair, segment) [mm].

        That of ``lines`` or, if they have no separation, that of the unmodified profiles.
        """
        touch = lines.touch or separation(lines.pair)(lines.u)
        far = _APART * min(abs(gear.base_radius) for gear in lines.pair.gears)
        # touch.gap is the rotation that closes the gap times the base radius; the gap itself has the lever arm instead
        return np.minimum(touch.gap, far) * math.cos(lines.pair.meshing.beta_b) * touch.levers[0]
