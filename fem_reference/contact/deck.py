"""Input of CalculiX for two sections in contact.

The unknown rotation of the pinion is degree of freedom 1 of a node of its own: q = r_b1 φ [mm], along the line of
action, so that the force on it is F_bt. The nodes of the pinion's bore follow by linear equations; φ is below 1e-3,
and the stretch φ²/2 that they neglect below 1e-6.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.contact.mesh import GearMesh
from gearbench.geometry.pair import Pair

#: Sets of elements of both gears, and their surfaces.
_SURFACES = ("PINION", "WHEEL")


@dataclass(frozen=True, kw_only=True)
class NodalLoad:
    """One load step: the force F_bt [N], or else the rotation q [mm] of the pinion."""

    force: float | None = None
    rotation: float | None = None


def deck(
    pair: Pair,
    meshes: tuple[GearMesh, GearMesh],
    steps: Sequence[NodalLoad],
    *,
    penalty: float,
    slaves: Mapping[int, int],
    large_displacements: bool = False,
    thickness: float = 1.0,
) -> str:
    """The input file: plane strain of the given thickness [mm], frictionless face-to-face contact of every pair.

    ``penalty``: pressure per overclosure [MPa/mm]; ``slaves``: of each tooth pair the gear whose faces look for those
    of its mate. It must be the gear whose corner may touch: a corner that presses on the middle of a face is not found.
    """
    shift = meshes[0].points.shape[1]
    start = [0, shift]
    q = shift + meshes[1].points.shape[1] + 1
    text = ["*NODE, NSET=ALL", *_nodes(meshes), f"{q}, 0., 0., 0."]
    count = 0
    surfaces: list[str] = []
    for name, mesh, first in zip(_SURFACES, meshes, start, strict=True):
        numbers = np.arange(mesh.triangles.shape[1]) + count + 1
        text.append(f"*ELEMENT, TYPE=CPE6, ELSET={name}")
        text += _rows(np.vstack([numbers, mesh.triangles + first + 1]))
        text += [f"*NSET, NSET={name}BORE", *_list(mesh.bore + first + 1)]
        for k, edges in mesh.surfaces.items():
            surfaces.append(f"*SURFACE, NAME={name}{_letter(k)}, TYPE=ELEMENT")
            surfaces += [f"{numbers[t]}, S{edge + 1}" for t, edge in edges]
        count += len(numbers)
    text += [f"*NSET, NSET=ROTATION\n{q}"]
    for name, material in zip(_SURFACES, pair.materials, strict=True):
        text.append(f"*MATERIAL, NAME=OF{name}\n*ELASTIC\n{material.E}, {material.nu}")
        text.append(f"*SOLID SECTION, ELSET={name}, MATERIAL=OF{name}\n{thickness}")
    text += surfaces
    text += ["*SURFACE INTERACTION, NAME=PENALTY\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{penalty:.8g}"]
    for k, slave in slaves.items():
        text.append("*CONTACT PAIR, INTERACTION=PENALTY, TYPE=SURFACE TO SURFACE")
        text.append(f"{_SURFACES[slave]}{_letter(k)}, {_SURFACES[1 - slave]}{_letter(k)}")
    text += _rotation(meshes[0], q, pair.gears[0].base_radius)
    text += [] if meshes[1].free is None else _floating(meshes[1], shift, pair.centre_distance)
    held = [f"{q}, 2, 3"] if meshes[1].free is not None else ["WHEELBORE, 1, 2", f"{q}, 2, 3"]
    text += ["*BOUNDARY", *held]
    for step in steps:
        text += _step(step, q, large_displacements, slaves, held)
    return "\n".join(text) + "\n"


def _nodes(meshes: Sequence[GearMesh]) -> list[str]:
    xy = np.concatenate([mesh.points for mesh in meshes], axis=1).T
    return [f"{i}, {x:.12g}, {y:.12g}, 0." for i, (x, y) in enumerate(xy, start=1)]


def _rows(columns: NDArray) -> list[str]:
    return [", ".join(map(str, row)) for row in columns.T.tolist()]


def _list(numbers: NDArray) -> list[str]:
    return [", ".join(map(str, numbers[i : i + 12].tolist())) + "," for i in range(0, len(numbers), 12)]


def _letter(k: int) -> str:
    """Suffix of the surfaces of pair k."""
    return f"P{k}" if k >= 0 else f"M{-k}"


def _rotation(pinion: GearMesh, q: int, base_radius: float) -> list[str]:
    """Bore nodes of the pinion turn clockwise by φ = q / r_b: u = (y, −x) q / r_b."""
    text = ["*EQUATION"]
    for node in pinion.bore:
        x, y = pinion.points[:, node]
        for dof, lever in ((1, y), (2, -x)):
            if abs(lever) > 1e-12 * base_radius:
                text.append(f"2\n{node + 1}, {dof}, 1., {q}, 1, {-lever / base_radius:.14g}")
            else:
                text.append(f"1\n{node + 1}, {dof}, 1.")
    return text


def _floating(wheel: GearMesh, shift: int, centre_distance: float) -> list[str]:
    """The outside of a free ring moves on average neither along x and y nor around its axis."""
    assert wheel.free is not None
    x, y = wheel.points[:, wheel.bore] - np.array([[0.0], [centre_distance]])
    number, zero, text = wheel.bore + shift + 1, np.zeros(len(x)), ["*EQUATION"]
    depends: set[tuple[int, int]] = set()
    for factors in ((wheel.free, zero), (zero, wheel.free), (-y * wheel.free, x * wheel.free)):
        terms = [(i, dof, f) for dof, each in enumerate(factors, 1) for i, f in zip(number, each, strict=True) if f]
        # the degree of freedom that comes first depends on the others
        first = max((t for t in terms if t[:2] not in depends), key=lambda t: abs(t[2]))
        depends.add(first[:2])
        scale = abs(first[2])
        text.append(str(len(terms)))
        ordered = [first, *(t for t in terms if t is not first)]
        text += [f"{i}, {dof}, {f / scale:.14g}" for i, dof, f in ordered]
    return text


def _step(step: NodalLoad, q: int, large: bool, slaves: Mapping[int, int], held: Sequence[str]) -> list[str]:
    text = [f"*STEP, INC=100{', NLGEOM' if large else ''}", "*STATIC", "1., 1., 1e-4, 1."]
    text += ["*BOUNDARY, OP=NEW", *held]
    if step.rotation is not None:
        text.append(f"{q}, 1, 1, {step.rotation:.10g}")
    else:
        text += ["*CLOAD, OP=NEW", f"{q}, 1, {step.force:.10g}"]
    text += ["*NODE PRINT, NSET=ROTATION", "U, RF"]
    for k, slave in slaves.items():
        own, mate = (f"{_SURFACES[gear]}{_letter(k)}" for gear in (slave, 1 - slave))
        text += [f"*CONTACT PRINT, SLAVE={own}, MASTER={mate}", "CF"]
    return [*text, "*END STEP"]
