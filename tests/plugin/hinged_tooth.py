"""Teeth that turn about their roots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench import ContactLines
from gearbench.plugin import STRICT, ComplianceEffect, Effect, LowRank


@dataclass(frozen=True, kw_only=True, config=STRICT)
class HingedTooth(ComplianceEffect):
    """Rigid teeth, each on a rotational spring at its root circle: H(1, 2) = h₁ h₂/(c b), h above the root circle.

    Parameters
    ----------
    stiffness
        c, moment for each radian and each mm of face width [N·mm/rad/mm].
    """

    stiffness: Annotated[float, Field(gt=0.0)]

    name: ClassVar[str] = "hinged_tooth"
    summary: ClassVar[str] = "compliance: rigid teeth that turn about their roots"
    source: ClassVar[str] = "the tutorial"
    use: ClassVar[str] = "To see how little code a model of a tooth needs."
    example: ClassVar[dict[str, Any]] = {"stiffness": 2e6}
    conflicts: ClassVar[dict[str, str]] = {"tooth_bending": "which bends the same teeth"}

    def compliance(self, lines: ContactLines, effects: Mapping[str, Effect]) -> LowRank:
        """One column for each of the two teeth, (position, pair, segment, 2) [√(mm/N)]."""
        heights = [radius - gear.root_radius for radius, gear in zip(lines.radii, lines.pair.gears, strict=True)]
        return LowRank(factor=np.stack(heights, axis=-1) / (self.stiffness * lines.pair.face_width) ** 0.5)
