"""Compliance of the gear body, which couples the teeth."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Dense, Effects, FlankPair, LowRank, ToothCompliance, refuse_foreign_keys
from gearbench.effects.teeth import (
    fe_between,
    fe_body,
    for_both_gears,
    require_bores,
    ring_between,
    ring_flank,
    tooth_among,
    web_of,
)
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class GearBody(ToothCompliance):
    """Elastic gear bodies below the teeth, held at their bores. Both gears need ``bore_diameter``.

    A body is as wide as the face, or a rim on a web (``rim_thickness``, ``web_thickness``). An internal gear is held at
    its ``outer_diameter`` or by the springs of its ``support``. With finite elements of the teeth, they cover
    the whole gear down to the bore, and this table has no keys.

    Parameters
    ----------
    model
        "ring": elastic ring joined to solid teeth along their roots. "sainsot_velex": closed form of Sainsot, Velex,
        Duverger (2004) for an even load; refused outside the range of its fit.
    coupled
        Ring only. Whether a loaded tooth also moves its neighbours.
    """

    model: Literal["ring", "sainsot_velex"] = "ring"
    coupled: bool = True

    name: ClassVar[str] = "gear_body"
    summary: ClassVar[str] = "compliance: gear bodies, which couple the teeth"
    source: ClassVar[str] = "elastic ring with solid teeth, Fourier and Ritz; Sainsot, Velex & Duverger 2004"
    use: ClassVar[str] = "For real gears: about half of the deflection lies below the teeth."
    example: ClassVar[dict[str, Any]] = {"model": "ring"}
    requires: ClassVar[dict[str, str]] = {"hertz": "the load distribution needs a contact law"}

    def __post_init__(self) -> None:
        refuse_foreign_keys(self, {"coupled": ("ring",)})

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse gears without bore or outside the range of the closed form, and keys that finite elements ignore."""
        bores, webs = require_bores(pair), [web_of(pair, index, False) for index in (0, 1)]
        if _by_finite_elements(effects) and self != GearBody():
            # a table of the model "ring" that is not the default has coupled = false
            key, value = ("coupled", False) if self.model == "ring" else ("model", self.model)
            raise InputError(key, value, "belongs to a plate or solid tooth: finite elements cover the whole body")
        order = _joint_order(effects)
        if order and order[0] < 2 and self.model == "ring":
            allowed = "a ring needs at least 2 functions across the tooth thickness"
            raise InputError("", f"effects.tooth_bending.order = {list(order)}", allowed)
        if self.model == "sainsot_velex":
            if pair.is_internal:
                raise InputError("model", self.model, 'supports external gears only: use model = "ring"')
            if any(web is not None for web in webs):
                raise InputError("model", self.model, 'does not support webs (rim_thickness): use model = "ring"')
            from gearbench.compliance.sainsot_velex import shape_factors

            for name, gear, bore in zip(("pinion", "wheel"), pair.gears, bores, strict=True):
                try:
                    shape_factors(gear, bore / 2)
                except InputError as error:
                    raise InputError("model", self.model, f"pair.{name}: {error.allowed}") from None

    def compliance(self, lines: ContactLines, effects: Effects) -> LowRank | Dense:
        """Factor of both gears side by side, (position, pair, segment, rank); a matrix if tooth pairs are coupled.

        Equation (R8) of docs/theory.md.
        """
        flanks = self.flank_compliances(lines, effects)
        return self.both_teeth(lines, effects) if flanks is None else flanks.on(lines)

    def flank_compliances(self, lines: ContactLines, effects: Effects) -> FlankPair | None:
        """Compliance of both flanks; None unless the bodies are rings."""
        if self.model != "ring" or _by_finite_elements(effects):
            return None
        neighbours = lines.shape[1] - 1 if self.coupled else 0
        order = _joint_order(effects)
        pinion, wheel = for_both_gears(ring_flank, lines.pair, order, neighbours, lines.coast)
        return FlankPair(both=(pinion, wheel), coupled=self.coupled)

    def between(self, pair: Pair, index: int, effects: Effects, *, coast: bool, across: bool) -> NDArray:
        """C_d of a body, (d, function, function) [mm/N], d = −z/2 … z/2: motion of tooth d under loads on tooth 0.

        It is (R7) of docs/theory.md. Normal and y are those of a flank of a driving gear. With ``across``, right flanks
        move under loads on left flanks, which have normal and y of a driven gear, as on a planet or an idler.
        """
        if (tooth := tooth_among(effects)) is not None and tooth.by_finite_elements:
            body, flank = fe_body(pair, index, on_body=True, coast=coast), tooth.flank(pair, index, effects, coast)
            return fe_between(body, pair.materials[index], flank.attrs["level"], across)
        return ring_between(pair, index, _joint_order(effects), coast, across)

    def shapes(self, lines: ContactLines, index: int, effects: Effects) -> NDArray:
        """Functions of ``between`` at the segments of ``lines``, (position, pair, segment, function) [1/mm]."""
        if (tooth := tooth_among(effects)) is not None and tooth.by_finite_elements:
            flank = tooth.flank(lines.pair, index, effects, lines.coast)
        else:
            flank = ring_flank(lines.pair, index, _joint_order(effects), 0, lines.coast)
        return flank.shapes(lines.radii[index] - flank.gear.root_radius, lines.gear_y(index))

    def tooth_factor(self, pair: Pair, index: int, height: NDArray, y: NDArray, effects: Effects) -> NDArray:
        """Ψ of a single tooth; with finite elements the tooth contains the body, and Ψ has rank 0."""
        if _by_finite_elements(effects):
            return np.empty((*np.broadcast_shapes(np.shape(height), np.shape(y)), 0))
        if self.model == "ring":
            return ring_flank(pair, index, _joint_order(effects), 0).factor(height, y)
        from gearbench.compliance.sainsot_velex import foundation_factor

        gear, bore = pair.gears[index], require_bores(pair)[index]
        return foundation_factor(gear, pair.materials[index].E, bore / 2, gear.root_radius + height)[..., None]


def _by_finite_elements(effects: Effects) -> bool:
    """Whether finite elements model teeth and bodies together."""
    tooth = tooth_among(effects)
    return tooth is not None and tooth.by_finite_elements


def _joint_order(effects: Effects) -> tuple[int, int, int] | None:
    """Numbers of functions of the solid teeth that the ring is joined to; None is their default."""
    tooth = tooth_among(effects)
    return None if tooth is None else tooth.solid_order
