"""Bending and shear of the teeth themselves, clamped at the root."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.compliance.plate import PlateTooth
from gearbench.effects.base import LowRank, ToothCompliance
from gearbench.effects.solids import solid_tooth
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import STRICT, Material
from gearbench.geometry.pair import Pair

Order = Annotated[tuple[Annotated[int, Field(ge=1, le=40)], ...], Field(min_length=2, max_length=3)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ToothBending(ToothCompliance):
    """Tooth as a plate or as a solid, clamped at the root, solved by the Ritz method.

    Parameters
    ----------
    model
        "plate": Reissner–Mindlin plate of variable thickness, the paper's model. "solid": three-dimensional elasticity
        on the exact section with the generated fillet; its compliance is that of the flank less the compression which
        the contact law stands for.
    basis
        Plate only. "paper": 9 unknowns, each field x(a + by + cx). The default where no ``order`` is given.
    order
        Numbers of functions: plate [height, face width], instead of ``basis``; solid [thickness, height, face width],
        by default 6, 7 and about one for each module of face width.
    fillet
        Plate only. Thickness with the generated root fillet, or without it (involute; constant below the base circle).
    load
        Plate only. "full": the normal force acts across the plate as it is, as in the paper. "component": only its
        component normal to the mid-plane of the tooth bends the plate, and only that of the deflection counts.
    """

    model: Literal["plate", "solid"] = "plate"
    basis: Literal["paper"] | None = None
    order: Order | None = None
    fillet: bool = False
    load: Literal["full", "component"] = "full"

    name: ClassVar[str] = "tooth_bending"
    summary: ClassVar[str] = "compliance: bending and shear of both teeth, clamped at the root"
    source: ClassVar[str] = "Garambois et al. 2017; Reissner–Mindlin plate or three-dimensional solid, Ritz"
    use: ClassVar[str] = (
        "Always, unless finite elements take its place: plate to compare with the paper, solid for results to trust."
    )
    example: ClassVar[dict[str, Any]] = {"model": "solid"}
    requires: ClassVar[dict[str, str]] = {
        "hertz": "a few Ritz amplitudes alone do not determine the distribution of the load"
    }
    conflicts: ClassVar[dict[str, str]] = {"fe_compliance": "which contains the bending of the teeth"}

    def __post_init__(self) -> None:
        if self.basis is not None and self.order is not None:
            raise InputError("order", list(self.order), 'conflicts with basis = "paper": give one of the two')
        count, names = 3, "three numbers for the solid, [thickness, height, face width]"
        if self.model == "plate":
            count, names = 2, "two numbers for the plate, [height, face width]"
        if self.order is not None and len(self.order) != count:
            raise InputError("order", list(self.order), f"must be {names}")
        if self.model == "solid":
            for key, given, default in (("basis", self.basis, None), ("fillet", self.fillet, False)):
                if given != default:
                    raise InputError(key, given, 'belongs to model = "plate": the solid has its own section')
            if self.load != "full":
                raise InputError("load", self.load, 'belongs to model = "plate": the solid takes the force as it is')

    def compliance(self, lines: ContactLines) -> LowRank:
        """Factor of both teeth side by side, (position, pair, segment, rank)."""
        return self.both_teeth(lines)

    def tooth_factor(self, pair: Pair, k: int, height: NDArray, y: NDArray) -> NDArray:
        """Ψ of one tooth, clamped at its root; see ``ToothCompliance``."""
        gear, material = pair.gears[k], pair.material
        if self.model == "solid":
            return solid_tooth(pair, k, self.order).factor(height, y)
        factor = plate_tooth(gear, material, self.order, self.fillet).factor(height, y)
        if self.load == "full":
            return factor
        return factor * normal_component(gear, height + gear.root_radius)[..., None]


def normal_component(gear: Gear, radius: NDArray) -> NDArray:
    """Cosine between the flank normal at R and the normal of the tooth's mid-plane there.

    Load angle γ = α_R − ψ(R) in the transverse plane; out of it the flank normal is inclined by β_b and the mid-plane
    by its helix angle β(R): cos γ cos β_b cos β(R) + sin β_b sin β(R).
    """
    gamma = gear.load_angle(radius)
    helix = np.arctan(radius * math.tan(gear.beta) / gear.pitch_radius)
    return np.cos(gamma) * math.cos(gear.beta_b) * np.cos(helix) + math.sin(gear.beta_b) * np.sin(helix)


@lru_cache(maxsize=256)
def plate_tooth(gear: Gear, material: Material, order: tuple[int, int] | None, fillet: bool) -> PlateTooth:
    """Plate of a gear's tooth; kept, because micro-geometry and errors do not change it."""
    # the involute starts at the base circle like (R − r_b)^{3/2}; a fillet leaves the root circle like √(R − r_f)
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
