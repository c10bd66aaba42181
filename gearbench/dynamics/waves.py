"""From complex orders to curves over the period and their numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def curve(orders: NDArray, points: int) -> NDArray:
    """Values (…, point) at equal steps of the period of Σ ŷ_n e^{inωt}, from orders 0 … H (…, H + 1)."""
    full = np.zeros((*orders.shape[:-1], points // 2 + 1), dtype=complex)
    full[..., : orders.shape[-1]] = orders
    return np.fft.irfft(full, n=points, axis=-1) * points


def with_mean(orders: NDArray) -> NDArray:
    """Orders 0 … H (…, H + 1) of a zero-mean fluctuation with the orders 1 … H."""
    return np.concatenate([np.zeros_like(orders[..., :1]), orders], axis=-1)


def points(orders: int) -> int:
    """Points of a period on which the peaks of orders up to H are found to about one percent."""
    return 16 * max(orders, 1)


def rms(orders: NDArray) -> NDArray:
    """RMS (…,) of the fluctuation."""
    return np.sqrt(2 * (np.abs(orders[..., 1:]) ** 2).sum(axis=-1))


def amplitude(orders: NDArray) -> NDArray:
    """Amplitudes (…, H) of orders 1 … H."""
    return 2 * np.abs(orders[..., 1:])


def phase(orders: NDArray) -> NDArray:
    """Phases (…, H) [rad] of orders 1 … H: y = Σ amplitude · cos(nωt + phase)."""
    return np.angle(orders[..., 1:])


def highest(orders: NDArray, index: NDArray, points: int) -> NDArray:
    """Largest value (…,) of Σ ŷ_s e^{i s·φ} over all phases φ of frequencies that have no common period.

    Frequency by frequency to the highest point, starting at the highest points of each frequency; combinations of two
    frequencies are small.

    Parameters
    ----------
    orders
        ŷ_s without the mean (…, order), those of a negative s left out.
    index
        s, multiples of the frequencies (order, frequency).
    points
        Points of a period.
    """
    *shape, frequencies = *orders.shape[:-1], index.shape[1]
    phase = np.zeros((*shape, frequencies))
    alone = np.count_nonzero(index, axis=1) == 1
    for first in (True, False) if frequencies > 1 else (True,):
        for along in range(frequencies):
            here = np.flatnonzero((index[:, along] != 0) & (alone | (not first)))
            n, others = index[here, along], np.delete(index[here], along, axis=1)
            turned = orders[..., here] * np.exp(1j * np.delete(phase, along, axis=-1) @ others.T)
            turned = np.where(n > 0, turned, np.conj(turned))
            own = np.zeros((*shape, np.abs(n).max(initial=0) + 1), dtype=complex)
            for k, order in enumerate(np.abs(n)):
                own[..., order] += turned[..., k]
            at = curve(own, points).argmax(axis=-1)
            phase[..., along] = 2 * np.pi * at / points
    return 2 * np.real(orders * np.exp(1j * (phase @ index.T))).sum(axis=-1)
