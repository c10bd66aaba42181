"""Local contact compliance of two teeth pressed together along a line."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic.dataclasses import dataclass

from gearbench.effects.base import ComplianceEffect, Effects, LineLaw
from gearbench.geometry.action import ContactLines
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Hertz(ComplianceEffect):
    """Contact compliance, as a law of the line load q.

    "yang_sun": constant per unit length, g = 4(1−ν²)/(πE) · q (C2 of docs/theory.md).
    "weber_banaschek": g = 4(1−ν²)/(πE) · q · [ln(2√(t₁t₂)/a_H) − ν/(2(1−ν))], a_H² = 8qρ(1−ν²)/(πE), with ρ the
    relative radius of curvature in the normal plane and t_i the depth from the flank, along the line of action, to
    the centre line of the tooth; load dependent, solved to convergence (C3).

    Parameters
    ----------
    law
        "weber_banaschek" or "yang_sun".
    """

    law: Literal["weber_banaschek", "yang_sun"] = "weber_banaschek"

    name: ClassVar[str] = "hertz"
    summary: ClassVar[str] = "compliance: local compression of the flanks under the line load"
    source: ClassVar[str] = "Yang & Sun 1985; Weber & Banaschek 1953"
    use: ClassVar[str] = "Always: without it the distribution of the load is not determined."
    example: ClassVar[dict[str, Any]] = {"law": "weber_banaschek"}

    def compliance(self, lines: ContactLines, beside: Effects) -> LineLaw:
        """Law of each segment, (position, pair, segment)."""
        nu, c = lines.pair.material.nu, 4 / (math.pi * lines.pair.material.plane_strain_modulus)
        if self.law == "yang_sun":
            return LineLaw(a=np.full(lines.shape, c), h=np.zeros(lines.shape))
        # at an interference point ρ = 0 and the logarithm is infinite: no segment centre sees less than this
        rho = np.maximum(lines.curvature_radius, 1e-9 * lines.pair.meshing.tangent_length)
        t1, t2 = (gear.flank_depth(r) for gear, r in zip(lines.pair.gears, lines.radii, strict=True))
        # ln(2√(t1 t2)/a_H) = ½ ln(4 t1 t2 / (2cρ)) − ½ ln q, since a_H² = 2cρq
        a = c * (0.5 * np.log(2 * t1 * t2 / (c * rho)) - nu / (2 * (1 - nu)))
        return LineLaw(a=a, h=np.full(lines.shape, c / 2))
