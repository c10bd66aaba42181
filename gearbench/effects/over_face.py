"""A curve over the face width: of the pair over the common face, or of each gear over its own."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.base import Effects, GapEffect
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.role import Role


class FaceCurve(ABC):
    """A gap that depends on the position over a face alone; the face begins at y = 0 and ends at its width b [mm]."""

    @abstractmethod
    def over(self, y: NDArray, b: float) -> NDArray:
        """Gap [mm] at positions y [mm]."""

    @abstractmethod
    def check(self, b: float) -> None:
        """Refuse, with an ``InputError``, what does not fit on the face."""

    def begins(self, b: float) -> tuple[float, ...]:
        """Where the curve has a kink, y [mm]; none by default."""
        return ()


class OverFace(GapEffect):
    """Gap over the face width: one curve of the pair, both gears together, or one of each gear."""

    @property
    @abstractmethod
    def of_pair(self) -> FaceCurve | None:
        """The curve of the pair; None where each gear has its own."""

    @property
    def curves(self) -> dict[Role | None, FaceCurve]:
        """The curve of the pair (None), or of each gear that has one."""
        if self.of_pair is not None:
            return {None: self.of_pair}
        return {role: curve for role in Role if (curve := getattr(self, role.label)) is not None}

    def check(self, pair: Pair, beside: Effects) -> None:
        """Refuse what does not fit on a face."""
        for role, curve in self.curves.items():
            try:
                curve.check(pair.face_of(role))
            except InputError as error:
                raise error if role is None else error.within(role.label) from None

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        total = np.zeros(lines.shape)
        for role, curve in self.curves.items():
            total += curve.over(lines.face if role is None else lines.own_face(role), lines.pair.face_of(role))
        return total

    def face_kinks(self, pair: Pair) -> tuple[float, ...]:
        """Kinks of the curves, y [mm] on the common face."""
        found: list[float] = []
        for role, curve in self.curves.items():
            before = 0.0 if role is None else pair.overhangs[role][0]
            found += [y - before for y in curve.begins(pair.face_of(role))]
        return tuple(y for y in found if 0 < y < pair.meshing.face_width)
