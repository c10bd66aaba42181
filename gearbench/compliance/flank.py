"""Compliance of the flanks of a gear's teeth: polynomials on the flank, and matrices between teeth d pitches apart.

Solid teeth, gear bodies and finite elements all use this form. Flank coordinates are the radius R, from form
circle to tip circle, and y = 0 … b across the face width; forces act, and displacements are measured, along the
inward normal of the right flank.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.compliance.local import flank_functions
from gearbench.geometry.gear import Gear
from gearbench.threads import lazy

if TYPE_CHECKING:
    from gearbench.compliance.lugs import LugReduction
    from gearbench.geometry.action import ContactLines

#: Relative tolerances below which directions of the compliance of a flank, and of a body beside teeth, are dropped: STE
#: changes by < 1e-7.
NEGLIGIBLE, NEGLIGIBLE_SHARED = 1e-7, 1e-6
#: Number of values of flank polynomials at a time, limited by the processor's cache.
TOGETHER = 150_000
#: Coupling between teeth, over the largest compliance, that rounding makes of none: its directions come from squares.
ROUNDING_OF_COUPLING = 1e-8


def flank_polynomials(gear: Gear, order: tuple[int, int], R: NDArray, y: NDArray) -> NDArray:
    """Products of Legendre polynomials in R and y, orthonormal in dR dy on the flank, (…, p·q) [1/mm].

    Points outside the flank take the values of the nearest point.
    """
    along = np.ascontiguousarray(flank_functions(order[0], R, gear.form_radius, gear.tip_radius))
    across = np.ascontiguousarray(flank_functions(order[1], y, 0.0, gear.face_width))
    return (along[..., :, None] * across[..., None, :]).reshape(*np.shape(R), -1)


@dataclass(frozen=True, kw_only=True, eq=False)
class FlankCompliance:
    """Smooth compliance of the teeth of a gear, for any points of their flanks.

    c(P on tooth i, Q on tooth j) = φ(P)ᵀ C_{i−j} φ(Q) with the ``flank_polynomials`` φ. This is the projection of the
    compliance onto loads that are polynomials on the flank.

    Parameters
    ----------
    gear
        The gear.
    order
        Numbers p, q of polynomials in R and y.
    blocks
        C_d [mm/N], (2n+1, p·q, p·q) for d = −n … n: displacement of tooth d under loads on tooth 0; C_{−d} = C_dᵀ.
        Teeth farther apart than n are not coupled.
    driven
        Whether the gear is the driven one of its pair. On the driving gear contact climbs towards the tip as y grows,
        and tooth d + 1 carries the next pair; on the driven gear both are mirrored.
    rank_tolerance
        Directions whose compliance is below this fraction of the largest are dropped.
    error
        Estimated relative error (Frobenius norm) of C_0, if known.
    correction
        Extrapolated ``blocks`` minus those of the finest discretisation.
    attrs
        Details of the computation: solver, unknowns, times, …
    own
        Additional compliance of each tooth under its own loads, (p·q, p·q) [mm/N], positive semidefinite together with
        block 0; see ``joined``.
    anchors
        Reduction of the ``blocks`` by lugs, different for every tooth; tooth 0 is that of pair 0.
    """

    gear: Gear
    order: tuple[int, int]
    blocks: NDArray
    driven: bool = False
    rank_tolerance: float = 1e-12
    error: float = math.nan
    correction: NDArray | None = None
    attrs: Mapping[str, Any] = field(default_factory=dict)
    own: NDArray | None = None
    anchors: LugReduction | None = None

    @property
    def neighbours(self) -> int:
        """Number n of coupled neighbours on each side."""
        return len(self.blocks) // 2

    def block(self, d: int) -> NDArray:
        """C between the tooth of the pair ``d`` ahead and the loaded tooth; zero beyond the neighbours."""
        if abs(d) > self.neighbours:
            return np.zeros(self.blocks.shape[1:])
        return self.blocks[self.neighbours + (-d if self.driven else d)]

    def at(self, i: int, j: int) -> NDArray:
        """C between the teeth of pairs i and j, counted from the one that carries pair 0."""
        body = self.block(i - j)
        if self.anchors is None:
            return body
        side = -1 if self.driven else 1
        return body + self.anchors.between(side * i, side * j)

    def shapes(self, height: ArrayLike, y: ArrayLike) -> NDArray:
        """φ (…, p·q) [1/mm] at height x = R − r_f and y [mm] along the face of the gear, as on the contact lines."""
        height, y = np.broadcast_arrays(np.asarray(height, dtype=float), np.asarray(y, dtype=float))
        across = self.gear.face_width - y if self.driven else y
        return flank_polynomials(self.gear, self.order, self.gear.root_radius + height, across)

    def root(self, pairs: int = 1, tolerance: float = 0.0) -> NDArray:
        """Square root (pair, p·q, rank) [√(mm/N)] of the block matrix C_{i−j} of teeth i of neighbouring ``pairs``.

        Directions below ``tolerance``, or ``rank_tolerance``, of the largest compliance are dropped.
        """
        least = max(tolerance, self.rank_tolerance)
        if (pairs, least) not in self._roots:
            if pairs == 1:
                basis, matrix = np.eye(len(self.block(0))), self.at(0, 0)
            else:
                basis, blocks = self.between(pairs, tolerance)
                matrix = blocks.reshape(2 * (pairs * basis.shape[1],))
            half = _positive_root(matrix, least).reshape(pairs, basis.shape[1], -1)
            self._roots[pairs, least] = basis @ half
        return self._roots[pairs, least]

    def between(self, pairs: int, tolerance: float = 0.0, first: int = 0) -> tuple[NDArray, NDArray]:
        """Significant directions B (p·q, k), and Bᵀ C_{i−j} B (pair, k, pair, k) of ``pairs``, counted from ``first``.

        Directions of one tooth whose compliance is within a tenth of ``tolerance``, or ``rank_tolerance``, of zero are
        dropped. Negative ones are raised to zero in the matrix of all teeth, because dropping a direction would also
        drop its coupling to the neighbours.
        """
        least, first = max(tolerance, self.rank_tolerance), 0 if self.anchors is None else first
        if (pairs, least, first) not in self._between:
            value, basis = self._significant(0.1 * least, negative=True)
            k = basis.shape[1]
            teeth = range(first, first + pairs)
            if self.anchors is None:
                small = {d: basis.T @ self.block(d) @ basis for d in range(-pairs + 1, pairs)} | {0: np.diag(value)}
                matrix = np.block([[small[i - j] for j in teeth] for i in teeth])
            else:
                matrix = np.block([[basis.T @ self.at(i, j) @ basis for j in teeth] for i in teeth])
            if not _is_positive(matrix):
                matrix = gram(_positive_root(matrix, least))
            self._between[pairs, least, first] = basis, matrix.reshape(pairs, k, pairs, k)
        return self._between[pairs, least, first]

    def coupling(self, pairs: int, tolerance: float = 0.0, first: int = 0) -> tuple[NDArray, NDArray]:
        """Directions B (p·q, r) in which teeth deflect each other, and Bᵀ C_{i−j} B (pair, r, pair, r) for i ≠ j.

        They are fewer than those of ``between``, because loads of short wavelength only deflect their own tooth.
        Directions whose coupling is within ``tolerance``, or ``ROUNDING_OF_COUPLING``, of zero are dropped.
        """
        least, first = max(tolerance, ROUNDING_OF_COUPLING), 0 if self.anchors is None else first
        if (pairs, least, first) not in self._coupling:
            basis, matrix = self.between(pairs, tolerance, first)
            others = matrix.copy()
            others[range(pairs), :, range(pairs)] = 0.0
            of_all = others.swapaxes(0, 1).reshape(len(others[0]), -1)
            square, direction = np.linalg.eigh(of_all @ of_all.T)
            B = direction[:, square > (least * matrix.max()) ** 2]
            self._coupling[pairs, least, first] = basis @ B, np.einsum("ka,ikjl,lb->iajb", B, others, B, optimize=True)
        return self._coupling[pairs, least, first]

    def same_tooth(self, pairs: int, tolerance: float = 0.0, first: int = 0) -> list[NDArray]:
        """Square roots (p·q, rank) of the compliances C_ii of ``between`` by pair, with ``own`` added, if given.

        Negative directions, as small as those dropped between teeth, are dropped.
        """
        first = 0 if self.anchors is None else first
        if (pairs, tolerance, first) not in self._same_tooth:
            basis, matrix = self.between(pairs, tolerance, first)
            alike = 1 if self.anchors is None else pairs
            roots = [self._of_one(basis, matrix[i, :, i]) for i in range(alike)]
            self._same_tooth[pairs, tolerance, first] = roots * (pairs // alike)
        return self._same_tooth[pairs, tolerance, first]

    def _of_one(self, basis: NDArray, block: NDArray) -> NDArray:
        """``same_tooth`` of one pair, from its block (k, k) of ``between``."""
        if self.own is not None:
            return _positive_root(self.own + basis @ block @ basis.T, self.rank_tolerance)
        diagonal = _is_diagonal(block)
        return basis @ (np.sqrt(np.maximum(block, 0.0)) if diagonal else _positive_root(block, self.rank_tolerance))

    def _significant(self, tolerance: float, *, negative: bool = False) -> tuple[NDArray, NDArray]:
        """Compliances above ``tolerance`` of the largest, (rank,), and their directions, (p·q, rank).

        With ``negative``, compliances as far below zero are included.
        """
        value, vector = np.linalg.eigh(self.at(0, 0))
        significant = (np.abs(value) if negative else value) > tolerance * value[-1]
        return value[significant], vector[:, significant]

    @lazy
    def _roots(self) -> dict[tuple[int, float], NDArray]:
        return {}

    @lazy
    def _between(self) -> dict[tuple[int, float, int], tuple[NDArray, NDArray]]:
        return {}

    @lazy
    def _coupling(self) -> dict[tuple[int, float, int], tuple[NDArray, NDArray]]:
        return {}

    @lazy
    def _same_tooth(self) -> dict[tuple[int, float, int], list[NDArray]]:
        return {}

    def factor(self, height: ArrayLike, y: ArrayLike, pair: int = 0, pairs: int = 1) -> NDArray:
        """Ψ (…, rank) [√(mm/N)] on the tooth of one of ``pairs`` neighbouring pairs; x = R − r_f [mm].

        Ψ(a) · Ψ(b) is the deflection at a due to a unit force at b, on the same tooth or on different ones.
        """
        return self.shapes(height, y) @ self.root(pairs)[pair]

    def deflection(self, x: ArrayLike, y: ArrayLike, x0: ArrayLike, y0: ArrayLike, d: int = 0) -> NDArray:
        """Deflection [mm/N] at (x, y) on the tooth of the pair ``d`` ahead, under a unit force at (x0, y0).

        Directions that ``factor`` drops are left out, because C of a solid tooth of low order has negative ones.
        """
        _, basis = self._significant(self.rank_tolerance)
        block = basis.T @ self.block(d) @ basis
        return np.einsum("...a,ab,...b->...", self.shapes(x, y) @ basis, block, self.shapes(x0, y0) @ basis)


@lru_cache(maxsize=256)
def joined(tooth: FlankCompliance, shared: FlankCompliance) -> FlankCompliance:
    """Sum of a compliance ``tooth`` that each tooth has by itself, and one ``shared`` by all teeth of a gear.

    Close to the root a clamped tooth yields less than the half-space of the contact law, so its compliance has negative
    directions, which the body compensates. Negative directions of the sum are raised to zero (``docs/theory.md``).

    Raises
    ------
    ValueError
        If they are not of the same polynomials, or the first one is shared too.
    """
    if (tooth.gear, tooth.order, tooth.driven) != (shared.gear, shared.order, shared.driven) or tooth.neighbours:
        raise ValueError("only compliances on the same polynomials add up, one of them of single teeth")
    alone = shared.at(0, 0)
    total = alone + tooth.block(0)
    if not shared.neighbours:
        return replace(shared, blocks=total[None])
    value, vector = np.linalg.eigh(total)
    return replace(shared, own=(vector * np.maximum(value, 0.0)) @ vector.T - alone)


def gram(factor: NDArray) -> NDArray:
    """Ψ Ψᵀ of many Ψ (…, n, m) at once, (…, n, n)."""
    return factor @ np.swapaxes(factor, -1, -2)


def _is_diagonal(matrix: NDArray) -> bool:
    return len(matrix) == matrix.shape[1] and np.count_nonzero(matrix) == np.count_nonzero(np.diagonal(matrix))


def _is_positive(matrix: NDArray) -> bool:
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True


def _positive_root(matrix: NDArray, tolerance: float) -> NDArray:
    """Square root (n, rank) without the directions below ``tolerance`` of the largest."""
    value, vector = np.linalg.eigh(matrix)
    keep = value > tolerance * value[-1]
    return vector[:, keep] * np.sqrt(value[keep])


def flank_factor(flanks: Sequence[FlankCompliance], lines: ContactLines) -> NDArray:
    """Ψ of the flanks of pinion and wheel side by side, (position, pair, segment, rank) [√(mm/N)]."""
    both = [_times(_on_lines(flanks[index], lines, index), flanks[index].root(1, NEGLIGIBLE)[0]) for index in (0, 1)]
    factor = np.zeros((*lines.shape, sum(values.shape[2] for values in both)))
    column = 0
    for values in both:
        factor.swapaxes(0, 1)[lines.active.T, :, column : column + values.shape[2]] = values
        column += values.shape[2]
    return factor


def flank_matrix(flanks: Sequence[FlankCompliance], lines: ContactLines) -> NDArray:
    """H of the flanks of pinion and wheel with coupled teeth, (position, n, n) [mm/N], n = pair · segment."""
    positions, pairs, segments = lines.shape
    H = np.zeros((positions, pairs, segments, pairs, segments))
    size = pairs * segments * max(len(flank.block(0)) for flank in flanks)
    together = max(1, TOGETHER // size)
    for first in range(0, positions, together):
        chunk = slice(first, first + together)
        _fill(H[chunk], flanks, lines.part(chunk))
    return H.reshape(positions, pairs * segments, -1)


def _fill(H: NDArray, flanks: Sequence[FlankCompliance], lines: ContactLines) -> None:
    """``flank_matrix`` of a few positions, into zeros."""
    (positions, pairs, _), active = lines.shape, lines.active
    both_gears = [_directions_on_lines(flanks[index], lines, index) for index in (0, 1)]
    # number of each line in the arrays of ``_directions_on_lines``
    number = np.cumsum(active.T.ravel()).reshape(pairs, positions) - 1
    for i in range(pairs):
        for j in range(i + 1):
            # positions at which both pairs have a line
            shared = np.flatnonzero(active[:, i] & active[:, j])
            if not shared.size:
                continue
            of_i, of_j = _run(number[i, shared]), _run(number[j, shared])
            if i == j:
                block = sum(gram(S[of_i]) for _, _, S in both_gears)
            else:
                block = sum(X[of_i] @ C[i, :, j] @ np.swapaxes(X[of_j], 1, 2) for X, C, _ in both_gears)
            H[shared, i, :, j] = block
            if i != j:
                H[shared, j, :, i] = np.swapaxes(block, 1, 2)


def _directions_on_lines(flank: FlankCompliance, lines: ContactLines, index: int) -> tuple[NDArray, NDArray, NDArray]:
    """Directions X (line, segment, r) of the ``coupling`` on the lines, C (pair, r, pair, r) between them, and Ψ.

    Ψ (line, segment, rank) is the square root of the compliance under loads on the same tooth.
    """
    shapes, pairs, first = _on_lines(flank, lines, index), lines.shape[1], int(lines.index[0])
    tolerance = NEGLIGIBLE if flank.own is None else NEGLIGIBLE_SHARED
    basis, matrix = flank.coupling(pairs, tolerance, first)
    X, roots = _times(shapes, basis), flank.same_tooth(pairs, tolerance, first)
    if flank.anchors is None:
        return X, matrix, _times(shapes, roots[0])
    ends = np.cumsum(np.count_nonzero(lines.active, axis=0))[:-1]
    width, parts = max(root.shape[1] for root in roots), np.split(shapes, ends)
    return (
        X,
        matrix,
        np.concatenate([_times(part, _wide(root, width)) for part, root in zip(parts, roots, strict=True)]),
    )


def _wide(root: NDArray, width: int) -> NDArray:
    """A square root (n, rank), with columns of zeros appended up to a ``width``."""
    return np.pad(root, ((0, 0), (0, width - root.shape[1])))


def _times(X: NDArray, C: NDArray) -> NDArray:
    """X C, (…, k), as one product; C of a single tooth is usually diagonal."""
    if _is_diagonal(C):
        return X * np.diagonal(C)
    return (X.reshape(-1, len(C)) @ C).reshape(*X.shape[:-1], C.shape[1])


def _run(rows: NDArray) -> slice | NDArray:
    """Rows as a slice where they follow one another, so that nothing is copied."""
    return slice(rows[0], rows[-1] + 1) if rows[-1] - rows[0] == rows.size - 1 else rows


def _on_lines(flank: FlankCompliance, lines: ContactLines, index: int) -> NDArray:
    """Flank polynomials of a gear on the lines that exist, (line, segment, p·q).

    Lines of a pair follow one another.
    """
    exists = lines.active.T
    height = lines.radii[index].swapaxes(0, 1)[exists] - flank.gear.root_radius
    return flank.shapes(height, lines.gear_y(index).swapaxes(0, 1)[exists])
