"""What a model costs: wall times, medians of repeats after warm-up."""

from __future__ import annotations

from gearbench.contact.assemble import mesh_phases, scene_lines
from gearbench.scene import Scene
from gearbench.simulation import simulate
from gearbench.stopwatch import times, unseen
from gearbench.validation.reference import smooth_effects

REPEATS = 5


def compliance_seconds(scene: Scene, repeats: int = REPEATS) -> float:
    """Time [s] of the smooth compliance of a pair that was not seen before, on the lines of all positions."""
    fresh = iter([unseen(scene, i + 1) for i in range(repeats)])
    return times(lambda: smooth_compliance(next(fresh)), repeats)["seconds"]


def simulation_seconds(scene: Scene, repeats: int = REPEATS) -> float:
    """Time [s] of STE and stiffness of all positions, the teeth being known."""
    return times(lambda: simulate(scene), repeats)["seconds"]


def smooth_compliance(scene: Scene) -> None:
    """Compute the smooth compliances of ``scene`` on all its contact lines."""
    lines = scene_lines(scene, mesh_phases(scene)[0])
    for effect in smooth_effects(scene):
        effect.compliance(lines, scene.effects_by_name)
