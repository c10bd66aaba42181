"""What the curves must show: another program's contact finite elements of the spur pair, and their own error bars."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

#: Spur pair under 100 N·m by contact finite elements with a mesher of their own [µm]: mean, RMS, peak-to-peak.
LEVELS = {"mean": 11.15, "RMS": 1.74, "peak-to-peak": 4.76}
#: … and its harmonics 1 to 5 [µm].
HARMONICS = (1.95, 1.28, 0.68, 0.20, 0.10)
_LIMITS = {"mean": 0.01, "RMS": 0.03, "peak-to-peak": 0.03}


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """The error bar of every curve at most 0.5 % of its mean; the spur pair as the other program has it."""
    found = []
    for row in range(dataset.sizes["design"]):
        here = dataset.isel(design=row)
        error = float(here.transmission_error_uncertainty / here.transmission_error.mean())
        name = f"{here.case.values!s}, {float(here.torque):g} N·m"
        found.append((f"{name}: error bar {1e2 * error:.2f} % (limit 0.5 %)", error <= 0.005))
    if dataset.sizes["position"] < 20:  # too few phases for harmonics
        return found
    return found + _spur(dataset.transmission_error.values[0])


def levels(curve: np.ndarray) -> dict[str, float]:
    """Mean, RMS and peak-to-peak value of a curve at uniform phases."""
    return {"mean": float(curve.mean()), "RMS": float(curve.std()), "peak-to-peak": float(np.ptp(curve))}


def harmonics(curve: np.ndarray, count: int = 5) -> np.ndarray:
    """Amplitudes of the first harmonics of a curve at uniform phases."""
    return 2 * np.abs(np.fft.rfft(curve)[1 : count + 1]) / len(curve)


def _spur(curve: np.ndarray) -> list[tuple[str, bool]]:
    found = []
    for name, value in levels(curve).items():
        text = f"spur: {name} {value:.2f} µm, another program {LEVELS[name]} (within {1e2 * _LIMITS[name]:g} %)"
        found.append((text, abs(value / LEVELS[name] - 1) <= _LIMITS[name]))
    for n, (value, other) in enumerate(zip(harmonics(curve), HARMONICS, strict=True), start=1):
        room = max(0.08 * other, 0.03 * HARMONICS[0])
        text = f"spur: harmonic {n} {value:.2f} µm, another program {other} (within {room:.2f})"
        found.append((text, abs(value - other) <= room))
    return found
