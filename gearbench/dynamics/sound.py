"""Sound of a run-up: forces of all orders while the speed rises, written as a WAV file (``response --sound``)."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.files import write_bytes
from gearbench.lazy import xr

#: Sampling rate [Hz].
RATE = 44100
#: Peak of the signal as a share of full scale.
PEAK = 0.9


def run_up(dataset: xr.Dataset, seconds: float = 10.0, sound_at: str | None = None) -> NDArray:
    """Signal (sample,) [N, or the unit of the motion at the housing point] while the speed rises at a constant rate.

    The speeds are those of the dataset, from the lowest to the highest.

    Parameters
    ----------
    dataset
        Result of ``response``, ``nonlinear_response`` (rising speed is used) or ``revolution_response`` (with its side
        bands) at two speeds or more. Unstable speeds are silent.
    seconds
        Duration.
    sound_at
        Bearing, whose force components in all directions are added as signals, or point of the housing; by default the
        sum of all mesh forces.

    Raises
    ------
    InputError
        If there are no orders, fewer than two speeds, or no such bearing or point.
    """
    along = "order" if "order" in dataset.dims else "harmonic"
    if along not in dataset.dims:
        raise InputError("", "no orders of the mesh frequency", "the sound needs a response, not its scatter")
    if "sweep" in dataset.dims:
        dataset = dataset.sel(sweep="up")
    speeds = dataset["speed"].values
    if len(speeds) < 2:
        raise InputError("speed", len(speeds), "a run-up needs two speeds or more")
    amplitude, phase = (_heard(dataset, sound_at, part).fillna(0.0) for part in ("amplitude", "phase"))
    orders = (amplitude * np.exp(1j * phase)).transpose("speed", "mesh", along, ...)
    ascending = np.argsort(speeds)
    values = orders.values.reshape(*orders.shape[:3], -1)[ascending]
    t = np.arange(round(seconds * RATE)) / RATE
    speed = speeds[ascending[0]] + (speeds[ascending[-1]] - speeds[ascending[0]]) * t / seconds
    signal = np.zeros(len(t))
    for mesh in range(dataset.sizes["mesh"]):
        frequency_per_speed = float(dataset["mesh_frequency"][0, mesh] / speeds[0])
        # the phase is the integral of the frequency
        phase_of_order_1 = 2 * np.pi * frequency_per_speed * np.cumsum(speed) / RATE
        for k, n in enumerate(dataset[along].values):
            if n * frequency_per_speed * speed[-1] >= RATE / 2:
                continue  # above half the sampling rate
            for column in values[:, mesh, k].T:
                level = np.interp(speed, speeds[ascending], column.real) + 1j * np.interp(
                    speed, speeds[ascending], column.imag
                )
                signal += (level * np.exp(1j * n * phase_of_order_1)).real
    return signal


def _heard(dataset: xr.Dataset, sound_at: str | None, part: str) -> xr.DataArray:
    """Orders of the quantity that is heard: ``part`` is "amplitude" or "phase"; ``sound_at`` as for ``run_up``."""
    if sound_at is None:
        return dataset[f"mesh_force_{part}"]
    known = []
    for dim, name in (("bearing", f"bearing_force_{part}"), ("point", f"housing_{part}")):
        if name in dataset:
            known += [str(label) for label in dataset[dim].values]
            if sound_at in dataset[dim].values:
                return dataset[name].sel({dim: sound_at})
    raise InputError("sound_at", sound_at, f"must be one of {known}" if known else "the result has no phases")


def write_run_up(
    dataset: xr.Dataset, path: str | Path, *, sound_at: str | None = None, full_scale: float | None = None
) -> tuple[Path, float]:
    """Write ``run_up`` as a 16-bit mono WAV file; return the file, and its full scale in the unit of the signal.

    Parameters
    ----------
    sound_at
        As for ``run_up``.
    full_scale
        Signal at full scale, to compare variants; larger values are clipped. By default a little above the peak.

    Raises
    ------
    InputError
        As ``run_up``, or if the file cannot be written.
    """
    from scipy.io import wavfile

    signal = run_up(dataset, sound_at=sound_at)
    scale = full_scale or max(float(np.abs(signal).max()), 1e-300) / PEAK
    buffer = BytesIO()
    wavfile.write(buffer, RATE, np.round(32767 * np.clip(signal / scale, -1.0, 1.0)).astype(np.int16))
    return write_bytes(path, buffer.getvalue()), scale
