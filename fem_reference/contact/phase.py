"""One mesh phase by contact finite elements, kept on disk."""

from __future__ import annotations

import hashlib
import json
import math
import os
import tempfile
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from fem_reference.cache import cache_folder, code_version
from fem_reference.contact.calculix import ContactError, run, version
from fem_reference.contact.deck import Load, deck
from fem_reference.contact.mesh import Fineness, gear_mesh
from fem_reference.contact.placement import Placement
from fem_reference.contact.profile import Profile
from gearbench.effects.base import GapEffect
from gearbench.geometry.pair import Pair
from gearbench.geometry.role import Role

#: Load increment for the stiffness.
INCREMENT = 0.02
#: Compliance of a pair of steel teeth for a first guess of the deflection [mm per N/mm].
_GUESS = 1 / 14e3
#: Penalty p/δ = this · E*/a; the pairs then sink into one another by less than a thousandth of their deflection.
_PENALTY = 70.0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a phase is computed.

    Parameters
    ----------
    fineness
        Of the meshes.
    penalty
        Contact stiffness, as a multiple of the usual one.
    large_displacements
        Whether strains are of second order and the equilibrium is that of the deformed teeth.
    """

    fineness: Fineness = field(default_factory=Fineness)
    penalty: float = 1.0
    large_displacements: bool = False


@dataclass(frozen=True, kw_only=True)
class PhaseResult:
    """A mesh phase under each torque.

    Parameters
    ----------
    approach
        q [mm], how far the pinion turns beyond the conjugate position, along the line of action, (torque,).
    stiffness
        ∂F_bt/∂q [N/mm], (torque,).
    share
        Tooth pair → its share of the torque, (torque,).
    radius
        Tooth pair → radius on the pinion where it touches [mm], NaN where it does not, (torque,).
    """

    approach: list[float]
    stiffness: list[float]
    share: dict[int, list[float]]
    radius: dict[int, list[float]]


def solve_phase(
    pair: Pair, gaps: tuple[GapEffect, ...], phase: float, torques: tuple[float, ...], settings: Settings
) -> PhaseResult:
    """A phase under rising torques [N·m], from the cache where the same was computed before.

    Raises
    ------
    ContactError, MissingDependencyError, MeshingError
        As CalculiX and the mesher fail.
    """
    path = _entry(pair, gaps, phase, torques, settings)
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        for name in ("share", "radius"):
            found[name] = {int(k): values for k, values in found[name].items()}
        return PhaseResult(**found)
    except (OSError, ValueError, KeyError, TypeError):
        pass
    try:
        result = _solve(pair, gaps, phase, torques, settings, start=0.3)
    except ContactError:  # another start of the iteration
        result = _solve(pair, gaps, phase, torques, settings, start=0.8)
    _store(path, result)
    return result


def _solve(
    pair: Pair, gaps: tuple[GapEffect, ...], phase: float, torques: tuple[float, ...], settings: Settings, start: float
) -> PhaseResult:
    profiles = (Profile(pair=pair, role=Role.PINION, effects=gaps), Profile(pair=pair, role=Role.WHEEL, effects=gaps))
    rest = Placement(pair=pair, phase=phase, profiles=profiles)
    r_b, b = pair.gears[0].base_radius, pair.face_width
    forces = [1e3 * torque / r_b for torque in torques]
    touches = rest.touches()
    least = min(touch.gap for touch in touches)
    deepest = least + 2 * forces[-1] / b * _GUESS
    near = [touch for touch in touches if touch.gap < deepest]
    placement = replace(rest, advance=least + start * forces[0] / b * _GUESS)
    load = 0.5 * float(np.median(forces)) / b
    meshes = (
        gear_mesh(placement, Role.PINION, near, load, settings.fineness),
        gear_mesh(placement, Role.WHEEL, near, load, settings.fineness),
    )
    steps = [Load(force=factor * force) for force in forces for factor in (1.0, 1 + INCREMENT)]
    width = math.sqrt(4 * load * pair.normal_module * 3 / (math.pi * pair.material.plane_strain_modulus / 2))
    penalty = settings.penalty * _PENALTY * pair.material.plane_strain_modulus / 2 / width
    pairs = [touch.pair for touch in near]
    # the gear whose tip is nearer along the path of contact
    before = {k: placement.path_position(k) < (pair.meshing.path_start + pair.meshing.path_end) / 2 for k in pairs}
    slaves = {k: Role.WHEEL if early else Role.PINION for k, early in before.items()}
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


def _entry(
    pair: Pair, gaps: tuple[GapEffect, ...], phase: float, torques: tuple[float, ...], settings: Settings
) -> Path:
    effects = [(effect.name, asdict(effect)) for effect in gaps]
    key = [asdict(pair), effects, phase, torques, asdict(settings), _code(), version()]
    digest = hashlib.sha256(json.dumps(key, sort_keys=True, default=repr).encode()).hexdigest()[:32]
    return cache_folder() / f"contact-{digest}.json"


@cache
def _code() -> str:
    """Hash of the sources that determine a result."""
    total = hashlib.sha256(code_version().encode())
    for name in ("calculix", "deck", "mesh", "phase", "placement", "profile"):
        total.update(Path(__file__).with_name(f"{name}.py").read_bytes())
    return total.hexdigest()


def _store(path: Path, result: PhaseResult) -> None:
    """Whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        json.dump(asdict(result), file)
    Path(name).replace(path)
