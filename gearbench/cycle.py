"""A variable over the mesh cycle, from the phases it was computed at: curves between the transitions, mesh orders."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from gearbench.scene import Resolution

if TYPE_CHECKING:
    import xarray as xr


def panel_size(dataset: xr.Dataset) -> int | None:
    """Gauss points on each panel of the dataset's mesh phases; None where they are uniform."""
    return Resolution(**tomllib.loads(dataset.attrs["scene"]).get("resolution", {})).panel_size


def panels(dataset: xr.Dataset, name: str, points: int = 40) -> list[tuple[NDArray, NDArray]]:
    """Curves (phase, value) of a variable of the mesh cycle between its jumps, each with ``points`` points.

    Gauss points determine a polynomial on each panel, which is evaluated up to the transitions. Uniform phases are
    one curve, as they are.
    """
    return curves(dataset["mesh_phase"].values, dataset[name].values, panel_size(dataset), points)


def curves(phase: NDArray, values: NDArray, size: int | None, points: int = 40) -> list[tuple[NDArray, NDArray]]:
    """As ``panels``, from phases and values (position,) with ``size`` Gauss points on each panel."""
    if size is None:
        return [(phase, values)]
    t = np.linspace(-1, 1, points)
    return [
        (middle + half * t, legendre.legval(t, coefficients))
        for middle, half, coefficients in _fits(phase, values, size)
    ]


def peak_to_peak(phase: NDArray, values: NDArray, size: int | None) -> float:
    """Difference between the largest and the smallest value, up to both sides of every transition."""
    everywhere = np.concatenate([y for _, y in curves(phase, values, size, 201)])
    return float(np.ptp(everywhere))


def fourier(dataset: xr.Dataset, name: str, orders: int = 10) -> NDArray:
    """Amplitudes of the mesh orders 1 … ``orders`` of a variable of the mesh cycle, in its unit, (order,).

    On Gauss panels the polynomials of the panels are integrated; uniform phases give orders below half their number,
    NaN above.
    """
    return amplitudes(dataset["mesh_phase"].values, dataset[name].values, panel_size(dataset), orders)


def amplitudes(phase: NDArray, values: NDArray, size: int | None, orders: int = 10) -> NDArray:
    """As ``fourier``, from phases and values (position,) with ``size`` Gauss points on each panel."""
    n = np.arange(1, orders + 1)
    if size is None:
        amplitude = 2 * np.abs(np.exp(-2j * np.pi * np.outer(n, phase)) @ values) / len(phase)
        return np.where(2 * n < len(phase), amplitude, np.nan)
    t, w = legendre.leggauss(size + 4 * orders)
    total = np.zeros(orders, dtype=complex)
    for middle, half, coefficients in _fits(phase, values, size):
        wave = np.exp(-2j * np.pi * np.outer(n, middle + half * t))
        total += wave @ (half * w * legendre.legval(t, coefficients))
    return 2 * np.abs(total)


def _fits(phase: NDArray, values: NDArray, size: int) -> list[tuple[float, float, NDArray]]:
    """Middle, half width and Legendre coefficients of each panel."""
    t, w = legendre.leggauss(size)
    k = np.arange(size)
    # the interpolating polynomial: its Legendre coefficients are exact by the Gauss rule itself
    project = (2 * k[:, None] + 1) / 2 * legendre.legvander(t, size - 1).T * w
    fits = []
    for x, y in zip(phase.reshape(-1, size), values.reshape(-1, size), strict=True):
        half = (x[-1] - x[0]) / (t[-1] - t[0]) if size > 1 else 0.5
        fits.append((float(x.mean()), float(half), project @ y))
    return fits
