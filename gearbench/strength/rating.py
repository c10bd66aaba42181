"""Ratings of a pair to compare with limits: contact ratios, sliding, contact pressure, root stress."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.ring_conditions import radial_room, tip_room
from gearbench.scene import Scene
from gearbench.strength.bending import RootBending

#: Ratings that follow from the geometry alone.
GEOMETRIC: Mapping[str, Callable[[Pair], float]] = MappingProxyType(
    {
        "total_contact_ratio": lambda pair: pair.meshing.total_contact_ratio,
        "transverse_contact_ratio": lambda pair: pair.meshing.transverse_contact_ratio,
        "overlap_ratio": lambda pair: pair.meshing.overlap_ratio,
        "specific_sliding": lambda pair: pair.meshing.largest_sliding,
        "tip_room": lambda pair: tip_room(pair) if pair.is_internal else math.inf,
        "radial_room": lambda pair: radial_room(pair) if pair.is_internal else math.inf,
        "form_room": lambda pair: pair.meshing.form_room,
    }
)


def root_stress(scene: Scene) -> tuple[float, float]:
    """Nominal root stress of pinion and wheel [MPa] by ISO 6336-3:2019, method B."""
    pinion, wheel = (RootBending(pair=scene.pair, gear=index).stress(abs(scene.load.torque)) for index in (0, 1))
    return pinion, wheel


def contact_pressure(lines: ContactLines, force: NDArray) -> NDArray:
    """Largest pressure of each segment's Hertzian strip [MPa], (position, pair, segment); zero without contact.

    Two cylinders with the flanks' radii of curvature in the normal plane touch along a line: p = √(q E*/(πρ)) with the
    line load q, 1/E* = (1−ν₁²)/E₁ + (1−ν₂²)/E₂ and ρ = ``ContactLines.curvature_radius``. ρ and q are taken at the node
    of the segment.

    Parameters
    ----------
    lines
        Contact lines of the pair.
    force
        Normal force on each segment [N], (position, pair, segment).
    """
    pair = lines.pair
    T = pair.meshing.tangent_length
    length = np.where(lines.length > 0, lines.length, 1.0)
    # at an interference point ρ is 0: keep it above a lower limit
    rho = np.maximum(lines.curvature_radius, 1e-9 * abs(T) / math.cos(pair.meshing.beta_b))
    return np.sqrt(np.maximum(force, 0.0) / length * pair.contact_modulus / (math.pi * rho))
