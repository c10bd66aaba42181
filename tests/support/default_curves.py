"""Scenes that judge the default settings: pairs in use and random pairs, with modifications, under many loads."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from gearbench import read_scene
from gearbench.contact import transitions
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import gap_kinks
from gearbench.contact.phases import gauss_phases
from gearbench.effects.base import Effect
from gearbench.effects.crowning import Crowning
from gearbench.effects.end_relief import EndRelief
from gearbench.effects.flank_twist import FlankTwist
from gearbench.effects.gear_body import GearBody
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.profile_crowning import ProfileCrowning
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.topography import Topography
from gearbench.results.cycle import MeshCycle, Phases, coefficients
from gearbench.scene import Load, Resolution, Scene
from gearbench.solution import solve_lines, solve_scene
from studies.s05_tooth_models.pairs import draw, in_use
from tests.support.paths import EXAMPLES

CURVES = ("transmission_error", "mesh_stiffness")
#: Highest harmonic judged, number of random pairs beside the pairs in use, and torques over the torque of the scene.
HIGHEST, DRAWN, TORQUES = 8, 24, (0.1, 0.3, 1.0, 2.0)
EXAMPLES = EXAMPLES / "gears"


def drawn_scenes(folder: Path, seed: int) -> Iterator[tuple[str, Scene]]:
    """Names and scenes: nine variants of all pairs in use and of random pairs by ``seed``; grids go to ``folder``."""
    pairs = [(path.stem, read_scene(path).without("off_line_contact")) for path in sorted(EXAMPLES.glob("*.toml"))]
    for i, scene in enumerate(islice(draw(in_use, seed), DRAWN)):
        bending, hertz = scene.effects
        pairs.append((f"drawn_{i}", replace(scene, effects=(bending, GearBody(), hertz))))
    for i, (name, scene) in enumerate(pairs):
        rng = np.random.default_rng([seed, i])
        yield f"{name} given", scene
        for variant, (extra, off_line) in _variants(scene, rng, folder / f"{name}.csv").items():
            kept = [e for e in scene.effects if e.name in {"tooth_bending", "gear_body", "hertz"}]
            off = [OffLineContact()] if off_line else []
            torque = scene.load.torque * float(rng.choice(TORQUES)) * float(rng.choice([1, -1]))
            yield f"{name} {variant}", replace(scene, effects=(*kept, *extra, *off), load=Load(torque=torque))


def _variants(scene: Scene, rng: np.random.Generator, path: Path) -> dict[str, tuple[list[Effect], bool]]:
    """Effects added to a pair, and whether it has contact off the line of action, by name of the variant."""
    m, b = scene.pair.normal_module, scene.pair.meshing.face_width

    def micrometres(low: float, high: float) -> float:
        return float(m * rng.uniform(low, high))

    def shape() -> str:
        return str(rng.choice(["linear", "parabolic"]))

    def tip() -> Effect:
        return TipRelief(amount=micrometres(2, 8), length=m * float(rng.uniform(0.2, 0.7)), shape=shape())

    def ends() -> Effect:
        return EndRelief(amount=micrometres(2, 8), length=b * float(rng.uniform(0.05, 0.25)), shape=shape())

    def crowning() -> Effect:
        return Crowning(amount=micrometres(1, 5))

    twist, slope = (FlankTwist(pinion=micrometres(-6, 6)) for _ in range(2)), HelixSlope(pinion=micrometres(-3, 3))
    return {
        "relief": ([tip(), crowning()], False),
        "ends": ([ends()], False),
        "ends off": ([tip(), ends()], True),
        "twist": ([crowning(), next(twist), slope], False),
        "twist off": ([tip(), crowning(), next(twist)], True),
        "grid": ([_grid(scene, rng, path)], False),
        "off": ([], True),
        "profile": ([ProfileCrowning(pinion=micrometres(1, 4), wheel=micrometres(1, 4))], bool(rng.integers(2))),
    }


def _grid(scene: Scene, rng: np.random.Generator, path: Path) -> Effect:
    """Topography of the pinion: crowned along profile and face, twisted and rough."""
    gear, m = scene.pair.gears[0], scene.pair.normal_module
    radius = np.linspace(max(gear.base_radius * 1.001, gear.root_radius * 1.02), gear.tip_radius, 9)
    face = np.linspace(0, scene.pair.meshing.face_width, 11)
    s, t = np.linspace(-1, 1, 9)[:, None], np.linspace(-1, 1, 11)
    missing = m * (2 * t**2 + 1.5 * s**2 + rng.uniform(-0.5, 0.5) * s * t + rng.normal(scale=0.1, size=(9, 11)))
    missing -= missing.min()
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["radius", *(f"{y:.6g}" for y in face)])
        writer.writerows([f"{r:.6g}", *(f"{z:.4f}" for z in row)] for r, row in zip(radius, missing, strict=True))
    return Topography(pinion=str(path))


def converged(scene: Scene, segments: int = 45) -> MeshCycle:
    """Converged cycle: more segments, and panels that end at uniform phases too and ever closer to load transfers."""
    fine = replace(scene, resolution=Resolution(segments=segments))
    coarse, transitions.MORE_PHASES = transitions.MORE_PHASES, 96
    transitions.transitions.cache_clear()
    try:
        changes = transitions.transitions(fine, exact=True)
    finally:
        transitions.MORE_PHASES = coarse
        transitions.transitions.cache_clear()
    meshing = scene.pair.meshing
    kinks, face = gap_kinks(scene)
    known = meshing.phases_at((meshing.path_start, meshing.path_end, *kinks), face)
    steps = [sign * 10.0**-p for sign in (-1, 1) for p in (1.5, 2, 2.5, 3, 3.5, 4, 4.5)]
    near = [change.phase + step for change in changes if change.rank == 0 for step in steps]
    phase, weight = gauss_phases([*(change.phase for change in changes), *known, *np.arange(32) / 32, *near], 5)
    parts = [
        solve_lines(fine, scene_lines(fine, phase[i : i + 40]), weight[i : i + 40], 5).solution
        for i in range(0, len(phase), 40)
    ]
    approach, stiffness = (np.concatenate([getattr(p, name) for p in parts]) for name in ("approach", "stiffness"))
    return MeshCycle.of(scene, Phases(phase=phase, weight=weight, size=5), approach, stiffness)


def misses(cycle: MeshCycle, exact: MeshCycle, name: str) -> tuple[float, float]:
    """Greatest error of a harmonic over max(5 % of itself, 0.2 % of peak-to-peak), and error of peak-to-peak [-]."""
    found, wanted = (2 * coefficients(c.phases, getattr(c, name), HIGHEST) for c in (cycle, exact))
    # span of the samples: the polynomials of tiny panels overshoot where nodes of a spur pair touch one by one
    span = float(np.ptp(getattr(exact, name)))
    allowed = np.maximum(0.05 * np.abs(wanted), 0.002 * span)
    whole = float(cycle.curves[name].peak_to_peak)
    return float(np.max(np.abs(found - wanted) / allowed)), abs(whole / span - 1)


def missed(scene: Scene, exact: MeshCycle) -> float:
    """Largest error of the default settings over its limit, against the ``exact`` curves; up to 1 is allowed."""
    found = solve_scene(scene).cycle
    return max(max(harmonics, whole / 0.01) for harmonics, whole in (misses(found, exact, name) for name in CURVES))
