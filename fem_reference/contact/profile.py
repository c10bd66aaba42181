"""Right flanks as they are made: the involute less the material that the gaps of a scene take away."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.base import GapEffect
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.role import Role


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Right flank of one gear in one transverse section.

    Parameters
    ----------
    pair, role
        The pair, and which gear of it.
    effects
        Effects that take material away. One that does not say from which gear is cut from the pinion.
    y
        Position across the face [mm]; by default its middle.
    """

    pair: Pair
    role: Role
    effects: tuple[GapEffect, ...]
    y: float | None = None

    def missing(self, R: NDArray, k: int) -> NDArray:
        """Missing material normal to the flank [mm] at the radii R (n,) of the tooth of pair k."""
        own = self._own()
        if not own:
            return np.zeros(len(R))
        roll = np.sqrt(np.maximum(R**2 - self.pair.gears[self.role].base_radius ** 2, 0.0))
        u = roll if self.role == Role.PINION else self.pair.meshing.tangent_length - roll
        y = self.pair.face_width / 2 if self.y is None else self.y
        lines = ContactLines(
            pair=self.pair,
            mesh_phase=np.zeros(1),
            index=np.array([k]),
            u=u[None, None],
            y=np.full((1, 1, len(u)), y),
            length=np.ones((1, 1)),
        )
        return sum((each.gap(lines)[0, 0] for each in own), np.zeros(len(R)))

    def angle(self, R: NDArray, k: int) -> NDArray:
        """Angle [rad] of the flank from the middle of its tooth: e = r_b Δψ."""
        gear = self.pair.gears[self.role]
        return gear.half_angle(R) - self.missing(R, k) / gear.base_radius

    def _own(self) -> list[GapEffect]:
        found: list[GapEffect] = []
        for effect in self.effects:
            if "gear" not in {field.name for field in fields(effect)}:
                found += [effect] if self.role == Role.PINION else []
            elif (gears := getattr(effect, "gear")) in ("both", self.role.label):  # noqa: B009
                one: Any = effect if gears != "both" else replace(effect, gear=self.role.label)  # type: ignore[call-arg]
                found.append(one)
        return found
