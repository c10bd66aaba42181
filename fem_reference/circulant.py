"""Compliance of the flanks of a whole gear from one sector: a block-circulant system, solved wave by wave.

All sectors of a gear are equal. A sector is condensed to its two cut faces and to the loads on its flank (S, one
factorisation). Where the displacements of sector j are e^{ijφ} times those of sector 0, φ = 2πk/z, the right face is
e^{iφ} times the left one, and one system of the size of a face remains for each wave number k. A load on tooth 0 alone
is the mean of all waves, so C_d = (1/z) Σ_k e^{idφ} Ĉ(φ).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from fem_reference.axis import FaceFunctions
from fem_reference.outside import Outside
from fem_reference.sector import Section
from fem_reference.solver import schur_complement
from fem_reference.waves import blocks_of_waves, wave_numbers
from gearbench.compliance.lugs import LugReduction
from gearbench.geometry.material import Material


def tensor_stiffness(section: Section, axis: FaceFunctions, there: NDArray, material: Material) -> sp.csr_matrix:
    """Upper triangle of A₀₀⊗M + A₀₁⊗G + A₁₀⊗Gᵀ + A₁₁⊗S on the free nodes, M = ∫hh, G = ∫hh′, S = ∫h′h′.

    A web adds its own sum of these, with integrals over its own width.

    ``there``: whether each free degree of freedom of the section has each function along the axis; the functions of one
    degree of freedom follow each other.
    """
    of_web = section.of_web
    found = _tensor(section.stiffness(material, ~of_web), section.free, axis.integrals(), there)
    if of_web.any():
        narrow = axis.integrals((section.body.web_piece,))
        found = sp.csr_matrix(found + _tensor(section.stiffness(material, of_web), section.free, narrow, there))
        found.sort_indices()
    return found


def _tensor(parts: Sequence[sp.csr_array], free: NDArray, integrals: NDArray, there: NDArray) -> sp.csr_matrix:
    """Upper triangle of the sum of products of A₀₀, A₀₁ and A₁₁ with ``integrals`` (2, 2, count, count)."""
    parts = [A[free][:, free].tocsr() for A in (parts[0], parts[1], parts[1].T.tocsr(), parts[2])]
    for A in parts:
        A.sort_indices()
    n, count = there.shape
    row = np.repeat(np.arange(n), np.diff(parts[0].indptr))
    upper = parts[0].indices >= row
    row, col = row[upper], parts[0].indices[upper]
    values = np.stack([A.data[upper] for A in parts])
    of_axis = integrals.reshape(4, count, count)
    band = [np.flatnonzero(of_axis[:, a].any(axis=0)) for a in range(count)]
    number = np.bincount(row, minlength=n)
    first = np.concatenate([[0], np.cumsum(number)])
    entries = number[:, None] * np.array([len(b) for b in band])
    start = np.concatenate([[0], np.cumsum(entries.ravel())])
    data, indices = np.zeros(start[-1]), np.zeros(start[-1], dtype=np.int32)
    within = np.arange(len(row)) - first[row]
    for a in range(count):
        target = (start[row * count + a] + within * len(band[a]))[:, None] + np.arange(len(band[a]))
        data[target] = values.T @ of_axis[:, a, band[a]]
        indices[target] = col[:, None] * count + band[a]
    row_there, number = np.flatnonzero(there), (np.cumsum(there) - 1).astype(np.int32)
    whole = np.repeat(np.arange(n * count), np.diff(start))
    keep = (indices >= whole) & (data != 0) & there.ravel()[indices] & there.ravel()[whole]
    kept = np.concatenate([[0], np.cumsum(keep)])
    pointer = np.append(kept[start[row_there]], kept[-1])
    return sp.csr_matrix((data[keep], number[indices[keep]], pointer), shape=(len(row_there),) * 2)


def flank_blocks(
    section: Section,
    axis: FaceFunctions,
    there: NDArray,
    material: Material,
    order: tuple[int, int],
    n: int,
    *,
    across: bool = False,
) -> tuple[NDArray, LugReduction | None]:
    """C_d, d = −n … n, (2n+1, p·q, p·q) [mm/N] of right flanks under polynomial loads on the right flank, and lugs.

    Parameters
    ----------
    section
        The section of a sector with its body, or of a tooth alone (n = 0).
    axis, there
        Functions along the axis, and whether each free degree of freedom of the section has them.
    order
        Numbers p, q of polynomials of the loads along height and face width.
    across
        Loads on the left flank instead, which is the right one of the gear turned over.
    """
    body, loads = section.body, order[0] * order[1]
    z, further = abs(body.gear.teeth), []
    if across:
        over = axis.load(order[1]) * (-1.0) ** np.arange(order[1])
        further.append(sp.kron(section.flank_load(order[0], left=True)[section.free], over))
    acting = slice(loads, 2 * loads) if across else slice(loads)
    if body.support != (0.0, 0.0):
        S, face = condensed_sector(section, axis, there, material, order, further)
        if body.bore_radius is None:
            return -S[None], None
        return blocks_of_waves(wave_compliance(S, face, z)[:, :loads, acting], z, n), None
    outside = Outside(section=section, axis=axis)
    further.append(outside.functionals())
    S, face = condensed_sector(section, axis, there, material, order, further)
    grip = material.E / abs(section.held_radius) if body.lugs else math.inf
    waves = wave_compliance(S, face, z, rigid=outside.rigid(S.shape[0] - 2 * face, grip))
    anchors = None if body.lugs is None else outside.anchors(waves, loads, grip)
    return blocks_of_waves(waves[:, :loads, acting], z, n), anchors


def condensed_sector(
    section: Section,
    axis: FaceFunctions,
    there: NDArray,
    material: Material,
    order: tuple[int, int],
    further: Sequence[sp.csr_array] = (),
) -> tuple[NDArray, int]:
    """The sector condensed to left face, right face and polynomial loads, and the number of unknowns of a face.

    ``further``: columns of more loads, for all functions along the axis at each degree of freedom.
    """
    stiffness = tensor_stiffness(section, axis, there, material)
    loads = [sp.kron(section.flank_load(order[0])[section.free], axis.load(order[1]))]
    loads += further
    load = sp.csr_matrix(sp.csr_array(sp.hstack(loads))[there.ravel()])
    if section.body.bore_radius is None:
        return schur_complement(stiffness, load, np.zeros(0, dtype=np.int64)), 0
    number = np.where(section.free, np.cumsum(section.free) - 1, -1)
    unknown = np.where(there, np.cumsum(there).reshape(there.shape) - 1, -1)
    faces = []
    for sign in (-1, 1):
        dofs = number[(3 * section.side(sign)[:, None] + np.arange(3)).ravel()]
        at = unknown[dofs[dofs >= 0]].ravel()
        faces.append(at[at >= 0])
    return schur_complement(stiffness, load, np.concatenate(faces)), len(faces[0])


def circulant_compliance(S: NDArray, face: int, z: int, n: int, loads: int | None = None) -> NDArray:
    """C_d, d = −n … n, from the condensed sector S: left face, right face, loads; under the first ``loads`` of them."""
    return blocks_of_waves(wave_compliance(S, face, z, loads), z, n)


def wave_compliance(
    S: NDArray, face: int, z: int, loads: int | None = None, rigid: tuple[list[NDArray], float] | None = None
) -> NDArray:
    """Ĉ of the waves ``wave_numbers(z)`` from the condensed sector S, (wave, load, load); see ``circulant_compliance``.

    ``rigid``: combinations (load, …) of the loads that hold the waves 0 and 1 of a free ring by springs, and their
    stiffness.
    """
    L, R, F = slice(0, face), slice(face, 2 * face), slice(2 * face, None)
    diagonal, waves = S[L, L] + S[R, R], wave_numbers(z)
    found = np.empty((len(waves), *S[F, F][:, :loads].shape), complex)
    for i, k in enumerate(waves):
        turn = np.exp(2j * math.pi * k / z)
        A = diagonal + turn * S[L, R] + np.conj(turn) * S[R, L]
        B = S[L, F] + np.conj(turn) * S[R, F]
        if rigid is not None and k < len(rigid[0]):
            e, stiffness = rigid[0][k], rigid[1]
            held, own = B @ e, e.conj().T @ S[F, F] @ e - np.eye(e.shape[1]) / stiffness
            X = np.linalg.solve(np.block([[A, -held], [-held.conj().T, own]]), np.vstack([B, -e.conj().T @ S[F, F]]))
            found[i] = B.conj().T @ X[:face] - S[F, F] - S[F, F] @ e @ X[face:]
            continue
        X = cho_solve(cho_factor(A, lower=True, overwrite_a=True), B[:, :loads])
        found[i] = B.conj().T @ X - S[F, F][:, :loads]
    return found
