"""Readable NumPy twin of the compiled contact solver, one position at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.problem import ContactProblem


def law(s: NDArray, a: NDArray, h: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Force P, slope dP/ds and energy ∫P ds of segments compressed by s under g(P) = P (a − h ln P) (C5)."""
    from scipy.special import lambertw

    s = np.maximum(s, 0.0)
    linear = (h == 0) | (s == 0)
    safe_h, safe_s = np.where(linear, 1.0, h), np.where(linear, 1.0, s)
    ratio = np.where(linear, 3.0, a / safe_h)
    sigma = np.minimum(np.exp(np.log(safe_s / safe_h) - ratio), 2 * np.exp(-2.0))
    big = np.where(linear, 2.0, -lambertw(-sigma, -1).real)  # L e^{-L} = σ, L ≥ 2
    edge = np.exp(ratio - 2)
    over = np.maximum(safe_s - 2 * safe_h * edge, 0.0)
    p = np.where(over > 0, edge + over / safe_h, safe_s / (safe_h * big))
    w = np.where(over > 0, 1 / safe_h, 1 / (safe_h * (big - 1)))
    base = safe_h * np.where(over > 0, edge, p) ** 2 * (big / 2 - 0.25)
    e = base + over * (edge + over / (2 * safe_h))
    straight = np.where(h == 0, a, 1.0)
    p = np.where(linear, np.where(h == 0, s / straight, 0.0), p)
    w = np.where(linear, np.where((h == 0) & (s > 0), 1 / straight, 0.0), w)
    return p, w, np.where(linear, np.where(h == 0, s * s / (2 * straight), 0.0), e)


def full_factor(problem: ContactProblem, position: int) -> NDArray:
    """Ψ of the existing segments with a column for each amplitude of each block, (segment, block·rank)."""
    active = problem.active[position]
    own = problem.factor[position][active]
    wide = np.zeros((own.shape[0], problem.blocks, own.shape[1]))
    wide[np.arange(own.shape[0]), problem.block[active]] = own
    return wide.reshape(own.shape[0], -1)


def solve_one(problem: ContactProblem, position: int, steps: int = 200) -> tuple[NDArray, float, float]:
    """Forces of the existing segments, δ and ∂F/∂δ of one position, by Newton's method on J(q, δ)."""
    active = problem.active[position]
    gap, a, h = (x[position][active] for x in (problem.gap, problem.a, problem.h))
    psi = full_factor(problem, position)
    columns = np.column_stack([-psi, np.ones(gap.size)])  # s = columns @ (q, δ) − e
    z = np.zeros(columns.shape[1])
    z[-1] = gap.max() + 1
    unit = np.zeros_like(z)
    unit[-1] = 1.0
    identity = np.diag(np.append(np.ones(z.size - 1), 0.0))

    def value(z: NDArray) -> float:
        return 0.5 * z[:-1] @ z[:-1] + law(columns @ z - gap, a, h)[2].sum() - z[-1]

    for _ in range(steps):
        p, w, _ = law(columns @ z - gap, a, h)
        gradient = identity @ z + columns.T @ p - unit
        if np.abs(gradient).max() <= 1e-14 * max(1.0, np.abs(z).max()):
            break
        hessian = identity + (columns.T * w) @ columns
        step = -np.linalg.lstsq(hessian, gradient, rcond=None)[0]
        t = 1.0
        while value(z + t * step) > value(z) + 1e-4 * t * gradient @ step + 1e-14 * (abs(value(z)) + 1) and t > 1e-12:
            t /= 2
        z = z + t * step
    p, w, _ = law(columns @ z - gap, a, h)
    loaded = p > 0
    compliance = psi[loaded] @ psi[loaded].T + np.diag(1 / w[loaded])
    return p, float(z[-1]), float(np.linalg.solve(compliance, np.ones(loaded.sum())).sum())
