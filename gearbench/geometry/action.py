"""Contact lines of all tooth pairs over a mesh cycle, cut into segments."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry.pair import Pair


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
    """

    pair: Pair
    mesh_phase: NDArray
    index: NDArray
    u: NDArray
    y: NDArray
    length: NDArray

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
    def radii(self) -> tuple[NDArray, NDArray]:
        """Radii of the segment centres on pinion and wheel [mm]."""
        return self.pair.meshing.radii(self.u)

    @property
    def curvature_radius(self) -> NDArray:
        """Relative radius of curvature in the normal plane ρ [mm]."""
        return self.pair.meshing.curvature_radius(self.u)


def pair_indices(pair: Pair) -> NDArray:
    """Numbers k of the tooth pairs that touch at some phase of the mesh cycle, (pair,)."""
    return np.arange(-math.ceil(pair.meshing.overlap_ratio), math.floor(pair.meshing.transverse_contact_ratio) + 1)


def contact_lines(pair: Pair, mesh_phase: ArrayLike, segments: int) -> ContactLines:
    """Contact lines of ``pair`` at the phases ``mesh_phase`` (position,), each cut into ``segments`` segments."""
    tau = np.atleast_1d(np.asarray(mesh_phase, dtype=float))
    meshing, b = pair.meshing, pair.face_width
    u_a, u_e, tan_b, p_bt = meshing.path_start, meshing.path_end, math.tan(meshing.beta_b), meshing.base_pitch
    index = pair_indices(pair)

    start = u_a + (tau[:, None] + index) * p_bt  # u at y = 0
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
    return ContactLines(
        pair=pair,
        mesh_phase=tau,
        index=index,
        u=np.where(absent, (u_a + u_e) / 2, np.clip(u, u_a, u_e)),
        y=np.where(absent, b / 2, y),
        length=width / segments / math.cos(meshing.beta_b),
    )
