"""What a scene will run, part by part, with the cost of each part."""

from __future__ import annotations

from dataclasses import dataclass

from gearbench.contact.assemble import mesh_phases, scene_lines
from gearbench.effects.base import ComplianceEffect, LowRank
from gearbench.scene import Scene

# Seconds per unit of work, measured on one core at 2.5 GHz; a prediction, good to a factor of about two.
_PER_POINT = {"compliance": 1.5e-7, "gap": 2e-8}
_PER_EFFECT = 1.5e-4
_PER_MULTIPLICATION = 1.0e-9
_NEWTON_STEPS = 7
_LAW = 120  # multiplications that one evaluation of a contact law is worth
_SAMPLES = 1000
_BATCH_STEPS, _BATCH_LAW, _BATCH_MULTIPLICATION = 4.2, 40, 1.1e-10


@dataclass(frozen=True)
class Part:
    """One part of a run: name, what it does, size, and predicted time [s]."""

    name: str
    does: str
    size: str
    seconds: float


@dataclass(frozen=True)
class Plan:
    """All parts of a run, with the predicted total time [s] and memory [MB]."""

    parts: tuple[Part, ...]
    seconds: float
    megabytes: float


def make_plan(scene: Scene) -> Plan:
    """Plan of ``simulate`` for ``scene``, and of ``robust`` where it has random errors; nothing is solved."""
    phase, _ = mesh_phases(scene)
    lines = scene_lines(scene, phase)
    positions, pairs, segments = lines.shape
    points = positions * pairs * segments
    how = "uniform" if scene.resolution.positions is not None else "Gauss panels"
    size = f"{positions} positions ({how}) × {pairs} pairs × {segments} segments"
    parts = [Part("contact lines", "places and lengths of all segments", size, _PER_EFFECT)]
    rank = 0
    for effect in scene.effects:
        if not isinstance(effect, ComplianceEffect):
            parts.append(Part(effect.name, effect.summary, "", _PER_EFFECT + points * _PER_POINT["gap"]))
            continue
        part = effect.compliance(lines)
        columns = part.factor.shape[-1] if isinstance(part, LowRank) else 0
        rank += columns
        detail = f"{columns} amplitudes a pair" if columns else "one law a segment"
        seconds = _PER_EFFECT + points * _PER_POINT["compliance"]
        parts.append(Part(effect.name, effect.summary, detail, seconds))
    loaded = int(lines.active.sum()) * segments
    rank = min(rank, segments)
    work = loaded * (rank * (rank + 1) / 2 + 4 * rank + _LAW) + int(lines.active.sum()) * rank**3 / 3
    seconds = work * _NEWTON_STEPS * _PER_MULTIPLICATION
    parts.append(Part("contact", "structured Newton, amplitudes and approach", f"{loaded} loaded segments", seconds))
    if scene.effect("manufacturing_errors") is not None:
        parts.append(_robust_part(scene, loaded))
    megabytes = 8e-6 * points * (rank + 12)
    return Plan(tuple(parts), sum(part.seconds for part in parts), megabytes)


def _robust_part(scene: Scene, loaded: int) -> Part:
    """The batch of error samples: which path it takes is read off the rank it needs on the contact lines."""
    from gearbench.robustness.montecarlo import default_threads, prepare_scene

    batch = prepare_scene(scene).batch
    rank, threads = batch.rank, default_threads()
    work = loaded * (rank * (rank + 1) / 2 + 4 * rank + _BATCH_LAW) + int(batch.blocks.sum()) * rank**3 / 3
    seconds = _SAMPLES * _BATCH_STEPS * work * _BATCH_MULTIPLICATION / threads
    # the cheaper one: as many amplitudes as the compliance has independent columns on a contact line, or all segments
    full = rank >= scene.resolution.segments
    path = "dense, one amplitude a segment" if full else "structured"
    size = f"{path}: rank {rank} a block, {batch.modes.shape[1]} errors, {threads} threads"
    return Part(f"robust ({_SAMPLES} samples)", "batch of samples in lanes", size, seconds)
