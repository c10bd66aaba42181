"""One mesh phase by contact finite elements in plane strain."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace

from fem_reference.contact.calculix import ContactError, run, version
from fem_reference.contact.deck import ContactPair, NodalLoad, Part, deck
from fem_reference.contact.mesh import Fineness, Seat, gear_mesh
from fem_reference.contact.placement import Placement, Touch
from fem_reference.contact.profile import Profile
from fem_reference.contact.result import PhaseResult, joined, kept
from gearbench.effects.base import GapEffect
from gearbench.geometry.pair import Pair

#: Load increment for the stiffness.
INCREMENT = 0.02
#: Compliance of a pair of steel teeth for a first guess of the deflection [mm per N/mm].
_GUESS = 1 / 14e3
#: Penalty p/δ = this · E*/a; the pairs then sink into one another by less than a thousandth of their deflection.
_PENALTY = 70.0
#: Largest ratio of torques that share a mesh: its elements suit the smallest torque, its fine part the largest.
_SPAN = 5.0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings for the computation of a phase.

    Parameters
    ----------
    fineness
        Fineness of the meshes.
    penalty
        Contact stiffness, as a multiple of the usual one.
    large_displacements
        Whether strains are of second order and the equilibrium is that of the deformed teeth.
    """

    fineness: Fineness = field(default_factory=Fineness)
    penalty: float = 1.0
    large_displacements: bool = False


def solve_phase(
    pair: Pair, gaps: tuple[GapEffect, ...], phase: float, torques: tuple[float, ...], settings: Settings
) -> PhaseResult:
    """A phase under rising torques [N·m], from the cache if available.

    Elements of touching flanks suit the width of the strip, so torques far apart have different meshes.

    Raises
    ------
    ContactError, MissingDependencyError, MeshingError
        If CalculiX or the mesher fails.
    """
    effects = [(effect.name, asdict(effect)) for effect in gaps]
    key = [asdict(pair), effects, phase, torques, asdict(settings), version()]

    def solve(some: tuple[float, ...]) -> PhaseResult:
        try:
            return _solve(pair, gaps, phase, some, settings, start=0.3)
        except ContactError:  # another start of the iteration
            return _solve(pair, gaps, phase, some, settings, start=0.8)

    return kept(key, lambda: joined([solve(some) for some in _similar_torques(torques)]))


def _similar_torques(torques: tuple[float, ...]) -> list[tuple[float, ...]]:
    """Rising torques in runs that are no farther apart than ``_SPAN``."""
    runs: list[tuple[float, ...]] = []
    for torque in torques:
        if runs and torque <= _SPAN * runs[-1][0]:
            runs[-1] = (*runs[-1], torque)
        else:
            runs.append((torque,))
    return runs


def _solve(
    pair: Pair, gaps: tuple[GapEffect, ...], phase: float, torques: tuple[float, ...], settings: Settings, start: float
) -> PhaseResult:
    r_b, b = pair.gears[0].base_radius, pair.meshing.face_width
    forces = [1e3 * torque / r_b for torque in torques]
    placement, near = pressed(pair, gaps, phase, (forces[0] / b, forces[-1] / b), start)
    loads = (0.5 * forces[0] / b, 0.5 * forces[-1] / b)
    own = (("PINION", (0.0, 0.0), r_b), ("WHEEL", (0.0, pair.meshing.centre_distance), None))
    seats = [Seat(placement=placement, index=index, touches=near) for index in (0, 1)]
    parts = [
        Part(
            name=name,
            mesh=gear_mesh([seat], loads, settings.fineness),
            material=pair.materials[seat.index],
            axis=axis,
            base_radius=radius,
        )
        for seat, (name, axis, radius) in zip(seats, own, strict=True)
    ]
    steps = [NodalLoad(force=factor * force) for force in forces for factor in (1.0, 1 + INCREMENT)]
    text = deck(
        parts,
        contact_pairs(seats[0], ("PINION", "WHEEL")),
        steps,
        penalty=settings.penalty * stiff(pair, loads[0]),
        large_displacements=settings.large_displacements,
        thickness=b,
    )
    pairs = {touch.pair: seats[0].label(touch.pair) for touch in near}
    done = run(text, list(pairs.values()))
    at, beyond = done[::2], done[1::2]
    total = [sum(step.moment.values()) for step in at]
    return PhaseResult(
        approach=[placement.advance + step.rotation for step in at],
        stiffness=[
            INCREMENT * force / (more.rotation - step.rotation)
            for force, step, more in zip(forces, at, beyond, strict=True)
        ],
        share={k: [step.moment[own] / all_ for step, all_ in zip(at, total, strict=True)] for k, own in pairs.items()},
        radius={k: [math.hypot(*step.centre[own]) for step in at] for k, own in pairs.items()},
    )


def pressed(
    pair: Pair, gaps: tuple[GapEffect, ...], phase: float, line_loads: tuple[float, float], start: float
) -> tuple[Placement, list[Touch]]:
    """The gears at a phase, pressed into one another a little, and the tooth pairs that may touch.

    ``line_loads`` [N/mm]: least and greatest of the mesh; ``start``: share of its expected deflection under the least.
    """
    profiles = (Profile(pair=pair, gear=0, effects=gaps), Profile(pair=pair, gear=1, effects=gaps))
    rest = Placement(pair=pair, phase=phase, profiles=profiles)
    touches = rest.touches()
    least = min(touch.gap for touch in touches)
    near = [touch for touch in touches if touch.gap < least + 2 * line_loads[1] * _GUESS]
    return replace(rest, advance=least + start * line_loads[0] * _GUESS), near


def contact_pairs(seat: Seat, parts: tuple[str, str]) -> list[ContactPair]:
    """Surfaces of a mesh of two parts: the gear whose tip is nearer along the path of contact is the slave."""
    meshing = seat.placement.pair.meshing
    middle, pairs = (meshing.path_start + meshing.path_end) / 2, []
    for touch in seat.touches:
        slave = 1 if seat.placement.path_position(touch.pair) < middle else 0
        pairs.append(ContactPair(name=seat.label(touch.pair), slave=parts[slave], master=parts[1 - slave]))
    return pairs


def stiff(pair: Pair, line_load: float) -> float:
    """Penalty [MPa/mm] in which flanks under a line load [N/mm] hardly sink."""
    width = math.sqrt(4 * line_load * pair.normal_module * 3 / (math.pi * pair.contact_modulus))
    return _PENALTY * pair.contact_modulus / width
