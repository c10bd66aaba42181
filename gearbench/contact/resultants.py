"""Force, moment … of all flanks of a mesh, and their stiffness against approach, tilt … of the gears.

Gears that are rigid across their faces approach each other by x₀ + x₁ η, with the lever of a point of the flank about
the middle of the face, in the plane of action, η = (y − b/2 + (u − u_C) tan β_b) / (b/2). The forces that work on x₀
and x₁ are f₀ = ΣF and f₁ = Σ F η. Where gears bend over their faces, Legendre polynomials P_j(η) follow (W11).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from gearbench.contact.law import slope
from gearbench.contact.patches import on_patches
from gearbench.contact.problem import ContactProblem, ContactSolution, gram
from gearbench.contact.solver import Guess, has_law, law_forces
from gearbench.geometry.action import ContactLines


@dataclass(frozen=True, kw_only=True)
class Resultants:
    """Resultants of the flank forces at each position, along the line of action in the transverse plane.

    Parameters
    ----------
    force
        f (position, row) [N].
    stiffness
        ∂f/∂x (position, row, row) [N/mm].
    """

    force: NDArray
    stiffness: NDArray


def lever(lines: ContactLines) -> NDArray:
    """η of the segments, (position, pair, segment); −1 … 1 over the face of spur gears."""
    meshing = lines.pair.meshing
    b, tan_b = meshing.face_width, math.tan(meshing.beta_b)
    return (lines.y - b / 2 + (lines.u - meshing.pitch_point) * tan_b) / (b / 2)


def resultants(
    problem: ContactProblem, lines: ContactLines, solution: ContactSolution, guess: Guess, rows: int
) -> Resultants:
    """The first ``rows`` resultants of the ``solution`` of ``problem`` on ``lines``; ``guess`` is its last iterate.

    The loaded points yield by A = ΨΨᵀ + diag(dg/dP): ∂f/∂x = Rᵀ A⁻¹ R with R_ij = P_j(η_i) (W12).
    """
    p, nodes = (problem, lines) if problem.along is None else on_patches(problem, guess)
    P = law_forces(p, guess.delta, guess.q) if has_law(p) else (solution.force / p.force).reshape(p.gap.shape)
    loaded = p.active & (P > 0)
    sigma = slope(np.where(loaded, P, 1.0), p.a, p.h, p.sigma) if has_law(p) else np.zeros_like(P)
    same = p.block[:, None] == p.block
    A = np.where(loaded[:, :, None] & loaded[:, None, :] & same, gram(p.factor), 0.0)
    index = np.arange(A.shape[-1])
    A[:, index, index] = np.where(loaded, A[:, index, index] + sigma, 1.0)
    R = legvander(lever(nodes).reshape(P.shape), rows - 1) * loaded[..., None]
    cos_b = math.cos(lines.pair.meshing.beta_b)
    unit = p.force / p.length_scale * cos_b**2
    stiffness = np.swapaxes(R, 1, 2) @ np.linalg.solve(A, R)
    return Resultants(
        force=p.force * cos_b * np.einsum("ps,psr->pr", P, R),
        stiffness=unit * (stiffness + np.swapaxes(stiffness, 1, 2)) / 2,
    )
