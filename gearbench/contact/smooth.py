"""Smooth compliance of the segments, summed over the effects and cached.

The smooth compliance is all compliance but the contact law. It depends only on the macro-geometry and the positions of
the nodes, not on micro-geometry, errors or load. At phases that are the same for all variants of a pair (uniform phases
and those of ``gearbench.contact.coarse_solution``) it is therefore computed once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.problem import gram
from gearbench.effects.base import ComplianceEffect, Dense, Effects, FlankPair, LineLaw, LowRank
from gearbench.geometry.action import ContactLines

#: Number of cached sums, and maximum size of one [bytes].
CACHED_SUMS, LARGEST_CACHED = 8, 8e6


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothCompliance:
    """Sum of the smooth compliances of the segments of some lines; never changed.

    Parameters
    ----------
    laws
        Effects whose compliance is a contact law; they are not part of the sum.
    factor
        Ψ (position, pair, segment, rank) [√(mm/N)] of tooth pairs that deflect independently; rank 0 with a ``matrix``.
    matrix
        H (position, n, n) [mm/N] with n = pair · segment, zero for absent lines; None if tooth pairs deflect
        independently and there is a contact law.
    """

    laws: tuple[ComplianceEffect, ...]
    factor: NDArray
    matrix: NDArray | None


def smooth_compliance(lines: ContactLines, effects: Effects) -> tuple[SmoothCompliance, list[LineLaw]]:
    """Sum of the smooth compliances of the acting ``effects``, and the contact laws among them."""
    if 8 * lines.shape[0] * (lines.shape[1] * lines.shape[2]) ** 2 > LARGEST_CACHED:
        return _summed(lines, effects)
    smooth = _cached_sum(_CacheKey(lines, dict(effects)))
    return smooth, _contact_laws([effect.compliance(lines, effects) for effect in smooth.laws])


def _compliance_effects(effects: Effects) -> tuple[ComplianceEffect, ...]:
    return tuple(effect for effect in effects.values() if isinstance(effect, ComplianceEffect))


def _summed(lines: ContactLines, effects: Effects) -> tuple[SmoothCompliance, list[LineLaw]]:
    """``smooth_compliance`` without the cache."""
    flanks: dict[ComplianceEffect, FlankPair] = {}
    parts: dict[ComplianceEffect, LowRank | Dense | LineLaw] = {}
    for effect in _compliance_effects(effects):
        if (flank_pair := effect.flank_compliances(lines, effects)) is None:
            parts[effect] = effect.compliance(lines, effects)
        else:
            flanks[effect] = flank_pair
    laws = tuple(effect for effect, part in parts.items() if isinstance(part, LineLaw))
    line_laws = _contact_laws(parts.values())
    smooth = [part for part in parts.values() if not isinstance(part, LineLaw)]
    smooth += [part.on(lines) for part in join_tooth_and_body(list(flanks.values()))]
    independent = [part for part in smooth if isinstance(part, LowRank) and not part.coupled]
    factor, matrix = np.zeros((*lines.shape, 0)), None
    # without a contact law the unit of displacement follows from the matrix
    if laws and len(independent) == len(smooth):
        factor = np.concatenate([factor, *(part.factor for part in independent)], axis=-1)
    else:
        matrix = _coupled_matrix(smooth, lines)
    return SmoothCompliance(laws=laws, factor=factor, matrix=matrix), line_laws


def join_tooth_and_body(parts: list[FlankPair]) -> list[FlankPair]:
    """Join teeth and the bodies on which they stand into one compliance, if both use the same polynomials."""
    if len(parts) != 2 or all(part.coupled for part in parts):
        return parts
    from gearbench.compliance.flank import joined

    teeth, bodies = sorted(parts, key=lambda part: part.coupled)
    if any(tooth.order != body.order for tooth, body in zip(teeth.both, bodies.both, strict=True)):
        return parts
    pinion, wheel = (joined(tooth, body) for tooth, body in zip(teeth.both, bodies.both, strict=True))
    return [FlankPair(both=(pinion, wheel), coupled=bodies.coupled)]


def _contact_laws(parts: Iterable[object]) -> list[LineLaw]:
    return [part for part in parts if isinstance(part, LineLaw)]


class _CacheKey:
    """Cache key with everything on which a sum of compliances depends."""

    def __init__(self, lines: ContactLines, effects: Effects) -> None:
        self.arguments = lines, effects
        digest = hashlib.blake2b()
        for array in (lines.u, lines.y, lines.active):
            digest.update(array.tobytes())
        pair = lines.pair, lines.shape, lines.coast, lines.separation
        self._key = _compliance_effects(effects), tuple(effects), pair, digest.digest()

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _CacheKey) and self._key == other._key


@lru_cache(maxsize=CACHED_SUMS)
def _cached_sum(key: _CacheKey) -> SmoothCompliance:
    return _summed(*key.arguments)[0]


def clear_compliance_cache() -> None:
    """Clear the cache of sums, so that they are computed again."""
    _cached_sum.cache_clear()


def _coupled_matrix(parts: Sequence[LowRank | Dense], lines: ContactLines) -> NDArray:
    """H (position, n, n), the sum of the ``parts`` as full matrices; zero for absent lines."""
    positions, pairs, segments = lines.shape
    H = np.zeros((positions, pairs, segments, pairs, segments))
    whole = H.reshape(positions, pairs * segments, -1)
    position, pair = np.nonzero(lines.active)
    for part in parts:
        if isinstance(part, Dense):
            whole += part.matrix if part.positive else _without_negative_eigenvalues(part.matrix, lines)
        elif part.coupled:
            factor = part.factor.reshape(*whole.shape[:2], -1)
            for pattern in np.unique(lines.active, axis=0):  # only existing lines are multiplied
                alike, rows = np.all(lines.active == pattern, axis=1), np.repeat(pattern, segments)
                whole[np.ix_(alike, rows, rows)] += gram(factor[np.ix_(alike, rows)])
        else:
            H[position, pair, :, pair] += gram(part.factor[position, pair])
    absent = np.nonzero(~lines.active)
    H[absent], H[absent[0], :, :, absent[1]] = 0.0, 0.0
    return whole


def _without_negative_eigenvalues(matrix: NDArray, lines: ContactLines) -> NDArray:
    """Dense compliance (position, n, n) on existing lines, with negative eigenvalues set to zero.

    H = Ψ Ψᵀ has no negative eigenvalues; in the given ``matrix`` they are errors of its model, or rounding.
    """
    active = np.repeat(lines.active, lines.shape[2], axis=1)
    value, vector = np.linalg.eigh(np.where(active[:, :, None] & active[:, None, :], matrix, 0.0))
    return gram(vector * np.sqrt(np.maximum(value, 0.0))[:, None, :])
