"""One planet between sun and ring by contact finite elements in plane strain.

The planet turns freely on its pin, which is elastic or rigid; the sun turns about its axis, the ring is held outside.
N planets in phase on a stiff carrier are one planet under T/N, but for the loads of the others on the bodies of sun and
ring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fem_reference.contact.calculix import run
from fem_reference.contact.deck import NodalLoad, Part, deck
from fem_reference.contact.mesh import Seat, gear_mesh
from fem_reference.contact.phase import Settings, contact_pairs, pressed, stiff
from fem_reference.section import Side
from gearbench.effects.base import GapEffect
from gearbench.geometry.pair import Pair

#: Share of the expected deflection by which flanks are pressed into one another at the start.
_START = 0.3
#: Gap effects of both meshes.
Gaps = tuple[tuple[GapEffect, ...], tuple[GapEffect, ...]]


@dataclass(frozen=True, kw_only=True)
class SetPhase:
    """A set at a mesh phase.

    Parameters
    ----------
    phase
        Mesh phases of both meshes while ring and carrier stand and nothing yields.
    sun, planet
        Rotations beyond this, r_b φ in the sense of the load [mm].
    pin
        Displacement of the pin: in the sun's sense of rotation, and outwards [mm].
    force
        F_bt of both meshes [N]: torques on sun and ring over their base radii.
    share
        Tooth pair → its share of the torque on sun or ring, of both meshes.
    """

    phase: tuple[float, float]
    sun: float
    planet: float
    pin: tuple[float, float]
    force: tuple[float, float]
    share: tuple[dict[int, float], dict[int, float]]


def solve_set(
    pairs: tuple[Pair, Pair],
    phase: float,
    torque: float,
    *,
    pin: float | None = None,
    gaps: Gaps = ((), ()),
    settings: Settings | None = None,
) -> SetPhase:
    """The set at a ``phase`` of planet and ring under a ``torque`` on the sun [N·m].

    ``pairs``: sun and planet, planet and ring; ``pin``: its stiffness [N/mm].

    Raises
    ------
    ContactError, MissingDependencyError, MeshingError
        If CalculiX or the mesher fails.
    """
    settings, (inner, outer) = settings or Settings(), pairs
    sun, planet, ring = *inner.gears, outer.gears[1]
    force, b = 1e3 * torque / sun.base_radius, inner.meshing.face_width
    loads = (0.5 * force / b, 0.5 * force / b)
    seats = seated(pairs, phase, force / b, gaps)
    meshes = (gear_mesh(own, loads, settings.fineness) for own in (seats[:1], seats[1:3], seats[3:]))
    materials, axes = (*inner.materials, outer.materials[1]), ((0.0, 0.0), seats[2].origin, (0.0, 0.0))
    turns, pins = (sun.base_radius, planet.base_radius, None), (None, pin, None)
    parts = [
        Part(name=name, mesh=mesh, material=material, axis=axis, base_radius=turn, pin=spring)
        for name, mesh, material, axis, turn, spring in zip("SPR", meshes, materials, axes, turns, pins, strict=True)
    ]
    sides = [(seats[0], "SP", sun.base_radius), (seats[3], "PR", -ring.base_radius)]
    contacts = [each for seat, names, _ in sides for each in contact_pairs(seat, (names[0], names[1]))]
    penalty = settings.penalty * stiff(inner, loads[0])
    text = deck(parts, contacts, [NodalLoad(force=force)], penalty=penalty, thickness=b)
    (step,) = run(text, [contact.name for contact in contacts])
    moments = [{touch.pair: step.moment[seat.label(touch.pair)] for touch in seat.touches} for seat, *_ in sides]
    first, second = ({k: M / sum(own.values()) for k, M in own.items()} for own in moments)
    inside, outside = seats[0].placement, seats[3].placement
    return SetPhase(
        phase=((inside.phase - outside.advance / inner.meshing.base_pitch) % 1.0, phase),
        sun=inside.advance + outside.advance + step.rotation,
        planet=outside.advance - step.motions[1][0],
        pin=(0.0, 0.0) if pin is None else step.motions[2],
        force=(sum(moments[0].values()) / sides[0][2], sum(moments[1].values()) / sides[1][2]),
        share=(first, second),
    )


def seated(pairs: tuple[Pair, Pair], phase: float, line_load: float, gaps: Gaps = ((), ())) -> tuple[Seat, ...]:
    """Sun, planet under the sun, planet in the ring, and ring at a phase of planet and ring; the sun's axis is 0, 0.

    The planet's left flanks touch the ring, so that this mesh is a placement in a mirror. ``line_load`` [N/mm].
    """
    inner, outer = pairs
    planet, centre = inner.gears[1], (0.0, inner.meshing.centre_distance)
    outside, far = pressed(outer, gaps[1], phase, (line_load, line_load), _START)
    begun = _phase(inner, -math.pi - outside.turn(0))
    inside, near = pressed(inner, gaps[0], begun, (line_load, line_load), _START)
    turned = round(-(math.pi + inside.turn(1) + outside.turn(0)) * planet.teeth / (2 * math.pi))
    left = {"placement": outside, "touches": far, "name": "R", "side": Side.LEFT, "origin": centre}
    return (
        *(Seat(placement=inside, index=index, touches=near, name="S") for index in (0, 1)),
        *(Seat(index=index, turned=(turned, 0)[index], **left) for index in (0, 1)),
    )


def _phase(pair: Pair, turn: float) -> float:
    """Mesh phase at which a tooth of the wheel is at an angle in the wheel's frame [rad]."""
    meshing, wheel = pair.meshing, pair.gears[1]
    roll = wheel.base_radius * (turn + meshing.alpha_wt + float(wheel.involute_half_angle(wheel.base_radius)))
    return (meshing.tangent_length - roll - meshing.path_start) / meshing.base_pitch % 1.0
