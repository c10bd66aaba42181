"""Readable NumPy version of the compiled contact solvers, for one position at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.law import inverse
from gearbench.contact.problem import ContactProblem, full_factor


def solve_one(problem: ContactProblem, position: int, steps: int = 200) -> tuple[NDArray, float, float]:
    """Forces of the existing segments, δ and ∂F/∂δ of one position, found by Newton's method on J(q, δ)."""
    active = problem.active[position]
    fields = problem.gap, problem.a, problem.h, problem.sigma
    gap, a, h, sigma = (x[position][active] for x in fields)
    psi = full_factor(problem, position)
    columns = np.column_stack([-psi, np.ones(gap.size)])  # s = columns @ (q, δ) − e
    z = np.zeros(columns.shape[1])
    z[-1] = gap.max() + 1
    unit = np.zeros_like(z)
    unit[-1] = 1.0
    identity = np.diag(np.append(np.ones(z.size - 1), 0.0))

    def value(z: NDArray) -> float:
        return 0.5 * z[:-1] @ z[:-1] + inverse(columns @ z - gap, a, h, sigma)[2].sum() - z[-1]

    for _ in range(steps):
        p, w, _ = inverse(columns @ z - gap, a, h, sigma)
        gradient = identity @ z + columns.T @ p - unit
        if np.abs(gradient).max() <= 1e-14 * max(1.0, np.abs(z).max()):
            break
        hessian = identity + (columns.T * w) @ columns
        step = -np.linalg.lstsq(hessian, gradient, rcond=None)[0]
        t = 1.0
        while value(z + t * step) > value(z) + 1e-4 * t * gradient @ step + 1e-14 * (abs(value(z)) + 1) and t > 1e-12:
            t /= 2
        z = z + t * step
    p, w, _ = inverse(columns @ z - gap, a, h, sigma)
    loaded = p > 0
    compliance = psi[loaded] @ psi[loaded].T + np.diag(1 / w[loaded])
    return p, float(z[-1]), float(np.linalg.solve(compliance, np.ones(loaded.sum())).sum())
