"""Compliance of the teeth from three-dimensional finite elements, in place of the fast models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import LowRank, ToothCompliance
from gearbench.effects.solids import require_bores
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.material import STRICT, Material
from gearbench.geometry.pair import Pair

if TYPE_CHECKING:
    from fem_reference.compliance import FlankCompliance
    from fem_reference.section import Body

#: Effects whose compliance the finite elements contain: of a tooth, and of the body below it with support = "rim".
TOOTH_EFFECT, BODY_EFFECTS = "tooth_bending", ("tooth_foundation", "neighbour_teeth")


@dataclass(frozen=True, kw_only=True, config=STRICT)
class FeCompliance(ToothCompliance):
    """Compliance of both gears by finite elements; computed once for a macro-geometry and kept on disk.

    Parameters
    ----------
    support
        "clamped": one tooth, held along its root circle. "rim": a sector of several teeth on the gear body down to the
        bore, which needs ``bore_diameter`` of both gears; teeth in contact then move each other.
    accuracy
        Relative error of the compliance that the mesh is refined to.
    teeth
        Teeth of the sector, odd; the rest of the body is there without its teeth. Only with support = "rim".
    """

    support: Literal["clamped", "rim"] = "clamped"
    accuracy: Annotated[float, Field(ge=1e-4, le=0.1)] = 0.01
    teeth: Annotated[int, Field(ge=1, le=101)] | None = None

    name: ClassVar[str] = "fe_compliance"
    summary: ClassVar[str] = "compliance: both gears by three-dimensional finite elements"
    source: ClassVar[str] = "fem_reference: linear elasticity, 20-node hexahedra, Richardson's extrapolation"
    use: ClassVar[str] = "As a reference for the fast tooth models, or where one macro-geometry is studied for long."
    example: ClassVar[dict[str, Any]] = {"support": "clamped", "accuracy": 0.01}
    requires: ClassVar[dict[str, str]] = {"hertz": "the finite elements leave the compression of the flanks to it"}

    def __post_init__(self) -> None:
        if self.teeth is None:
            return
        if self.support == "clamped":
            raise InputError("teeth", self.teeth, 'belongs to support = "rim"')
        if self.teeth % 2 == 0:
            raise InputError("teeth", self.teeth, "must be odd: as many neighbours on either side")

    def check(self, pair: Pair) -> None:
        """Refuse a rim without bore."""
        if self.support == "rim":
            require_bores(pair)

    def preparation(self, pair: Pair) -> float:
        """Predicted time [s] of the finite elements that are not kept on disk yet; good to a factor of three."""
        from fem_reference.cache import entry

        missing = sum(not entry(self.body(pair, k), pair.material, self.accuracy).exists() for k in range(2))
        return missing * _SECONDS[self.support] * (0.01 / self.accuracy) ** 0.5

    def compliance(self, lines: ContactLines) -> LowRank:
        """Factor of both gears side by side, (position, pair, segment, rank); shared by all pairs on a rim."""
        flanks = [self.flank(lines.pair, k) for k in range(2)]
        return side_by_side(flanks, lines, coupled=self.support == "rim")

    def tooth_factor(self, pair: Pair, k: int, height: NDArray, y: NDArray) -> NDArray:
        """Ψ of one tooth, with the body below it where there is one; see ``ToothCompliance``."""
        return self.flank(pair, k).factor(height, y)

    def flank(self, pair: Pair, k: int) -> FlankCompliance:
        """Compliance of the flank of pinion (k = 0) or wheel (k = 1)."""
        found = _flank(self.body(pair, k), pair.material, self.accuracy)
        return replace(found, driven=True) if k else found

    def body(self, pair: Pair, k: int) -> Body:
        """What is meshed of pinion (k = 0) or wheel (k = 1)."""
        from fem_reference.section import Body

        gear, bore = pair.gears[k], (pair.pinion, pair.wheel)[k].bore_diameter
        if self.support == "clamped" or bore is None:
            return Body(gear=gear)
        teeth = min(self.teeth or default_teeth(pair), gear.teeth - 2 - (gear.teeth + 1) % 2)
        return Body(gear=gear, bore_radius=bore / 2, teeth=teeth)


def side_by_side(flanks: Sequence[FlankCompliance], lines: ContactLines, *, coupled: bool) -> LowRank:
    """Compliance of the flanks of pinion and wheel on ``lines``, shared by all pairs where they are ``coupled``."""
    parts = []
    for k, (gear, found) in enumerate(zip(lines.pair.gears, flanks, strict=True)):
        shapes = found.shapes(lines.radii[k] - gear.root_radius, lines.y)
        parts.append(shapes @ found.root(lines.shape[1] if coupled else 1))
    return LowRank(factor=np.concatenate(parts, axis=-1), coupled=coupled)


#: Time of one gear at 1 % on two cores [s].
_SECONDS = {"clamped": 2.5, "rim": 10.0}


def default_teeth(pair: Pair) -> int:
    """Teeth of the sector: those in contact at a time, and one more on either side."""
    return 3 + 2 * int(np.ceil((pair.transverse_contact_ratio + pair.overlap_ratio) / 2))


@lru_cache(maxsize=64)
def _flank(body: Body, material: Material, accuracy: float) -> FlankCompliance:
    from fem_reference.cache import cached_compliance

    return cached_compliance(body, material, accuracy)
