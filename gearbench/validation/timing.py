"""What a model costs: wall times, medians of repeats after warm-up."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from statistics import median

from gearbench.contact.assemble import mesh_phases, scene_lines
from gearbench.scene import Scene
from gearbench.simulation import simulate
from gearbench.validation.reference import smooth_effects

REPEATS = 5


def compliance_seconds(scene: Scene, repeats: int = REPEATS) -> float:
    """Time [s] of the smooth compliance of a pair that was not seen before, on the lines of all positions."""
    fresh = iter([unseen(scene, i + 1) for i in range(repeats)])
    return _median(lambda: smooth_compliance(next(fresh)), repeats)


def simulation_seconds(scene: Scene, repeats: int = REPEATS) -> float:
    """Time [s] of STE and stiffness of all positions, the teeth being known."""
    return _median(lambda: simulate(scene), repeats)


def unseen(scene: Scene, i: int) -> Scene:
    """The same scene with a face width larger by i · 10⁻⁹, so that nothing kept for its pair serves it."""
    return replace(scene, pair=replace(scene.pair, face_width=scene.pair.face_width * (1 + 1e-9 * i)))


def smooth_compliance(scene: Scene) -> None:
    """Compute the smooth compliances of ``scene`` on all its contact lines."""
    lines = scene_lines(scene, mesh_phases(scene)[0])
    for effect in smooth_effects(scene):
        effect.compliance(lines)


def _median(run: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return median(times)
