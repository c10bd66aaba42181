"""Scenes on which default settings are judged: pairs in use and drawn ones, modified, under many loads.

``python -m tests.support.default_curves FOLDER SEED EVERY FIRST`` keeps a row for each,
and each converged curve, in FOLDER.
"""

from __future__ import annotations

import csv
import json
import logging
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench import read_scene
from gearbench.contact import transitions
from gearbench.contact.gaps import gap_kinks
from gearbench.contact.look import scene_lines
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
from gearbench.geometry.quadrature import interpolation
from gearbench.results.cycle import MeshCycle, Phases, coefficients, peak_to_peak
from gearbench.results.outputs import output
from gearbench.scene import Load, Resolution, Scene
from gearbench.solution import solve_lines, solve_scene
from studies.s05_tooth_models.pairs import draw, in_use
from tests.support.paths import EXAMPLES

CURVES = ("transmission_error", "mesh_stiffness")
#: Harmonics that hold at default settings, pairs drawn beside those in use, and torques over those of the scenes.
HIGHEST, DRAWN, TORQUES = 8, 24, (0.1, 0.3, 1.0, 2.0)
#: Distance of the phases whose second differences are compared, and how many on either side of a transition.
STEP, BESIDE = 1 / 160, 6
EXAMPLES = EXAMPLES / "gears"


def drawn_scenes(folder: Path, seed: int) -> Iterator[tuple[str, Scene]]:
    """(name, scene): nine variants of pairs in use and of those drawn by ``seed``; grids are files in ``folder``."""
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
    """What is added to a pair, and whether it touches off the line of action, by name."""
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
    """Topography of the pinion: crowned both ways, twisted and rough."""
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
    """More segments on a line, and panels that end at uniform phases too, the denser the nearer to a birth."""
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
    """Greatest error of a harmonic over max(5 % of itself, 0.2 % of peak-to-peak); relative error of peak-to-peak."""
    found, wanted = (2 * coefficients(c.phases, getattr(c, name), HIGHEST) for c in (cycle, exact))
    # of the samples: where nodes of a spur pair touch one after the other, polynomials of tiny panels overshoot
    span = float(np.ptp(getattr(exact, name)))
    allowed = np.maximum(0.05 * np.abs(wanted), 0.002 * span)
    whole = float(peak_to_peak(cycle.phases, getattr(cycle, name)))
    return float(np.max(np.abs(found - wanted) / allowed)), abs(whole / span - 1)


def values_at(cycle: MeshCycle, name: str, phase: NDArray) -> NDArray:
    """Values at any phases of the polynomials on the panels."""
    edges, size = cycle.phases.edges, cycle.phases.size
    assert size is not None
    at = edges[0, 0] + (phase - edges[0, 0]) % 1.0
    panel = np.clip(np.searchsorted(edges[:, 0], at, side="right") - 1, 0, len(edges) - 1)
    t = 2 * (at - edges[panel, 0]) / (edges[panel, 1] - edges[panel, 0]) - 1
    by_panel = getattr(cycle, name).reshape(-1, size)
    return np.einsum("ij,ij->i", interpolation(size, t), by_panel[panel])


def sharpest_spike(cycle: MeshCycle, exact: MeshCycle) -> float:
    """Greatest second difference of k at a transition over its neighbours', where the converged curve is smooth."""
    worst, least = 0.0, 2e-3 * float(np.ptp(exact.mesh_stiffness))
    steps = (np.arange(-BESIDE, BESIDE + 1) + 0.37) * STEP
    for edge in np.unique(cycle.phases.edges[:, 0] % 1.0):
        here, true = (_sharpness(values_at(c, "mesh_stiffness", edge + steps), least) for c in (cycle, exact))
        if true <= 1.5:
            worst = max(worst, here)
    return worst


def _sharpness(values: NDArray, least: float) -> float:
    change = np.abs(np.diff(values, 2))
    return float(change[4:7].max() / max(change[1:3].max(), change[8:10].max(), least))


def judged(scene: Scene, exact: MeshCycle) -> dict[str, float]:
    """What default settings miss of the ``exact`` curves, and noise floors over errors of the amplitudes."""
    begin = time.process_time()
    solved = solve_scene(scene)
    row: dict[str, float] = {"seconds": time.process_time() - begin, "phases": len(solved.weight)}
    for name in CURVES:
        row[f"{name} harmonics"], row[f"{name} range"] = misses(solved.cycle, exact, name)
        floor = output(solved, f"{name}_amplitude_noise_floor")[1][:HIGHEST]
        found, wanted = (2 * np.abs(coefficients(c.phases, getattr(c, name), HIGHEST)) for c in (solved.cycle, exact))
        error = np.abs(found - wanted)
        row[f"{name} error over floor"] = float(np.max(error / floor))
        row[f"{name} floor over error"] = float(floor.max() / error.max())
    row["spike"] = sharpest_spike(solved.cycle, exact)
    return row


def missed(row: dict[str, float]) -> float:
    """How many times a row misses the worst of its limits, 1 where it just holds it."""
    limits = {"harmonics": 1.0, "range": 0.01}
    return max(max(row[f"{name} {kind}"] / limit for kind, limit in limits.items()) for name in CURVES)


def judge(folder: Path, seed: int, every: int, first: int = 0) -> Iterator[tuple[str, dict[str, float]]]:
    """(name, row) of some of the scenes; converged curves are kept in ``folder``."""
    for name, scene in islice(drawn_scenes(folder, seed), first, None, every):
        yield name, judged(scene, _kept(folder / f"{scene.digest}.npz", partial(converged, scene)))


def _kept(path: Path, make: Callable[[], MeshCycle]) -> MeshCycle:
    """A cycle from a file, made where that is not there."""
    if not path.exists():
        made = make()
        arrays = {name: getattr(made, name) for name in CURVES}
        np.savez(path, phase=made.phases.phase, weight=made.phases.weight, **arrays)
    with np.load(path) as found:
        phases = Phases(phase=found["phase"], weight=found["weight"], size=5)
        return MeshCycle(phases=phases, **{name: found[name] for name in CURVES})


def main(folder: Path, seed: int, every: int, first: int = 0) -> None:
    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    folder.mkdir(parents=True, exist_ok=True)
    for name, row in judge(folder, seed, every, first):
        with (folder / "rows.jsonl").open("a") as file:
            file.write(json.dumps({"name": name, "missed": missed(row), **row}) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:]))
