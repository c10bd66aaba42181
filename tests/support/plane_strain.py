"""Plane strain solution with the condensed sector: displacements are constant along the axis, and axially zero."""

import math

import numpy as np
import scipy.sparse as sp

from fem_reference.axis import FaceFunctions
from fem_reference.circulant import circulant_compliance, condensed_sector
from fem_reference.section import Body
from fem_reference.sector import Grain, Section, lagrange
from gearbench.geometry.material import Material


def centre_line_compliance(body: Body, material: Material, radius: float, half_width: float, degree: int = 6) -> float:
    """Displacement of the tooth centre line along the line of action, under a unit line load [mm²/N].

    The load is Hertz's pressure over ``half_width`` to both sides of ``radius`` on the flank. The gear has all its
    teeth and a width of one millimetre.
    """
    section = Section(body=body, grain=Grain(degree=degree))
    there = np.zeros((len(section.positions), 3, 2), dtype=bool)
    there[:, :2, 0] = True
    both = np.stack([_strip(section, radius, half_width), _at_centre_line(section, radius)], axis=1)[section.free]
    axis = FaceFunctions(breaks=(0.0, 1.0), counts=(2,))
    functionals = sp.csr_array(np.kron(both, [[1.0], [0.0]]))
    S, face = condensed_sector(section, axis, there.reshape(-1, 2)[section.free], material, (1, 1), [functionals])
    return float(circulant_compliance(S, face, body.gear.teeth, 0)[0, 1, 2])


def _strip(section: Section, radius: float, half_width: float) -> np.ndarray:
    """Nodal forces of Hertz's pressure p ∝ √(1 − (s/a)²); they sum to 1 along the line of action."""
    gear, n = section.body.gear, section.grain.degree
    turn = np.arange(1, 41) * math.pi / 41
    weight = 2 / 41 * np.sin(turn) ** 2  # Gauss's rule for the weight √(1 − x²)
    # arc length of the involute (R² − radius²) / 2 r_b
    R = np.sqrt(radius**2 + 2 * gear.base_radius * half_width * np.cos(turn))
    out = np.zeros(3 * len(section.positions))
    for e in range(len(section.grain.flank) - 1):
        low, high = (float(section.maps[e](np.array(1.0), np.array(t))[0]) for t in (0.0, 1.0))
        on = (low <= R) & (high > R)
        value = lagrange(n, (R[on] - low) / (high - low))[0]
        cos = gear.base_radius / R[on]
        normal = np.stack([-np.sqrt(1 - cos**2), -cos, 0 * cos], axis=1)
        nodes = section.nodes[e].reshape(n + 1, n + 1)[:, -1]
        np.add.at(out, 3 * nodes[:, None] + np.arange(3), value.T @ (weight[on, None] * normal))
    return out


def _at_centre_line(section: Section, radius: float) -> np.ndarray:
    """Functional for the displacement at θ = 0 along the line of action through ``radius`` on the flank."""
    gear, n, half = section.body.gear, section.grain.degree, np.array(0.5)
    gamma = float(gear.load_angle(radius))
    R = gear.base_radius / math.cos(gamma)
    out = np.zeros(3 * len(section.positions))
    for e, at in enumerate(section.maps):
        (low, theta, *_), (high, *_) = (at(half, np.array(t)) for t in (0.0, 1.0))
        if abs(theta) < 1e-12 and low <= R < high:
            value = np.outer(lagrange(n, (R - low) / (high - low))[0], lagrange(n, half)[0]).ravel()
            out[3 * section.nodes[e]] = -math.sin(gamma) * value
            out[3 * section.nodes[e] + 1] = -math.cos(gamma) * value
    return out
