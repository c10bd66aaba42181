"""A run-up as sound: the forces of all orders while the speed rises, as a WAV file."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.files import write_bytes

if TYPE_CHECKING:
    import xarray as xr

#: Samples per second, and peak of the signal over full scale.
RATE, PEAK = 44100, 0.9


def run_up(dataset: xr.Dataset, seconds: float = 10.0, bearing: str | None = None) -> NDArray:
    """Pressure-like signal (sample,) of a steady rise of speed over the dataset's range, largest value 1.

    Parameters
    ----------
    dataset
        From ``response`` or ``nonlinear_response`` (the speed rising; silence where nothing is stable), at two speeds
        or more.
    seconds
        Duration.
    bearing
        Bearing whose force is heard (all directions); the mesh forces where absent.

    Raises
    ------
    InputError
        If there are fewer than two speeds, or no such bearing.
    """
    if "harmonic" not in dataset.dims:
        raise InputError("sound", "no orders of the mesh frequency", "is for a response, linear or nonlinear")
    if "sweep" in dataset.dims:
        dataset = dataset.sel(sweep="up").fillna(0.0)
    speeds = dataset["speed"].values
    if len(speeds) < 2:
        raise InputError("speed", len(speeds), "a run-up needs two speeds or more")
    order = np.argsort(speeds)
    t = np.arange(round(seconds * RATE)) / RATE
    speed = speeds[order[0]] + (speeds[order[-1]] - speeds[order[0]]) * t / seconds
    if bearing is None:
        amplitude, phase = dataset["mesh_force_amplitude"], dataset["mesh_force_phase"]
    else:
        if "bearing" not in dataset.dims or bearing not in dataset["bearing"].values:
            known = list(map(str, dataset["bearing"].values)) if "bearing" in dataset.dims else "none"
            raise InputError("bearing", bearing, f"must be one of {known}")
        chosen = dataset.sel(bearing=bearing)
        amplitude, phase = chosen["bearing_force_amplitude"], chosen["bearing_force_phase"]
    signal = np.zeros(len(t))
    for mesh in range(dataset.sizes["mesh"]):
        per_speed = float(dataset["mesh_frequency"][0, mesh] / speeds[0])
        # the phase of the mesh itself: the integral of its frequency
        turn = 2 * np.pi * per_speed * np.cumsum(speed) / RATE
        for n in dataset["harmonic"].values:
            if n * per_speed * speed[-1] >= RATE / 2:
                continue  # above what can be heard
            a = amplitude.isel(mesh=mesh).sel(harmonic=n).values.reshape(len(speeds), -1)
            p = phase.isel(mesh=mesh).sel(harmonic=n).values.reshape(len(speeds), -1)
            wave = (a * np.exp(1j * p))[order]
            for column in wave.T:
                here = np.interp(speed, speeds[order], column.real) + 1j * np.interp(speed, speeds[order], column.imag)
                signal += (here * np.exp(1j * n * turn)).real
    return signal / max(np.abs(signal).max(), 1e-300)


def write_run_up(dataset: xr.Dataset, path: str | Path, seconds: float = 10.0, bearing: str | None = None) -> Path:
    """Write ``run_up`` as a WAV file, 16 bit, one channel; raises as it, and as ``files.check_target``."""
    from scipy.io import wavfile

    samples = np.round(PEAK * 32767 * run_up(dataset, seconds, bearing)).astype(np.int16)
    buffer = BytesIO()
    wavfile.write(buffer, RATE, samples)
    return write_bytes(path, buffer.getvalue())
