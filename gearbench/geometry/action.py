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
    said otherwise; where a pair has no line its segments have zero length and stand at the middle of the rectangle.

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
    touch
        Where flanks touch first, off the line of action too; absent where contact is taken to lie on it.
    typical_load
        Line load [N/mm] at which contact laws near an edge are made to agree in value and slope; needed with ``touch``.
    """

    pair: Pair
    mesh_phase: NDArray
    index: NDArray
    u: NDArray
    y: NDArray
    length: NDArray
    touch: Touch | None = None
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

    @property
    def rolls(self) -> tuple[NDArray, NDArray]:
        """Roll lengths of the segment centres on pinion and wheel [mm]."""
        if self.touch is not None:
            return self.touch.rolls[0], self.touch.rolls[1]
        return self.u, self.pair.tangent_length - self.u

    @cached_property
    def radii(self) -> tuple[NDArray, NDArray]:
        """Radii of the segment centres on pinion and wheel [mm]."""
        (first, second), (pinion, wheel) = self.rolls, self.pair.gears
        return np.hypot(pinion.base_radius, first), np.hypot(wheel.base_radius, second)

    @property
    def lever(self) -> NDArray | float:
        """Lever arm of the normal force about the pinion's axis over its base radius; 1 on the line of action."""
        return 1.0 if self.touch is None else self.touch.levers[0]

    @property
    def curvature_radius(self) -> NDArray:
        """Relative radius of curvature in the normal plane [mm]; on the line of action u (T₁T₂ − u)/(T₁T₂ cos β_b)."""
        first, second = self.rolls if self.touch is None else self.touch.radii
        return first * second / (first + second) / math.cos(self.pair.base_helix_angle)


def pair_indices(pair: Pair, span: tuple[float, float] | None = None) -> NDArray:
    """Numbers k of the tooth pairs that touch at some phase of the mesh cycle, (pair,).

    ``span`` is the range of u [mm] within which they can, by default the path of contact.
    """
    before, after = (
        (0.0, pair.transverse_contact_ratio)
        if span is None
        else ((u - pair.path_start) / pair.base_pitch for u in span)
    )
    return np.arange(math.floor(before) - math.ceil(pair.overlap_ratio), math.floor(after) + 1)


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
    u_a, u_e = (pair.path_start, pair.path_end) if span is None else span
    b, tan_b, p_bt = pair.face_width, math.tan(pair.base_helix_angle), pair.base_pitch
    index = pair_indices(pair, span)

    start = pair.path_start + (tau[:, None] + index) * p_bt  # u at y = 0
    if tan_b > 0:
        low, high = np.clip((u_a - start) / tan_b, 0.0, b), np.clip((u_e - start) / tan_b, 0.0, b)
    else:
        inside = (start >= u_a) & (start <= u_e)
        low, high = np.zeros_like(start), np.where(inside, b, 0.0)
    width = high - low
    # a line shorter than rounding can place is no line
    width = np.where(width > 1e-13 * b, width, 0.0)

    fraction = (np.arange(segments) + 0.5) / segments
    y = low[..., None] + width[..., None] * fraction
    u = start[..., None] + y * tan_b
    absent = width[..., None] == 0
    u = np.where(absent, (u_a + u_e) / 2, np.clip(u, u_a, u_e))
    touch = None
    if separation is not None:
        # without helix angle all segments of a line stand at the same u
        touch = separation(u) if tan_b > 0 else separation(u[..., :1]).broadcast(segments)
    return ContactLines(
        pair=pair,
        mesh_phase=tau,
        index=index,
        u=u,
        y=np.where(absent, b / 2, y),
        length=width / segments / math.cos(pair.base_helix_angle),
        touch=touch,
    )
