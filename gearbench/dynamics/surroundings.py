"""Shafts and bearings around the meshes: static deflection, mode shapes and energies, response to torque ripples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.names import GEARS
from gearbench.results.cycle import MICROMETRES
from gearbench.system.gearbox import FACE_POINTS, Gearbox
from gearbench.system.static import StaticState

if TYPE_CHECKING:
    from gearbench.dynamics.model import Model, Variables

#: Components of a mode shape: motion of the axis, and twist as an arc on the base circle of the shaft's first gear.
COMPONENTS = ("x", "y", "axial", "twist")
#: Tilts of an axis.
TILTS = ("about x", "about y")
#: mrad in 1 rad.
MILLIRADIANS = 1e3


def static_deflection(box: Gearbox, static_states: tuple[StaticState, ...]) -> Variables:
    """Deflection and tilt of the axes at the middle of every gear, and the resulting misalignment of every mesh."""
    deflections, tilts, misalignment = [], [], []
    for mesh in box.names:
        gap = np.zeros(len(FACE_POINTS[0]))
        for index in (0, 1):
            number, seat = box.seats[mesh, index]
            motion = static_states[number].at(number, seat.position)
            deflections.append(MICROMETRES * motion[:3])
            tilts.append(MILLIRADIANS * motion[3:])
            motions = static_states[number].motion[static_states[number].structure.motions(number)]
            gap += box.face_rows(mesh, index, box.models[number]) @ motions
        # twice the slope: from one end of the face, η = −1, to the other, η = 1
        misalignment.append(2 * MICROMETRES * abs(np.polyfit(FACE_POINTS[0], gap, 1)[0]))
    return {
        "gear_deflection": (("gear", "direction"), np.array(deflections)),
        "gear_tilt": (("gear", "tilt"), np.array(tilts)),
        "mesh_misalignment": (("mesh",), np.array(misalignment)),
    }


def mode_variables(model: Model, which: NDArray) -> Variables:
    """Shares of the parts in the strain energy, and shapes of the shafts, in the elastic modes ``which`` (indices)."""
    modes, parts, box = model.modes, model.mechanics.parts, model.scene.gearbox
    motions = [part.rows @ modes.shape for part in parts]
    energy = [_twice_strain_energy(part.stiffness, rows) for part, rows in zip(parts, motions, strict=True)]
    row_count = model.rows_per_mesh
    for mesh in range(len(model.names)):
        rows = slice(row_count * mesh, row_count * (mesh + 1))
        energy.append(_twice_strain_energy(model.stiffness[rows, rows], modes.mesh[rows]))
    known = np.array(energy)[:, which]
    # twice the strain energy of a mode with unit modal mass is ω²; the last part is the rest: couplings and bodies
    energies = np.vstack([known, np.maximum(modes.frequency[which] ** 2 - known.sum(axis=0), 0.0)])
    shapes, start = [], 0
    for number, shaft in enumerate(box.models):
        shape_of_shaft = modes.shape[start : start + shaft.size, which].reshape(len(shaft.nodes), 6, len(which))
        first_gear = next((gear for gear, (shaft_number, _) in box.seats.items() if shaft_number == number), None)
        arc = 1.0 if first_gear is None else abs(box.pairs[first_gear[0]].gears[first_gear[1]].base_radius)
        shapes.append(shape_of_shaft[:, [0, 1, 2, 5]] * np.array([1.0, 1.0, 1.0, arc])[:, None])
        start += shaft.size
    shape = np.moveaxis(np.concatenate(shapes), -1, 0)
    return {
        "mode_energy": (("mode", "part"), (energies / energies.sum(axis=0)).T),
        "shaft_mode_shape": (
            ("mode", "station", "component"),
            shape / np.maximum(np.abs(shape).max(axis=(1, 2), keepdims=True), 1e-300),
        ),
    }


def _twice_strain_energy(stiffness: NDArray, rows: NDArray) -> NDArray:
    """Twice the strain energy (mode,) of a spring whose motions in the modes are ``rows`` (m, mode), as squares."""
    values, vectors = np.linalg.eigh(stiffness)
    return np.maximum(values, 0.0) @ (vectors.T @ rows) ** 2


def ripple_variables(model: Model, speeds: NDArray) -> Variables:
    """Amplitudes of the response to each torque ripple at its frequency; meshes have their mean stiffness."""
    ripples, modes = ripple_rates(model.scene.gearbox), model.modes
    if not ripples:
        return {}
    omega = 2 * np.pi / 60 * np.outer(speeds, list(ripples.values()))
    # one column per ripple: its amplitude is contained in ``modes.ripples``
    unit_forces = np.broadcast_to(np.eye(len(ripples)), (len(speeds), *[len(ripples)] * 2))
    te, motion, bearing = modes.response_to_forces(omega, unit_forces, modes.ripples)
    force = (motion @ model.stiffness.T)[..., :: model.rows_per_mesh]
    dims = ("speed", "ripple")
    return {
        "ripple_frequency": (dims, omega / (2 * np.pi)),
        "ripple_transmission_error_amplitude": ((*dims, "mesh"), MICROMETRES * np.abs(te)),
        "ripple_mesh_force_amplitude": ((*dims, "mesh"), np.abs(force)),
        "ripple_bearing_force_amplitude": ((*dims, "bearing", "direction"), np.abs(bearing)),
    }


def ripple_rates(box: Gearbox) -> dict[str, float]:
    """Frequencies of the ripples by name, as multiples of the pinion's frequency of rotation."""
    return {
        f"{shaft.name}, order {ripple.order:g}": ripple.order * abs(float(box.train.rates[shaft.name]))
        for shaft in box.system.shafts
        for ripple in shaft.ripples
    }


def coords(model: Model) -> dict[str, Any]:
    """Coordinates of the variables of this module."""
    box = model.scene.gearbox
    stations = [(shaft.shaft.name, z) for shaft in box.models for z in shaft.nodes]
    kinds = ["shaft"] * len(box.models) + ["bearing"] * len(model.mechanics.bearing_names)
    parts = [f"{kind} {part.name}" for kind, part in zip(kinds, model.mechanics.parts, strict=True)]
    parts += [f"mesh {name}" for name in model.names]
    coordinates = {
        "gear": ("gear", [f"{mesh} {gear}" for mesh in model.names for gear in GEARS]),
        "tilt": ("tilt", list(TILTS)),
        "part": ("part", [*parts, "couplings and bodies"]),
        "shaft": ("station", [name for name, _ in stations]),
        "shaft_position": ("station", np.array([z for _, z in stations])),
        "component": ("component", list(COMPONENTS)),
    }
    return coordinates | ({"ripple": ("ripple", list(rates))} if (rates := ripple_rates(box)) else {})
