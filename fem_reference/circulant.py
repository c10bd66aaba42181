"""Compliance of the flanks of a whole gear from one sector: a block-circulant system, one wave around the gear at a time.

All sectors of a gear are alike. The sector is condensed to its two cut faces and to the loads on its flank (S, one
factorisation). Where the displacements of sector j are e^{ijφ} times those of sector 0, φ = 2πk/z, the right face is
e^{iφ} times the left one, and one system of the size of a face is left for each wave number k. Loads on tooth 0 alone
are the mean of all waves, so that C_d = (1/z) Σ_k e^{idφ} Ĉ(φ).
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from fem_reference.axis import Axis
from fem_reference.sector import Section
from fem_reference.solver import schur_complement
from gearbench.geometry.material import Material


def tensor_stiffness(section: Section, axis: Axis, material: Material) -> sp.csr_matrix:
    """Upper triangle of A₀₀⊗M + A₀₁⊗G + A₀₁ᵀ⊗Gᵀ + A₁₁⊗S on the nodes that are not held; functions of the axis fastest."""
    A00, A01, A11 = section.stiffness(material)
    free = section.free
    A00, A01, A10, A11 = (A[free][:, free].tocsr() for A in (A00, A01, A01.T.tocsr(), A11))
    M, G, S = axis.products
    H = G.T.tocsr()
    for matrix in (A00, A01, A10, A11, M, G, S, H):
        matrix.sort_indices()
    n, size = A00.shape[0], axis.size
    row = np.repeat(np.arange(n), np.diff(A00.indptr))
    upper = A00.indices >= row
    row, col = row[upper], A00.indices[upper]
    parts = [A.data[upper] for A in (A00, A01, A10, A11)]
    degree, deg = np.bincount(row, minlength=n), np.diff(M.indptr)
    first = np.concatenate([[0], np.cumsum(degree)])
    rows = degree[:, None] * deg  # entries of row (i, a)
    start = np.concatenate([[0], np.cumsum(rows.ravel())])
    data, indices = np.empty(start[-1]), np.empty(start[-1], dtype=np.int32)
    within = np.arange(len(row)) - first[row]
    for a in range(size):
        part = slice(M.indptr[a], M.indptr[a + 1])
        target = start[row * size + a] + within * deg[a]
        target = (target[:, None] + np.arange(deg[a])).ravel()
        block = sum(A[:, None] * Y.data[part] for A, Y in zip(parts, (M, G, H, S), strict=True))
        indices[target] = (col[:, None] * size + M.indices[part]).ravel()
        data[target] = np.ravel(block)
    made = sp.csr_matrix((data, indices, start), shape=(n * size, n * size))
    keep = indices >= np.repeat(np.arange(n * size, dtype=np.int32), np.diff(start))
    count = np.concatenate([[0], np.cumsum(keep)])
    return sp.csr_matrix((data[keep], indices[keep], count[start]), shape=made.shape)


def flank_blocks(section: Section, axis: Axis, material: Material, order: tuple[int, int], n: int) -> tuple[NDArray, dict[str, Any]]:
    """C_d, d = −n … n, (2n+1, p·q, p·q) [mm/N] under polynomial loads on the right flank."""
    t0 = time.perf_counter()
    K = tensor_stiffness(section, axis, material)
    p, q = order
    load = np.kron(section.flank_load(p)[section.free], axis.load(q))
    t1 = time.perf_counter()
    size = axis.size
    if section.body.bore_radius is None:
        S = schur_complement(K, sp.csr_matrix(load), np.zeros(0, dtype=int))
        return -S[None], {"assembly": t1 - t0, "schur": time.perf_counter() - t1, "unknowns": K.shape[0], "nnz": K.nnz}
    number = np.full(3 * len(section.positions), -1)
    number[section.free] = np.arange(np.count_nonzero(section.free))
    faces = []
    for sign in (-1, 1):
        dofs = number[(3 * section.side(sign)[:, None] + np.arange(3)).ravel()]
        faces.append((dofs[dofs >= 0][:, None] * size + np.arange(size)).ravel())
    S = schur_complement(K, sp.csr_matrix(load), np.concatenate(faces))
    t2 = time.perf_counter()
    found, waves = circulant_compliance(S, len(faces[0]), section.body.gear.teeth, n)
    return found, {"assembly": t1 - t0, "schur": t2 - t1, "waves": time.perf_counter() - t2, "n_waves": waves, "unknowns": K.shape[0], "nnz": K.nnz, "face": len(faces[0])}


def circulant_compliance(S: NDArray, face: int, z: int, n: int) -> tuple[NDArray, int]:
    """C_d from the condensed sector S, ordered left face, right face, loads."""
    L, R, F = slice(0, face), slice(face, 2 * face), slice(2 * face, None)
    diagonal = S[L, L] + S[R, R]
    waves = wave_numbers(z)
    found = []
    for k in waves:
        turn = np.exp(2j * math.pi * k / z)
        A = diagonal + turn * S[L, R] + np.conj(turn) * S[R, L]
        B = S[L, F] + np.conj(turn) * S[R, F]
        found.append(-S[F, F] + B.conj().T @ cho_solve(cho_factor(A, lower=True), B))
    values = np.array(found)
    if len(waves) < z // 2 + 1:
        from scipy.interpolate import CubicSpline

        x = np.log(waves[1:])
        values = np.concatenate([values[:1], CubicSpline(x, values[1:], bc_type="natural")(np.log(np.arange(1, z // 2 + 1)))])
    k = np.arange(z // 2 + 1)
    weight = np.where((k == 0) | (2 * k == z), 1.0, 2.0) / z
    phase = np.exp(2j * math.pi * np.outer(np.arange(-n, n + 1), k) / z)
    return np.einsum("dk,kab->dab", phase * weight, values).real, len(waves)


def wave_numbers(z: int, dense: int = 12, growth: float = 1.15) -> NDArray:
    """Wave numbers from 0 to z/2: all up to ``dense``, then each ``growth`` times the one before."""
    k = [0]
    while k[-1] < z // 2:
        k.append(min(z // 2, k[-1] + 1 if k[-1] < dense else max(k[-1] + 1, round(growth * k[-1]))))
    return np.array(k)
