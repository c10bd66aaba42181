"""Support of the outside of an internal gear."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Support:
    """Springs all around the outside of a ring: a press fit, a spline, a thin housing.

    Parameters
    ----------
    radial, tangential
        Stiffness per length of the circumference [N/mm²]; ``tangential`` also acts axially. ``radial`` may be 0.
    """

    radial: Annotated[float, Field(ge=0.0, le=1e9)]
    tangential: Annotated[float, Field(ge=1e-3, le=1e9)]

    def per_area(self, face_width: float) -> tuple[float, float]:
        """Both over the face width [N/mm³]."""
        return self.radial / face_width, self.tangential / face_width
