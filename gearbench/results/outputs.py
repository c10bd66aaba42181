"""Outputs: variables of a Dataset that ``simulate`` computes from a contact solution on request."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from warnings import warn

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError, one_of
from gearbench.geometry.names import GEARS
from gearbench.results import flank
from gearbench.results.cycle import (
    HELICAL_ERROR,
    PHASE_ACCURACY,
    SPUR_ERROR,
    TRUNCATION_ERROR,
    CycleCurve,
    coefficients,
)
from gearbench.results.responses import USUAL, is_response, response, responses
from gearbench.results.solved import Solved

_SEGMENTS = ("position", "pair", "segment")

#: Output → (dimensions, function that computes it). ``simulate`` computes the requested outputs and responses.
OUTPUTS: Mapping[str, tuple[tuple[str, ...], Callable[[Solved], NDArray]]] = MappingProxyType(
    {
        "transmission_error": (("position",), lambda s: s.cycle.transmission_error),
        "mesh_stiffness": (("position",), lambda s: s.cycle.mesh_stiffness),
        "line_load": (_SEGMENTS, Solved.line_load),
        "load_share": (("position", "pair"), Solved.load_share),
        "initial_gap": (_SEGMENTS, Solved.initial_gap),
        "transmission_error_amplitude": (("harmonic",), lambda s: 2 * np.abs(_harmonics(s, "transmission_error"))),
        "transmission_error_amplitude_noise_floor": (("harmonic",), lambda s: _noise_floor(s, "transmission_error")),
        "transmission_error_phase": (("harmonic",), lambda s: np.angle(_harmonics(s, "transmission_error"))),
        "mesh_stiffness_amplitude": (("harmonic",), lambda s: 2 * np.abs(_harmonics(s, "mesh_stiffness"))),
        "mesh_stiffness_amplitude_noise_floor": (("harmonic",), lambda s: _noise_floor(s, "mesh_stiffness")),
        "mesh_stiffness_phase": (("harmonic",), lambda s: np.angle(_harmonics(s, "mesh_stiffness"))),
        "transmission_error_peak_to_peak_noise_floor": ((), lambda s: _peak_to_peak_floor(s, "transmission_error")),
        "mesh_stiffness_peak_to_peak_noise_floor": ((), lambda s: _peak_to_peak_floor(s, "mesh_stiffness")),
        "flank_pressure": (_SEGMENTS, flank.pressure),
        "specific_sliding": (("gear", *_SEGMENTS), flank.specific_sliding),
        "sliding_speed": (_SEGMENTS, flank.sliding_speed),
        "flash_temperature": (_SEGMENTS, flank.flash_temperature),
        "flank_pressure_max": ((), lambda s: flank.pressure(s).max(axis=(-1, -2, -3))),
        "face_load_factor": ((), flank.face_load_factor),
        "loaded_contact_ratio": ((), flank.loaded_contact_ratio),
        "root_stress": (("gear",), flank.root_stress),
        "loaded_root_stress": (("gear",), flank.loaded_root_stress),
        "friction_coefficient": ((), flank.friction_coefficient),
        "friction_loss": ((), flank.friction_loss),
        "mesh_efficiency": ((), flank.efficiency),
        "flash_temperature_max": ((), lambda s: flank.flash_temperature(s).max(axis=(-1, -2, -3))),
    }
)

#: Name in earlier versions, for pinion or wheel → output over both gears, and index of the gear.
EARLIER: Mapping[str, tuple[str, int]] = MappingProxyType(
    {
        f"{name}_{GEARS[index]}": (name, index)
        for name, (dims, _) in OUTPUTS.items()
        if "gear" in dims
        for index in (0, 1)
    }
)
#: Default outputs of ``simulate``.
DEFAULT_OUTPUTS = (
    *(name for name, (dims, _) in OUTPUTS.items() if dims == ("position",) or dims == ("harmonic",)),
    "line_load",
    *USUAL,
    "transmission_error_peak_to_peak_noise_floor",
    "mesh_stiffness_peak_to_peak_noise_floor",
)


def output(solved: Solved, name: str) -> tuple[tuple[str, ...], NDArray]:
    """Compute an output or response; return its dimensions and values."""
    if name in EARLIER:
        of, gear = EARLIER[name]
        warn(f"{name} is now {of}, with the dimension gear", DeprecationWarning, stacklevel=2)
        dims, values = output(solved, of)
        return dims[1:], values.take(gear, axis=-len(dims))
    if name not in solved.outputs:
        dims, compute = OUTPUTS[name] if name in OUTPUTS else ((), lambda s: response(name).reduce(s.cycle))
        solved.outputs[name] = dims, compute(solved)
    return solved.outputs[name]


def check_outputs(names: tuple[str, ...]) -> None:
    """Refuse names that are neither an output nor a response.

    Raises
    ------
    InputError
        For an unknown name; names similar or allowed ones.
    """
    for name in names:
        if name not in OUTPUTS and name not in EARLIER and not is_response(name):
            raise InputError("outputs", name, one_of(name, (*OUTPUTS, *responses())))


def _noise_floor(solved: Solved, curve: str) -> NDArray:
    """Estimate the errors of the amplitudes of a curve, in its unit, (…, harmonic)."""
    values = solved.cycle.curves[curve].values
    cut = TRUNCATION_ERROR * values.mean(axis=-1) if curve == "mesh_stiffness" else 0.0
    cut = np.hypot(cut, solved.unresolved.get(curve, 0.0))
    change = values - solved.coarse_cycle.curves[curve].values
    return curve_floor([solved], solved.cycle.curves[curve], change, cut)


def curve_floor(meshes: Sequence[Solved], curve: CycleCurve, change: NDArray, cut: NDArray | float = 0.0) -> NDArray:
    """Compute ``noise_floor`` of a curve from the contact of ``meshes``; ``cut`` is a further error of the curve."""
    located = 0.0 if all(mesh.conforming for mesh in meshes) else PHASE_ACCURACY
    pair = meshes[0].scene.pair
    along = HELICAL_ERROR * pair.face_width / pair.normal_module if pair.meshing.overlap_ratio else SPUR_ERROR
    least = np.hypot(along * np.ptp(curve.values, axis=-1), cut)
    return curve.noise_floor(change, located=located, least=least)


def _peak_to_peak_floor(solved: Solved, curve: str) -> NDArray:
    """Estimate the error of the peak-to-peak value of a curve, in its unit."""
    floor = output(solved, f"{curve}_amplitude_noise_floor")[1]
    return solved.cycle.curves[curve].peak_to_peak_floor(floor)


def _harmonics(solved: Solved, curve: str) -> NDArray:
    return coefficients(solved.cycle.phases, getattr(solved.cycle, curve))
