"""Curves over the period from complex orders, and their amplitude, phase, RMS and peak."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def curve(orders: NDArray, points: int) -> NDArray:
    """Values (…, point) at equal steps of the period of Σ ŷ_n e^{inωt}, from orders 0 … H (…, H + 1)."""
    full = np.zeros((*orders.shape[:-1], points // 2 + 1), dtype=complex)
    full[..., : orders.shape[-1]] = orders
    return np.fft.irfft(full, n=points, axis=-1) * points


def with_mean(orders: NDArray) -> NDArray:
    """Orders 0 … H (…, H + 1) of a fluctuation without mean, from its orders 1 … H (…, H)."""
    return np.concatenate([np.zeros_like(orders[..., :1]), orders], axis=-1)


def points(orders: int) -> int:
    """Number of points of a period that resolve peaks of orders up to ``orders`` to 2 %, since cos(π/16) = 0.981."""
    return 16 * max(orders, 1)


def rms(orders: NDArray) -> NDArray:
    """RMS (…,) of the fluctuation with the orders 0 … H (…, H + 1), without its mean."""
    return np.sqrt(2 * (np.abs(orders[..., 1:]) ** 2).sum(axis=-1))


def amplitude(orders: NDArray) -> NDArray:
    """Amplitudes (…, H) of orders 1 … H."""
    return 2 * np.abs(orders[..., 1:])


def spectrum(name: str, dims: tuple[str, ...], orders: NDArray, unit: float = 1.0) -> dict[str, tuple[Any, NDArray]]:
    """Variables of a Dataset, ``NAME_amplitude`` and ``NAME_phase`` [rad], of the complex orders 1 … H of y.

    y = Σ amplitude · cos(nωt + phase). ``orders`` have the dimensions ``dims``; amplitudes are multiplied by ``unit``.
    """
    return {f"{name}_amplitude": (dims, 2 * unit * np.abs(orders)), f"{name}_phase": (dims, np.angle(orders))}


def highest(orders: NDArray, index: NDArray, point_count: int) -> NDArray:
    """Largest value (…,) of Σ ŷ_s e^{i s·φ} over all phases φ of one frequency, or of several without a common period.

    The phase of each frequency first maximises the orders of this frequency alone. With several frequencies a second
    pass over the phases includes the combinations, which are small: a third pass would change little.

    Parameters
    ----------
    orders
        ŷ_s (…, order) without the mean; only one of s and −s is given.
    index
        s as multiples of the frequencies (order, frequency).
    point_count
        Number of points of a period.
    """
    *shape, frequencies = *orders.shape[:-1], index.shape[1]
    phase = np.zeros((*shape, frequencies))
    alone = np.count_nonzero(index, axis=1) == 1
    for first_pass in (True, False) if frequencies > 1 else (True,):
        for frequency in range(frequencies):
            orders_of_frequency = np.flatnonzero((index[:, frequency] != 0) & (alone | (not first_pass)))
            n, others = index[orders_of_frequency, frequency], np.delete(index[orders_of_frequency], frequency, axis=1)
            rotated = orders[..., orders_of_frequency] * np.exp(1j * np.delete(phase, frequency, axis=-1) @ others.T)
            rotated = np.where(n > 0, rotated, np.conj(rotated))
            amplitudes = np.zeros((*shape, np.abs(n).max(initial=0) + 1), dtype=complex)
            for k, order in enumerate(np.abs(n)):
                amplitudes[..., order] += rotated[..., k]
            step = curve(amplitudes, point_count).argmax(axis=-1)
            phase[..., frequency] = 2 * np.pi * step / point_count
    return 2 * np.real(orders * np.exp(1j * (phase @ index.T))).sum(axis=-1)
