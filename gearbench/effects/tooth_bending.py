"""Bending and shear of the teeth: the tooth models."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Dense, Effects, FlankPair, LowRank, refuse_foreign_keys
from gearbench.effects.teeth import Tooth, fe_body, fe_flank, for_both_gears, placed_in_mesh, plate_tooth, solid_flank
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT

if TYPE_CHECKING:
    from fem_reference.refinement import Level
    from fem_reference.section import Body
    from gearbench.compliance.flank import FlankCompliance

Order = Annotated[tuple[Annotated[int, Field(ge=1, le=40)], ...], Field(min_length=2, max_length=3)]

#: Directions counted by ``order``, for each model.
_DIRECTIONS = {"plate": ("height", "face width"), "solid": ("thickness", "height", "face width")}


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ToothBending(Tooth):
    """Tooth clamped at its root: plate or solid by the Ritz method, or finite elements.

    The effect gear_body adds the body below the root.

    Parameters
    ----------
    model
        "plate": Reissner–Mindlin plate of variable thickness. "solid": three-dimensional elasticity on the exact
        section with its fillet. "finite_elements": the same by finite elements, computed once for a macro-geometry and
        kept on disk.
    basis
        Plate only. "paper": 9 unknowns, x(a + by + cx) for the deflection and both rotations at height x and position y
        along the face. The default without ``order``.
    order
        Numbers of functions. Plate: (height, face width), instead of ``basis``. Solid: (thickness, height, face width),
        by default 6 to 8 over the thickness, 9 over the height and about one for each module of face width.
    fillet
        Plate only. Whether the thickness includes the root fillet; otherwise it is constant below the base circle.
    load
        Plate only. "full": the whole normal force bends the plate, as in Garambois et al. (2017). "component": only its
        component normal to the mid-plane does.
    accuracy
        Finite elements only. Relative error of the compliance.
    """

    model: Literal["plate", "solid", "finite_elements"] = "plate"
    basis: Literal["paper"] | None = None
    order: Order | None = None
    fillet: bool = False
    load: Literal["full", "component"] = "full"
    accuracy: Annotated[float, Field(ge=1e-4, le=0.1)] = 0.01

    name: ClassVar[str] = "tooth_bending"
    summary: ClassVar[str] = "compliance: bending and shear of both teeth, clamped at the root"
    source: ClassVar[str] = "Plate of Garambois et al. 2017; finite elements of high degree"
    use: ClassVar[str] = (
        "Always: the solid for results to trust, the plate to compare with Garambois et al., "
        "finite elements as the reference."
    )
    example: ClassVar[dict[str, Any]] = {"model": "solid"}
    requires: ClassVar[dict[str, str]] = {"hertz": "the load distribution needs a contact law"}

    def __post_init__(self) -> None:
        plate, by_finite_elements = ("plate",), ("finite_elements",)
        models = {"order": ("plate", "solid"), "basis": plate, "fillet": plate, "load": plate}
        refuse_foreign_keys(self, {**models, "accuracy": by_finite_elements})
        if self.basis is not None and self.order is not None:
            raise InputError("order", list(self.order), 'conflicts with basis = "paper": give one of the two')
        if self.order is not None and len(self.order) != len(_DIRECTIONS[self.model]):
            count = {2: "two", 3: "three"}[len(_DIRECTIONS[self.model])]
            names = f"{count} numbers for the {self.model}, [{', '.join(_DIRECTIONS[self.model])}]"
            raise InputError("order", list(self.order), f"must be {names}")

    @property
    def by_finite_elements(self) -> bool:
        """Whether teeth and bodies are divided into finite elements."""
        return self.model == "finite_elements"

    @property
    def solid_order(self) -> tuple[int, int, int] | None:
        """Order of solid teeth; None for the default."""
        return self.order if self.model == "solid" else None  # type: ignore[return-value]

    def missing_levels(self, pair: Pair, effects: Effects) -> list[Level]:
        """Refinements (``fem_reference.refinement``) that finite elements of both gears need and that are not on disk.

        Raises
        ------
        AccuracyError, MemoryBudgetError
            If the memory of the machine does not allow the accuracy.
        """
        if not self.by_finite_elements:
            return []
        from fem_reference.cache import entry
        from fem_reference.refinement import levels

        bodies = [(self.body(pair, index, effects), pair.materials[index]) for index in (0, 1)]
        missing = [body for body, material in bodies if not entry(body, material, self.accuracy).exists()]
        return [level for body in missing for level in levels(body, self.accuracy)]

    def compliance(self, lines: ContactLines, effects: Effects) -> LowRank | Dense:
        """Factor of both teeth, (position, pair, segment, rank); a matrix if finite elements cover the bodies too."""
        flanks = self.flank_compliances(lines, effects)
        return self.both_teeth(lines, effects) if flanks is None else flanks.on(lines)

    def flank_compliances(self, lines: ContactLines, effects: Effects) -> FlankPair | None:
        """Compliance of both flanks; None for plates."""
        if self.model == "plate":
            return None
        if self.model == "solid":
            pinion, wheel = for_both_gears(solid_flank, lines.pair, self.solid_order, _on_ring(effects))
        else:
            pinion, wheel = (self.flank(lines.pair, index, effects, lines.coast) for index in (0, 1))
        return FlankPair(both=(pinion, wheel), coupled=self.by_finite_elements and _on_body(effects))

    def tooth_factor(self, pair: Pair, index: int, height: NDArray, y: NDArray, effects: Effects) -> NDArray:
        """Ψ of one tooth; see ``ToothCompliance``."""
        if self.model != "plate":
            return self.flank(pair, index, effects).factor(height, y)
        gear = pair.gears[index]
        factor = plate_tooth(gear, pair.materials[index], self.order, self.fillet).factor(height, y)
        if self.load == "full":
            return factor
        return factor * normal_component(gear, height + gear.root_radius)[..., None]

    def flank(self, pair: Pair, index: int, effects: Effects, coast: bool = False) -> FlankCompliance:
        """Compliance of the flank of a gear, see ``Tooth``."""
        if self.model == "solid":
            return solid_flank(pair, index, self.solid_order, _on_ring(effects))
        compliance = fe_flank(self.body(pair, index, effects, coast), pair.materials[index], self.accuracy)
        return placed_in_mesh(compliance, pair, index, coast)

    def body(self, pair: Pair, index: int, effects: Effects, coast: bool = False) -> Body:
        """Part of pinion (``index`` 0) or wheel (1) that finite elements cover, mirrored for ``coast`` flanks."""
        return fe_body(pair, index, on_body=_on_body(effects), coast=coast)


def tooth_bending(effects: Effects, model: str) -> ToothBending | None:
    """The tooth bending of a scene, if it is of this model."""
    tooth = effects.get(ToothBending.name)
    return tooth if isinstance(tooth, ToothBending) and tooth.model == model else None


def _on_ring(effects: Effects) -> bool:
    """Whether solid teeth stand on an elastic ring instead of being clamped."""
    return getattr(effects.get("gear_body"), "model", None) == "ring"


def _on_body(effects: Effects) -> bool:
    """Whether finite elements cover the body too."""
    return "gear_body" in effects


def normal_component(gear: Gear, radius: NDArray) -> NDArray:
    """Cosine of the angle between the flank normal at ``radius`` R and the normal of the tooth's mid-plane there.

    It is cos γ cos β_b cos β(R) + sin β_b sin β(R): in the transverse plane the load angle γ lies between the normals;
    along the axis the flank normal is inclined by β_b, that of the mid-plane by the helix angle β(R).
    """
    gamma = gear.load_angle(radius)
    helix = np.arctan(radius * math.tan(gear.beta) / gear.pitch_radius)
    return np.cos(gamma) * math.cos(gear.beta_b) * np.cos(helix) + math.sin(gear.beta_b) * np.sin(helix)
