"""Undulation: a cosine over the face width."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench import ContactLines, InputError, Pair
from gearbench.plugin import STRICT, Effect, GapEffect


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Undulation(GapEffect):
    """Undulation of the pair, both gears together: e = A (1 − cos(2π n y/b)).

    Parameters
    ----------
    amplitude
        A [µm].
    waves
        n, waves over the face width.
    """

    amplitude: Annotated[float, Field(gt=0.0, le=100.0)]
    waves: Annotated[int, Field(ge=1, le=100)]

    name: ClassVar[str] = "undulation"
    summary: ClassVar[str] = "gap: cosine over the face width"
    source: ClassVar[str] = "the tutorial"
    use: ClassVar[str] = "Where grinding has left waves across the face."
    example: ClassVar[dict[str, Any]] = {"amplitude": 0.5, "waves": 4}
    conflicts: ClassVar[dict[str, str]] = {"topography": "which measures the undulation too"}

    def check(self, pair: Pair, effects: Mapping[str, Effect]) -> None:
        """Refuse waves shorter than a quarter of a module, too short for the contact to resolve."""
        most = int(4 * pair.face_width / pair.normal_module)
        if self.waves > most:
            raise InputError("waves", self.waves, f"must be at most {most}, four waves per module")

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        return 1e-3 * self.amplitude * (1 - np.cos(2 * math.pi * self.waves * lines.face / lines.pair.face_width))
