"""Mesh stiffness [N/(mm·µm)] by ISO 6336-1:2019, method B, for steel gears."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearbench.geometry.pair import Pair


@dataclass(frozen=True, kw_only=True)
class NormStiffness:
    """Stiffness per unit face width [N/(mm·µm)].

    Parameters
    ----------
    theoretical
        c′_th, single stiffness of a tooth pair on solid discs.
    single
        c′, single stiffness with the corrections of the norm.
    mesh
        c_γα, mean mesh stiffness.
    """

    theoretical: float
    single: float
    mesh: float


def norm_stiffness(pair: Pair, contact_ratio: float | None = None) -> NormStiffness:
    """Stiffness of ``pair`` by the norm, with the ``contact_ratio`` ε_α; by default that of the pair.

    Valid for external steel gears with x_1 ≥ x_2 and −0.5 ≤ x_1 + x_2 ≤ 2.
    """
    beta, alpha_n = math.radians(pair.helix_angle), pair.pressure_angle
    z_n1, z_n2 = (g.teeth / (math.cos(pair.meshing.beta_b) ** 2 * math.cos(beta)) for g in pair.gears)
    x1, x2 = pair.profile_shifts
    flexibility = (
        0.04723
        + 0.15551 / z_n1
        + 0.25791 / z_n2
        - 0.00635 * x1
        - 0.11654 * x1 / z_n1
        - 0.00193 * x2
        - 0.24188 * x2 / z_n2
        + 0.00529 * x1**2
        + 0.00182 * x2**2
    )
    rack = [(1 + 0.5 * (1.2 - g.dedendum)) * (1 - 0.02 * (20 - alpha_n)) for g in pair.gears]
    single = 0.8 * sum(rack) / 2 * math.cos(beta) / flexibility
    epsilon = pair.meshing.transverse_contact_ratio if contact_ratio is None else contact_ratio
    return NormStiffness(theoretical=1 / flexibility, single=single, mesh=single * (0.75 * epsilon + 0.25))
