"""Smooth compliance of the segments, summed over the effects and cached.

It depends only on the macro-geometry and the positions of the nodes, not on micro-geometry, errors or load. At uniform
phases, and at the phases of coarse solutions, it is therefore the same for all variants of a pair.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.problem import gram
from gearbench.effects.base import ComplianceEffect, Dense, Effect, Flanks, LineLaw, LowRank
from gearbench.geometry.action import ContactLines

#: Number of cached sums, and maximum size of one [bytes].
KEPT, LARGEST = 8, 8e6


@dataclass(frozen=True, kw_only=True, eq=False)
class Smooth:
    """Sum of the smooth compliances of the segments of some lines; never changed.

    Parameters
    ----------
    laws
        Effects that add compliance as contact laws, and are not part of the sum.
    factor
        Ψ (position, pair, segment, rank) [√(mm/N)], if tooth pairs deflect independently.
    matrix
        H (position, n, n) [mm/N] with n = pair · segment, zero for absent lines; None if tooth pairs deflect
        independently.
    """

    laws: tuple[ComplianceEffect, ...]
    factor: NDArray
    matrix: NDArray | None


def smooth_compliance(
    adding: Sequence[ComplianceEffect], lines: ContactLines, effects: Mapping[str, Effect]
) -> tuple[Smooth, list[LineLaw]]:
    """Sum of the smooth compliances of the effects ``adding`` compliance, and the contact laws among them.

    ``effects`` are all acting effects by name.
    """
    if 8 * lines.shape[0] * (lines.shape[1] * lines.shape[2]) ** 2 > LARGEST:
        smooth, laws = _summed(adding, lines, effects)
        return smooth, laws
    smooth = _kept(_Key(tuple(adding), lines, dict(effects)))
    return smooth, _only_laws([effect.compliance(lines, effects) for effect in smooth.laws])


def _summed(
    adding: Sequence[ComplianceEffect], lines: ContactLines, effects: Mapping[str, Effect]
) -> tuple[Smooth, list[LineLaw]]:
    flanks = {effect: found for effect in adding if (found := effect.flank_compliances(lines, effects)) is not None}
    parts = {effect: effect.compliance(lines, effects) for effect in adding if effect not in flanks}
    laws = tuple(effect for effect, part in parts.items() if isinstance(part, LineLaw))
    found = _only_laws(list(parts.values()))
    smooth = [part for part in parts.values() if not isinstance(part, LineLaw)]
    del parts
    smooth += [part.on(lines) for part in joined_flanks(list(flanks.values()))]
    own = [part for part in smooth if isinstance(part, LowRank) and not part.coupled]
    if laws and len(own) == len(smooth):
        return Smooth(laws=laws, factor=_own_factor(own, lines), matrix=None), found
    none = np.zeros((*lines.shape, 0))
    return Smooth(laws=laws, factor=none, matrix=_shared_compliance(smooth, lines)), found


def joined_flanks(parts: list[Flanks]) -> list[Flanks]:
    """Join teeth and the bodies on which they stand into one compliance, if both use the same polynomials."""
    if len(parts) != 2 or all(part.coupled for part in parts):
        return parts
    from gearbench.compliance.flank import joined

    own, shared = sorted(parts, key=lambda part: part.coupled)
    if any(one.order != other.order for one, other in zip(own.both, shared.both, strict=True)):
        return parts
    pinion, wheel = (joined(one, other) for one, other in zip(own.both, shared.both, strict=True))
    return [Flanks(both=(pinion, wheel), coupled=shared.coupled)]


def _only_laws(parts: Sequence[object]) -> list[LineLaw]:
    return [part for part in parts if isinstance(part, LineLaw)]


class _Key:
    """Cache key with everything on which a sum of compliances depends."""

    def __init__(
        self, adding: tuple[ComplianceEffect, ...], lines: ContactLines, effects: Mapping[str, Effect]
    ) -> None:
        self.arguments = adding, lines, effects
        digest = hashlib.blake2b()
        for array in (lines.u, lines.y, lines.active):
            digest.update(array.tobytes())
        names = tuple(effects)
        self._key = adding, names, lines.pair, lines.shape, lines.coast, lines.separation, digest.digest()

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._key == other._key


@lru_cache(maxsize=KEPT)
def _kept(key: _Key) -> Smooth:
    return _summed(*key.arguments)[0]


def forget_sums() -> None:
    """Clear the cache of sums, to measure their computation."""
    _kept.cache_clear()


def _own_factor(parts: Sequence[LowRank], lines: ContactLines) -> NDArray:
    """Ψ (position, pair, segment, rank) of the sum, if tooth pairs deflect independently."""
    return np.concatenate([np.zeros((*lines.shape, 0)), *(part.factor for part in parts)], axis=-1)


def _shared_compliance(parts: Sequence[LowRank | Dense], lines: ContactLines) -> NDArray:
    """H (position, n, n) of the sum, if tooth pairs deflect each other; zero for absent lines."""
    positions, pairs, segments = lines.shape
    H = np.zeros((positions, pairs, segments, pairs, segments))
    whole = H.reshape(positions, pairs * segments, -1)
    position, pair = np.nonzero(lines.active)
    for part in parts:
        if isinstance(part, Dense):
            whole += part.matrix if part.positive else _without_negative(part.matrix, lines)
        elif part.coupled:
            factor = part.factor.reshape(*whole.shape[:2], -1)
            for pattern in np.unique(lines.active, axis=0):  # only existing lines are multiplied
                alike, rows = np.all(lines.active == pattern, axis=1), np.repeat(pattern, segments)
                whole[np.ix_(alike, rows, rows)] += gram(factor[np.ix_(alike, rows)])
        else:
            H[position, pair, :, pair] += gram(part.factor[position, pair])
    active = np.repeat(lines.active, segments, axis=1)
    whole *= active[:, :, None] & active[:, None, :]
    return whole


def _without_negative(matrix: NDArray, lines: ContactLines) -> NDArray:
    """Dense compliance (position, n, n) on existing lines, with negative eigenvalues set to zero."""
    active = np.repeat(lines.active, lines.shape[2], axis=1)
    value, vector = np.linalg.eigh(np.where(active[:, :, None] & active[:, None, :], matrix, 0.0))
    return gram(vector * np.sqrt(np.maximum(value, 0.0))[:, None, :])
