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
    """Orders 0 … H (…, H + 1) of what fluctuates by orders 1 … H about zero."""
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
