"""Input of CalculiX for sections in contact.

The unknown rotation of a gear is degree of freedom 1 of a node of its own: q = r_b φ [mm], along the line of action, so
that the force on it is F_bt; a gear on an elastic pin moves with a second node. The nodes of its bore follow by linear
equations; φ is below 1e-3, and the stretch φ²/2 that they neglect below 1e-6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.contact.mesh import GearMesh
from gearbench.geometry.material import Material


@dataclass(frozen=True, kw_only=True)
class NodalLoad:
    """One load step: the force F_bt [N], or else the rotation q [mm] of the pinion."""

    force: float | None = None
    rotation: float | None = None


@dataclass(frozen=True, kw_only=True)
class Part:
    """A gear of the deck.

    Parameters
    ----------
    name
        Name of its set of elements, with which the names of its surfaces begin.
    mesh, material
        Its section in its position.
    axis
        Its centre [mm].
    base_radius
        r_b [mm] of a gear that turns about its axis; None of one that is held at its bore, or is a free ring.
    pin
        Stiffness of the pin of a gear that turns, equal in all directions [N/mm]; None if it is rigid.
    """

    name: str
    mesh: GearMesh
    material: Material
    axis: tuple[float, float]
    base_radius: float | None = None
    pin: float | None = None


@dataclass(frozen=True, kw_only=True)
class ContactPair:
    """Two surfaces that may touch.

    Parameters
    ----------
    name
        Name of the tooth pair.
    slave, master
        Names of the parts: that whose faces look for those of its mate. It must be the one whose corner may touch: a
        corner that presses on the middle of a face is not found.
    """

    name: str
    slave: str
    master: str

    @property
    def surfaces(self) -> tuple[str, str]:
        """Names of both surfaces, the slave first."""
        return self.slave + self.name, self.master + self.name


def deck(
    parts: Sequence[Part],
    contacts: Sequence[ContactPair],
    steps: Sequence[NodalLoad],
    *,
    penalty: float,
    large_displacements: bool = False,
    thickness: float = 1.0,
) -> str:
    """The input file: plane strain of the given thickness [mm], frictionless face-to-face contact.

    The loads act on the first part, which turns. ``penalty``: pressure per overclosure [MPa/mm].
    """
    start = np.cumsum([0, *(part.mesh.points.shape[1] for part in parts)]).tolist()
    turning = [part.name for part in parts if part.base_radius is not None]
    sprung = [part.name for part in parts if part.pin is not None]
    nodes = {name: start[-1] + 1 + i for i, name in enumerate(turning)}
    pins = {name: start[-1] + 1 + len(turning) + i for i, name in enumerate(sprung)}
    moving = [*nodes.values(), *pins.values()]
    text = ["*NODE, NSET=ALL", *_nodes(parts), *(f"{node}, 0., 0., 0." for node in moving)]
    held = [*(f"{node}, 2, 3" for node in nodes.values()), *(f"{node}, 3" for node in pins.values())]
    count, rest = 0, [f"*NSET, NSET=MOTION\n{_list(np.array(moving))[0]}"]
    for part, first in zip(parts, start, strict=False):
        name, mesh = part.name, part.mesh
        numbers = np.arange(mesh.triangles.shape[1]) + count + 1
        text.append(f"*ELEMENT, TYPE=CPE6, ELSET={name}")
        text += _rows(np.vstack([numbers, mesh.triangles + first + 1]))
        text += [f"*NSET, NSET={name}BORE", *_list(mesh.bore + first + 1)]
        rest.append(f"*MATERIAL, NAME=OF{name}\n*ELASTIC\n{part.material.E}, {part.material.nu}")
        rest.append(f"*SOLID SECTION, ELSET={name}, MATERIAL=OF{name}\n{thickness}")
        for side, edges in mesh.surfaces.items():
            rest.append(f"*SURFACE, NAME={name}{side}, TYPE=ELEMENT")
            rest += [f"{numbers[t]}, S{edge + 1}" for t, edge in edges]
        count += len(numbers)
        if name in nodes:
            rest += _rotation(part, first, nodes[name], pins.get(name))
        elif mesh.free is not None:
            rest += _floating(part, first)
        else:
            held.append(f"{name}BORE, 1, 2")
    for part in parts:
        for dof in (1, 2) if part.pin is not None else ():
            count += 1
            text.append(f"*ELEMENT, TYPE=SPRING1, ELSET={part.name}PIN{dof}\n{count}, {pins[part.name]}")
            rest.append(f"*SPRING, ELSET={part.name}PIN{dof}\n{dof}\n{part.pin:.10e}")
    text += rest
    text += ["*SURFACE INTERACTION, NAME=PENALTY\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{penalty:.8g}"]
    for contact in contacts:
        text += ["*CONTACT PAIR, INTERACTION=PENALTY, TYPE=SURFACE TO SURFACE", ", ".join(contact.surfaces)]
    text += ["*BOUNDARY", *held]
    for step in steps:
        text += _step(step, moving[0], large_displacements, contacts, held)
    return "\n".join(text) + "\n"


def _nodes(parts: Sequence[Part]) -> list[str]:
    xy = np.concatenate([part.mesh.points for part in parts], axis=1).T
    return [f"{i}, {x:.12g}, {y:.12g}, 0." for i, (x, y) in enumerate(xy, start=1)]


def _rows(columns: NDArray) -> list[str]:
    return [", ".join(map(str, row)) for row in columns.T.tolist()]


def _list(numbers: NDArray) -> list[str]:
    return [", ".join(map(str, numbers[i : i + 12].tolist())) + "," for i in range(0, len(numbers), 12)]


def _rotation(part: Part, first: int, q: int, pin: int | None) -> list[str]:
    """Bore nodes turn clockwise by φ = q / r_b, and move with the pin: u = (y, −x) q / r_b + p."""
    assert part.base_radius is not None
    text = ["*EQUATION"]
    for node in part.mesh.bore:
        x, y = part.mesh.points[:, node] - part.axis
        for dof, lever in ((1, y), (2, -x)):
            terms = [(node + first + 1, dof, 1.0)]
            if abs(lever) > 1e-12 * abs(part.base_radius):
                terms.append((q, 1, -lever / part.base_radius))
            if pin is not None:
                terms.append((pin, dof, -1.0))
            text.append(_equation(terms))
    return text


def _equation(terms: Sequence[tuple[int, int, float]]) -> str:
    """Linear equation between degrees of freedom (node, direction, factor); the first one depends on the others."""
    return "\n".join([str(len(terms)), *(f"{node}, {dof}, {factor:.14g}" for node, dof, factor in terms)])


def _floating(part: Part, first: int) -> list[str]:
    """The outside of a free ring moves on average neither along x and y nor around its axis."""
    ring = part.mesh
    assert ring.free is not None
    x, y = ring.points[:, ring.bore] - np.array(part.axis)[:, None]
    number, zero, text = ring.bore + first + 1, np.zeros(len(x)), ["*EQUATION"]
    depends: set[tuple[int, int]] = set()
    for factors in ((ring.free, zero), (zero, ring.free), (-y * ring.free, x * ring.free)):
        terms = [(i, dof, f) for dof, each in enumerate(factors, 1) for i, f in zip(number, each, strict=True) if f]
        # the degree of freedom that comes first depends on the others
        lead = max((t for t in terms if t[:2] not in depends), key=lambda t: abs(t[2]))
        depends.add(lead[:2])
        scale = abs(lead[2])
        ordered = [lead, *(t for t in terms if t is not lead)]
        text.append(_equation([(i, dof, f / scale) for i, dof, f in ordered]))
    return text


def _step(step: NodalLoad, q: int, large: bool, contacts: Sequence[ContactPair], held: Sequence[str]) -> list[str]:
    text = [f"*STEP, INC=100{', NLGEOM' if large else ''}", "*STATIC", "1., 1., 1e-4, 1."]
    text += ["*BOUNDARY, OP=NEW", *held]
    if step.rotation is not None:
        text.append(f"{q}, 1, 1, {step.rotation:.10g}")
    else:
        text += ["*CLOAD, OP=NEW", f"{q}, 1, {step.force:.10g}"]
    text += ["*NODE PRINT, NSET=MOTION", "U"]
    for contact in contacts:
        slave, master = contact.surfaces
        text += [f"*CONTACT PRINT, SLAVE={slave}, MASTER={master}", "CF"]
    return [*text, "*END STEP"]
