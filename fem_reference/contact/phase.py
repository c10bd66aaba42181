"""One mesh phase by contact finite elements in plane strain."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace

from fem_reference.contact.calculix import ContactError, run, version
from fem_reference.contact.deck import NodalLoad, deck
from fem_reference.contact.mesh import Fineness, gear_mesh
from fem_reference.contact.placement import Placement
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
    profiles = (Profile(pair=pair, gear=0, effects=gaps), Profile(pair=pair, gear=1, effects=gaps))
    rest = Placement(pair=pair, phase=phase, profiles=profiles)
    r_b, b = pair.gears[0].base_radius, pair.meshing.face_width
    forces = [1e3 * torque / r_b for torque in torques]
    touches = rest.touches()
    least = min(touch.gap for touch in touches)
    deepest = least + 2 * forces[-1] / b * _GUESS
    near = [touch for touch in touches if touch.gap < deepest]
    placement = replace(rest, advance=least + start * forces[0] / b * _GUESS)
    loads = (0.5 * forces[0] / b, 0.5 * forces[-1] / b)
    meshes = (
        gear_mesh(placement, 0, near, loads, settings.fineness),
        gear_mesh(placement, 1, near, loads, settings.fineness),
    )
    steps = [NodalLoad(force=factor * force) for force in forces for factor in (1.0, 1 + INCREMENT)]
    width = math.sqrt(4 * loads[0] * pair.normal_module * 3 / (math.pi * pair.contact_modulus))
    penalty = settings.penalty * _PENALTY * pair.contact_modulus / width
    pairs = [touch.pair for touch in near]
    # the gear whose tip is nearer along the path of contact
    before = {k: placement.path_position(k) < (pair.meshing.path_start + pair.meshing.path_end) / 2 for k in pairs}
    slaves = {k: 1 if early else 0 for k, early in before.items()}
    text = deck(
        pair,
        meshes,
        steps,
        penalty=penalty,
        slaves=slaves,
        large_displacements=settings.large_displacements,
        thickness=b,
    )
    done = run(text, pairs)
    at, beyond = done[::2], done[1::2]
    total = [sum(step.moment.values()) for step in at]
    return PhaseResult(
        approach=[placement.advance + step.rotation for step in at],
        stiffness=[
            INCREMENT * force / (more.rotation - step.rotation)
            for force, step, more in zip(forces, at, beyond, strict=True)
        ],
        share={k: [step.moment[k] / whole for step, whole in zip(at, total, strict=True)] for k in pairs},
        radius={k: [math.hypot(*step.centre[k]) for step in at] for k in pairs},
    )
