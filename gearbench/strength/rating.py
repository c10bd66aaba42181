"""All strength numbers of a scene at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.action import ContactLines
from gearbench.outputs import Solved
from gearbench.scene import Scene
from gearbench.simulation import solve_scene
from gearbench.strength.bending import RootBending


@dataclass(frozen=True, kw_only=True)
class Strength:
    """What a pair must stand, to be compared with ``Limits``.

    Parameters
    ----------
    total_contact_ratio
        ε_γ = ε_α + ε_β.
    specific_sliding
        Largest |ζ| at either end of the path of contact, on either gear; infinite where the path of contact reaches an
        interference point.
    contact_pressure
        Largest Hertz pressure over the mesh cycle, from the solved load distribution [MPa].
    root_stress
        Nominal root stress of pinion and wheel, ISO 6336-3:2019 method B [MPa].
    """

    total_contact_ratio: float
    specific_sliding: float
    contact_pressure: float
    root_stress: tuple[float, float]


def strength(scene: Scene, solved: Solved | None = None) -> Strength:
    """Strength numbers of ``scene``.

    Parameters
    ----------
    scene
        The pair, its load, and the effects that distribute it.
    solved
        The scene already solved on its contact lines (``gearbench.simulation.solve_scene``); solved here where absent.

    Raises
    ------
    ConvergenceError
        If the contact problem is not solved to its residual.
    """
    solved = solve_scene(scene) if solved is None else solved
    pair, torque = scene.pair, scene.load.torque
    return Strength(
        total_contact_ratio=pair.total_contact_ratio,
        specific_sliding=pair.largest_sliding,
        contact_pressure=float(np.max(contact_pressure(solved.lines, solved.solution.force))),
        root_stress=(RootBending(pair=pair, member=0).stress(torque), RootBending(pair=pair, member=1).stress(torque)),
    )


def contact_pressure(lines: ContactLines, force: NDArray) -> NDArray:
    """Largest pressure of each segment's Hertzian strip [MPa], (position, pair, segment); zero without contact.

    Line contact of two cylinders with their radii of curvature in the normal plane, p = √(q E*/(πρ)) with the line
    load q, 1/E* = 2(1−ν²)/E and ρ = ``ContactLines.curvature_radius``; ρ and q are those of the middle of the segment.

    Parameters
    ----------
    lines
        Contact lines of the pair.
    force
        Normal force on each segment [N], (position, pair, segment).
    """
    pair = lines.pair
    T = pair.tangent_length
    length = np.where(lines.active, lines.length, 1.0)[..., None]
    # at an interference point ρ = 0: no segment sees less than this
    rho = np.maximum(lines.curvature_radius, 1e-9 * T / math.cos(pair.base_helix_angle))
    return np.sqrt(np.maximum(force, 0.0) / length * pair.material.plane_strain_modulus / (2 * math.pi * rho))
