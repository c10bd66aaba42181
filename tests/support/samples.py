"""Samples of a batch, solved one at a time."""

from dataclasses import replace

import numpy as np

from gearbench.contact.batch import Batch
from gearbench.contact.law import inverse, steepening
from gearbench.contact.problem import full_factor
from gearbench.contact.solver import solve


def stiffness_slopes(s: np.ndarray, a: np.ndarray, h: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Slopes of the law of segments compressed by s, as the stiffness of cells has them."""
    W, cells = inverse(s, a, h, sigma)[1], (s > 0) & (sigma > 0) & (h > 0)
    W[cells] *= steepening(s[cells] / (2 * sigma[cells]), h[cells], W[cells])
    return W


def single(batch: Batch, draw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """δ_n [mm] and ∂F/∂δ_n [N/mm] of one sample by the solver of single scenes, with the correction of the cells."""
    p, own = batch.problem, batch.arrays(draw)
    arrays = {name: getattr(own, name) for name in ("gap", "a", "h", "sigma", "active", "factor")}
    p = replace(p, **arrays, cells=None, shape=(len(own.gap), 1, own.gap.shape[1]))
    stiffness, deltas = [], []
    for t in range(len(own.gap)):
        here = slice(t, t + 1)
        one = {name: getattr(p, name)[here] for name in ("gap", "a", "h", "sigma", "active", "factor")}
        each = replace(p, **one, block=own.block[t], shape=(1, *p.shape[1:]))
        found, on = solve(each), own.active[t]
        psi, force = full_factor(each, 0), found.force.reshape(-1)[on] / p.force
        s = found.approach / p.length_scale - own.gap[t, on] - psi @ (psi.T @ force)
        a, h, sigma = (each[t, on] for each in (own.a, own.h, own.sigma))
        W = stiffness_slopes(s, a, h, sigma)
        # ∂F/∂δ = 1ᵀ (W⁻¹ + H)⁻¹ 1 of the loaded segments
        root = np.sqrt(W)
        inner = np.eye(len(W)) + root[:, None] * (psi @ psi.T) * root
        stiffness.append(root @ np.linalg.solve(inner, root))
        deltas.append(float(found.approach[0]))
    return np.array(deltas) + batch.cell_correction[0], np.array(
        stiffness
    ) * p.force / p.length_scale * batch.cell_correction[1]
