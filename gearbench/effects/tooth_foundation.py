"""Compliance of the gear body below the loaded tooth itself."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import LowRank, ToothCompliance
from gearbench.effects.solids import SolidOrder, gear_body, require_bores
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.material import STRICT
from gearbench.geometry.pair import Pair


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ToothFoundation(ToothCompliance):
    """What the gear body adds to the deflection of the tooth that is loaded. Needs ``bore_diameter`` of both gears.

    Parameters
    ----------
    model
        "ring": the body as an elastic ring, held at the bore, joined to a solid tooth along its root.
        "sainsot_velex": closed form of Sainsot, Velex, Duverger (2004) for the load spread evenly over the face width;
        refused outside the range it was fitted on.
    order
        Ring only: functions of the solid tooth, [thickness, height, face width], by default 6, 7 and about one
        for each module of face width.
    """

    model: Literal["ring", "sainsot_velex"] = "ring"
    order: SolidOrder | None = None

    name: ClassVar[str] = "tooth_foundation"
    summary: ClassVar[str] = "compliance: the gear body below each tooth"
    source: ClassVar[str] = "elastic ring, Fourier and Ritz; Sainsot, Velex & Duverger 2004"
    use: ClassVar[str] = "Where deflections are to be those of real gears: a good part of them lies below the teeth."
    example: ClassVar[dict[str, Any]] = {"model": "ring"}
    requires: ClassVar[dict[str, str]] = {"hertz": "the body alone does not determine the distribution of the load"}
    conflicts: ClassVar[dict[str, str]] = {
        "fe_compliance": "which has a gear body of its own",
        "neighbour_teeth": "which contains it",
    }

    def __post_init__(self) -> None:
        if self.model != "ring" and self.order is not None:
            raise InputError("order", list(self.order), 'belongs to model = "ring"')

    def check(self, pair: Pair) -> None:
        """Refuse gears without bore, and for the closed form gears outside its range."""
        bores = require_bores(pair)
        if self.model == "sainsot_velex":
            from gearbench.compliance.sainsot_velex import shape_factors

            for name, gear, bore in zip(("pinion", "wheel"), pair.gears, bores, strict=True):
                try:
                    shape_factors(gear, bore / 2)
                except InputError as error:
                    raise InputError("model", self.model, f"pair.{name}: {error.allowed}") from None

    def compliance(self, lines: ContactLines) -> LowRank:
        """Factor of both gears side by side, (position, pair, segment, rank)."""
        return self.both_teeth(lines)

    def tooth_factor(self, pair: Pair, k: int, height: NDArray, y: NDArray) -> NDArray:
        """Ψ of one tooth; see ``ToothCompliance``."""
        if self.model == "ring":
            return gear_body(pair, k, self.order).factor(height, y)
        from gearbench.compliance.sainsot_velex import foundation_factor

        gear, bore = pair.gears[k], require_bores(pair)[k]
        return foundation_factor(gear, pair.material.E, bore / 2, gear.root_radius + height)[..., None]
