"""Contact lines of all tooth pairs over a mesh cycle, cut into segments."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry.pair import Pair
from gearbench.geometry.separation import Separation, Touch


@dataclass(frozen=True, kw_only=True)
class ContactLines:
    """Segments of the contact lines in the base tangent plane: u along the path of contact, y along the face width.

    Pair k at mesh phase τ touches along u = u_A + (τ + k) p_bt + y tan β_b, as far as u_A ≤ u ≤ u_E, 0 ≤ y ≤ b. The
    part of a line inside that rectangle is cut into equal segments. All arrays are (position, pair, segment) unless
    said otherwise; where a pair has no line its segments have zero length and lie at the middle of the rectangle.

    Parameters
    ----------
    pair
        The gear pair.
    mesh_phase
        Mesh phases τ, one per position [–].
    index
        Number k of each tooth pair, shape (pair,).
    u, y
        Segment centres [mm].
    length
        Length of each segment along the contact line, Δy / cos β_b [mm], shape (position, pair).
    separation
        Of the flanks, off the line of action too; absent where contact is taken to lie on it.
    typical_load
        Line load [N/mm] at which contact laws near an edge agree in value and slope; needed with ``separation``.
    """

    pair: Pair
    mesh_phase: NDArray
    index: NDArray
    u: NDArray
    y: NDArray
    length: NDArray
    separation: Separation | None = None
    typical_load: float = 0.0

    @property
    def shape(self) -> tuple[int, int, int]:
        """(positions, pairs, segments)."""
        p, k, s = self.u.shape
        return p, k, s

    @property
    def active(self) -> NDArray:
        """Whether a pair has a contact line at a position, (position, pair)."""
        return self.length > 0

    @cached_property
    def touch(self) -> Touch | None:
        """Where flanks touch first; None where contact is taken to lie on the line of action."""
        if self.separation is None:
            return None
        if self.pair.meshing.overlap_ratio > 0:
            return self.separation(self.u)
        # without helix angle all segments of a line stand at the same u
        return self.separation(self.u[..., :1]).broadcast(self.shape[2])

    @property
    def rolls(self) -> tuple[NDArray, NDArray]:
        """Roll lengths of the segment centres on pinion and wheel [mm]."""
        if self.touch is not None:
            return self.touch.rolls[0], self.touch.rolls[1]
        return self.u, self.pair.meshing.tangent_length - self.u

    @cached_property
    def radii(self) -> tuple[NDArray, NDArray]:
        """Radii of the segment centres on pinion and wheel [mm]."""
        if self.touch is None:
            return self.pair.meshing.radii(self.u)
        (first, second), (pinion, wheel) = self.rolls, self.pair.gears
        return np.hypot(pinion.base_radius, first), np.hypot(wheel.base_radius, second)

    @property
    def lever(self) -> NDArray | float:
        """Lever arm of the normal force about the pinion's axis over its base radius; 1 on the line of action."""
        return 1.0 if self.touch is None else self.touch.levers[0]

    @property
    def curvature_radius(self) -> NDArray:
        """Relative radius of curvature in the normal plane ρ [mm]."""
        if self.touch is None:
            return self.pair.meshing.curvature_radius(self.u)
        first, second = self.touch.radii
        return first * second / (first + second) / math.cos(self.pair.meshing.beta_b)


def pair_indices(pair: Pair, span: tuple[float, float] | None = None) -> NDArray:
    """Numbers k of the tooth pairs that touch at some phase of the mesh cycle, (pair,).

    ``span`` is the range of u [mm] within which they can, by default the path of contact.
    """
    meshing = pair.meshing
    if span is None:
        before, after = 0.0, meshing.transverse_contact_ratio
    else:
        before, after = ((u - meshing.path_start) / meshing.base_pitch for u in span)
    return np.arange(math.floor(before) - math.ceil(meshing.overlap_ratio), math.floor(after) + 1)


def contact_lines(
    pair: Pair,
    mesh_phase: ArrayLike,
    segments: int,
    separation: Separation | None = None,
    span: tuple[float, float] | None = None,
) -> ContactLines:
    """Contact lines of ``pair`` at the phases ``mesh_phase`` (position,), each cut into ``segments`` segments.

    With a ``separation`` lines reach over the range ``span`` of u [mm], beyond the path of contact.
    """
    tau = np.atleast_1d(np.asarray(mesh_phase, dtype=float))
    meshing, b = pair.meshing, pair.face_width
    u_a, u_e = (meshing.path_start, meshing.path_end) if span is None else span
    tan_b, p_bt = math.tan(meshing.beta_b), meshing.base_pitch
    index = pair_indices(pair, span)

    start = meshing.path_start + (tau[:, None] + index) * p_bt  # u at y = 0
    if tan_b > 0:
        low, high = np.clip((u_a - start) / tan_b, 0.0, b), np.clip((u_e - start) / tan_b, 0.0, b)
    else:
        inside = (start >= u_a) & (start <= u_e)
        low, high = np.zeros_like(start), np.where(inside, b, 0.0)
    width = high - low
    # a line shorter than rounding is no line
    width = np.where(width > 1e-13 * b, width, 0.0)

    fraction = (np.arange(segments) + 0.5) / segments
    y = low[..., None] + width[..., None] * fraction
    u = start[..., None] + y * tan_b
    absent = width[..., None] == 0
    u = np.where(absent, (u_a + u_e) / 2, np.clip(u, u_a, u_e))
    return ContactLines(
        pair=pair,
        mesh_phase=tau,
        index=index,
        u=u,
        y=np.where(absent, b / 2, y),
        length=width / segments / math.cos(meshing.beta_b),
        separation=separation,
    )
