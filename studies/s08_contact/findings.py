"""Findings: checks and pictures of the curves.

Contact finite elements are checked by their error bars and, for the spur pair, against another FE program. Fast teeth
with contact off the line are checked against contact finite elements.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearbench.lazy import xr
from gearbench.plotting import BLUE, GREEN, ORANGE, new_figure, write_figure

#: STE of the spur pair under 100 N·m by another contact FE program with its own mesher [µm].
LEVELS = {"mean": 11.15, "RMS": 1.74, "peak-to-peak": 4.76}
#: Harmonics 1 to 5 of the same STE [µm].
HARMONICS = (1.95, 1.28, 0.68, 0.20, 0.10)
#: Relative limits for the difference of contact finite elements from these, and of fast teeth from contact finite
#: elements.
_LIMITS = {"mean": 0.01, "RMS": 0.03, "peak-to-peak": 0.03}
#: Limit for the RMS over the cycle of the error of the fast teeth, over the mean.
_RESIDUAL = 0.01


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check that error bars are at most 0.5 % of the mean, and that the spur pair agrees with the other program."""
    found = []
    for row in range(dataset.sizes["design"]):
        here = dataset.isel(design=row)
        error = float(here.transmission_error_uncertainty / here.transmission_error.mean())
        name = f"{here.case.values!s}, {float(here.torque):g} N·m"
        found.append((f"{name}: error bar {1e2 * error:.2f} % (limit 0.5 %)", error <= 0.005))
    if dataset.sizes["position"] < 20:  # too few phases for harmonics
        return found
    found += agreement("spur", dataset.transmission_error.values[0], LEVELS, np.array(HARMONICS), "another program")
    return found + [each for row in range(dataset.sizes["design"]) for each in off_line(dataset.isel(design=row))]


def off_line(here: xr.Dataset) -> list[tuple[str, bool]]:
    """Check the fast teeth with contact off the line against contact finite elements, for one case."""
    fe, fast = here.transmission_error.values, here.off_line_transmission_error.values
    name = f"{here.case.values!s}, {float(here.torque):g} N·m, fast off the line"
    residual = float(np.sqrt(((fast - fe) ** 2).mean()) / fe.mean())
    text = f"{name}: residual {1e2 * residual:.2f} % of the mean (limit {1e2 * _RESIDUAL:g} %)"
    return [(text, residual <= _RESIDUAL), *agreement(name, fast, levels(fe), harmonics(fe), "contact FE")]


def levels(curve: np.ndarray) -> dict[str, float]:
    """Mean, RMS and peak-to-peak value of a curve at uniform phases."""
    return {"mean": float(curve.mean()), "RMS": float(curve.std()), "peak-to-peak": float(np.ptp(curve))}


def harmonics(curve: np.ndarray, count: int = 5) -> np.ndarray:
    """Amplitudes of the first harmonics of a curve at uniform phases."""
    return 2 * np.abs(np.fft.rfft(curve)[1 : count + 1]) / len(curve)


def agreement(
    name: str, curve: np.ndarray, truth: dict[str, float], amplitudes: np.ndarray, other: str
) -> list[tuple[str, bool]]:
    """Check that levels and first harmonics of a curve agree with those of another."""
    found = []
    for key, value in levels(curve).items():
        text = f"{name}: {key} {value:.2f} µm, {other} {truth[key]:.2f} (within {1e2 * _LIMITS[key]:g} %)"
        found.append((text, abs(value / truth[key] - 1) <= _LIMITS[key]))
    for n, (value, amplitude) in enumerate(zip(harmonics(curve), amplitudes, strict=True), start=1):
        room = max(0.08 * amplitude, 0.03 * amplitudes[0])
        text = f"{name}: harmonic {n} {value:.2f} µm, {other} {amplitude:.2f} (within {room:.2f})"
        found.append((text, abs(value - amplitude) <= room))
    return found


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Draw the transmission error, and the share of the load outside the path of contact, over the mesh phase."""
    count = dataset.sizes["design"]
    figure, axes = new_figure(2, count, (3.2 * count + 1, 5.5), sharex=True)
    phase = dataset.mesh_phase.values
    for row in range(count):
        here, (upper, lower) = dataset.isel(design=row), axes[:, row]
        upper.plot(phase, here.line_transmission_error, "-", color=ORANGE, label="contact on the line")
        upper.plot(phase, here.off_line_transmission_error, "--", color=GREEN, label="contact off the line")
        upper.plot(phase, here.transmission_error, "o-", ms=3, color=BLUE, label="contact finite elements")
        lower.bar(phase, 1e2 * here.share_outside_path, width=0.8 / len(phase), color=BLUE)
        upper.set_title(f"{here.case.values!s}, {float(here.torque):g} N·m", fontsize=9)
        lower.set_xlabel("mesh phase")
    axes[0, 0].set_ylabel("transmission error [µm]")
    axes[1, 0].set_ylabel("load outside the path [%]")
    axes[0, 0].legend(frameon=False, fontsize=8)
    most = 1e2 * float(np.max(dataset.share_outside_path))
    figure.suptitle(f"Teeth touch outside the path of contact too, with up to {most:.0f} % of the load", fontsize=10)
    write_figure(figure, folder / "curves.png")
