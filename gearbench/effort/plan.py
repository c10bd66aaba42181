"""Parts of a run with the cost of each: measured on a few mesh phases and extrapolated.

Every part costs a constant and an amount for each mesh phase. Both are found by running it on a few phases, so that the
prediction holds on any machine and for any effect. The set-up of an effect for a pair (the Ritz system of a tooth,
say) is part of the prediction; a set-up that is kept on disk is not run but estimated. So many segments that trials
would take long are not run either: two coarser ones show how each part grows with them.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import mesh_phases, scene_lines
from gearbench.contact.size import contact_memory
from gearbench.effects.base import ComplianceEffect, Dense, Effect, GapEffect, LowRank
from gearbench.effort.clock import peak_megabytes, quickest, unseen
from gearbench.geometry.action import ContactLines
from gearbench.results.outputs import DEFAULT_OUTPUTS
from gearbench.results.solved import Solved
from gearbench.scene import Resolution, Scene
from gearbench.solution import dataset, solve_lines

#: Phases of the short and the long trial; a cycle with no more phases than the long one is tried as a whole.
TRIALS = (4, 32)
#: Each trial is repeated, and the quickest counts: the machine has other things to do at times.
REPEATS = 2
#: Segments of the finest trial, and how each part may grow with their number beyond it, at least and at most.
FINEST, GROWTH = 32, (1.0, 2.5)
#: Error samples of the robustness run that is predicted.
SAMPLES = 1000


@dataclass(frozen=True)
class Part:
    """One part of a run: name, purpose, size, and predicted time [s]."""

    name: str
    does: str
    size: str
    seconds: float


@dataclass(frozen=True)
class Plan:
    """All parts of a run.

    Parameters
    ----------
    parts
        In the order they run; the last one is ``robust`` where the scene has random errors.
    seconds, megabytes
        Predicted time [s] and peak memory [MB] of ``simulate``.
    robust_seconds
        Predicted time [s] of ``robust`` with 1000 samples; 0 without random errors.
    """

    parts: tuple[Part, ...]
    seconds: float
    megabytes: float
    robust_seconds: float = 0.0


@dataclass(frozen=True)
class Trial:
    """A scene on some of its mesh phases."""

    scene: Scene
    lines: ContactLines

    @property
    def weight(self) -> NDArray:
        """Weights of the phases, all alike."""
        return np.full(len(self.lines.mesh_phase), 1 / len(self.lines.mesh_phase))

    def solved(self) -> Solved:
        """The contact problem assembled and solved."""
        return solve_lines(self.scene, self.lines, self.weight)

    def unseen(self, number: int) -> Trial:
        """The trial on a pair that no effect has set up anything for, unless that is kept on disk."""
        if any(_kept_on_disk(effect, self) for effect in self.scene.effects):
            return self
        scene = unseen(self.scene, number)
        return Trial(scene, scene_lines(scene, self.lines.mesh_phase))


@dataclass(frozen=True)
class Trials:
    """A scene on few and on more of its ``total`` phases."""

    short: Trial
    long: Trial
    total: int

    def at_all(self, few: float, many: float) -> float:
        """A cost at all phases from those of both trials."""
        return extrapolated(few, many, len(self.short.weight), len(self.long.weight), self.total)

    def seconds(self, work: Callable[[Trial], Any]) -> float:
        """Processor time [s] of ``work`` at all phases."""
        return self.at_all(*(quickest([lambda t=t: work(t)], REPEATS)[0] for t in (self.short, self.long)))


def plan(scene: Scene) -> Plan:
    """Plan of ``simulate`` for ``scene``, and of ``robust`` where it has random errors."""
    if scene.resolution.segments <= FINEST:
        return _plan(scene)
    finest, coarser = (_plan(replace(scene, resolution=_with_segments(scene, n))) for n in (FINEST, FINEST // 2))
    segments = scene.resolution.segments
    before = {part.name: part.seconds for part in coarser.parts}
    parts = tuple(_grown(part, before.get(part.name, part.seconds), segments / FINEST) for part in finest.parts)
    robust = sum(part.seconds for part in parts if part.name.startswith("robust"))
    positions = len(mesh_phases(scene)[0])
    return Plan(
        parts=parts,
        seconds=sum(part.seconds for part in parts) - robust,
        megabytes=contact_memory(scene, positions) / 1e6,
        robust_seconds=robust,
    )


def _with_segments(scene: Scene, segments: int) -> Resolution:
    return replace(scene.resolution, segments=segments)


def _grown(part: Part, before: float, times: float) -> Part:
    """A part with ``times`` as many segments, from its seconds with half as many, ``before``."""
    if part.name == "finite elements" or not before:
        return part
    order = min(max(math.log2(part.seconds / before), GROWTH[0]), GROWTH[1]) if part.seconds else 0.0
    size = re.sub(rf"\b{FINEST} segments", f"{round(FINEST * times)} segments", part.size)
    size = re.sub(r"\d+ loaded", lambda m: f"{round(int(m[0].split()[0]) * times)} loaded", size)
    return replace(part, size=size, seconds=part.seconds * times**order)


def _plan(scene: Scene) -> Plan:
    """The plan from trials with all its segments."""
    phase, _ = mesh_phases(scene)
    kept = sum(effect.preparation(scene.pair, scene.effects_by_name) or 0.0 for effect in scene.effects)
    scene = _without_preparation(scene)
    trials = _trials(scene, phase)
    short, long = trials.short, trials.long
    long.solved()  # compiled code is loaded, tables are made
    pairs, segments = long.lines.shape[1:]
    how = "uniform" if scene.resolution.positions is not None else "Gauss panels"
    size = f"{len(phase)} positions ({how}) × {pairs} pairs × {segments} segments"
    seconds = trials.seconds(lambda t: scene_lines(t.scene, t.lines.mesh_phase))
    parts = [Part("contact lines", "positions and lengths of all segments", size, seconds)]
    if kept:
        parts.append(Part("finite elements", "computed once and kept on disk", "", kept))
    spent = [trials.seconds(lambda t, e=effect: _contribution(e, t)) for effect in scene.effects]
    for effect, seconds in zip(scene.effects, spent, strict=True):
        parts.append(Part(effect.name, effect.summary, _size(effect, short), seconds + _set_up(effect, short)))
    loaded = f"{int(np.mean(long.lines.active.sum(axis=1)) * len(phase) * segments)} loaded segments"
    contact = max(trials.seconds(Trial.solved) - sum(spent), 0.0)
    parts.append(Part("contact", "structured Newton, amplitudes and approach", loaded, contact))
    solved = {id(t): t.solved() for t in (short, long)}
    parts.append(Part("dataset", "variables and provenance", "", trials.seconds(lambda t: _dataset(solved[id(t)]))))
    robust = _robust_parts(trials)
    return Plan(
        parts=(*parts, *robust),
        seconds=sum(part.seconds for part in parts),
        megabytes=_megabytes(trials),
        robust_seconds=sum(part.seconds for part in robust),
    )


def _megabytes(trials: Trials) -> float:
    """Peak memory: each stage has its own, and which one is the highest depends on the number of phases."""
    fresh = [(trials.short.unseen(n), trials.long.unseen(n + 1)) for n in (1, 3)]
    stages = (Trial.solved, lambda t: _dataset(t.solved()))
    return max(
        trials.at_all(*(peak_megabytes(lambda t=t, s=s: s(t)) for t in pair))
        for s, pair in zip(stages, fresh, strict=True)
    )


def _trials(scene: Scene, phase: NDArray) -> Trials:
    """The scene at few and at more of its phases, spread over the cycle: whole panels where it has Gauss panels."""
    size = scene.resolution.panel_size or 1
    by_panel = phase.reshape(-1, size)

    def trial(panels: int) -> Trial:
        some = np.linspace(0, len(by_panel) - 1, min(panels, len(by_panel))).round().astype(int)
        return Trial(scene, scene_lines(scene, by_panel[some].ravel()))

    return Trials(trial(max(TRIALS[0] // size, 1)), trial(max(TRIALS[1] // size, 2)), len(phase))


def _without_preparation(scene: Scene) -> Scene:
    """The scene with a quick tooth in place of one, with its body, that would first compute for minutes."""
    if not any(effect.preparation(scene.pair, scene.effects_by_name) for effect in scene.effects):
        return scene
    from gearbench.effects.tooth_bending import ToothBending

    rest = tuple(effect for effect in scene.effects if effect.name not in (ToothBending.name, "gear_body"))
    return replace(scene, effects=(ToothBending(order=(5, 5)), *rest))


def extrapolated(few: float, many: float, short: int, long: int, total: int) -> float:
    """Cost at ``total`` phases from those at ``short`` and ``long``: a constant and an amount for each phase."""
    if long >= total or short == long:
        return many
    return many + max(many - few, 0.0) / (long - short) * (total - long)


def _contribution(effect: Effect, trial: Trial) -> Any:
    """Gap or compliance that the effect adds on the lines of the trial."""
    if isinstance(effect, GapEffect):
        return effect.gap(trial.lines)
    return effect.compliance(trial.lines, trial.scene.effects_by_name) if isinstance(effect, ComplianceEffect) else None


def _kept_on_disk(effect: Effect, trial: Trial) -> bool:
    return effect.preparation(trial.scene.pair, trial.scene.effects_by_name) is not None


def _set_up(effect: Effect, trial: Trial) -> float:
    """Time [s] that the effect takes for a pair it has not seen, beyond the time it takes each time."""
    fresh = trial.unseen(5)
    first, again = (quickest([lambda: _contribution(effect, fresh)], 1)[0] for _ in range(2))
    return 0.0 if _kept_on_disk(effect, trial) else max(first - again, 0.0)


def _size(effect: Effect, trial: Trial) -> str:
    """Unknowns that the effect adds."""
    if not isinstance(effect, ComplianceEffect):
        return ""
    part = _contribution(effect, trial)
    if isinstance(part, LowRank):
        return f"{part.factor.shape[-1]} amplitudes a pair"
    return "all segments with each other" if isinstance(part, Dense) else "one law a segment"


def _dataset(solved: Solved) -> None:
    dataset(solved, DEFAULT_OUTPUTS, time.perf_counter())


def _robust_parts(trials: Trials) -> list[Part]:
    """The batch of error samples, none without errors: one chunk of them at a few phases, extrapolated."""
    scene = trials.long.scene
    if scene.effect("manufacturing_errors") is None:
        return []
    from gearbench.contact._batch_kernels import LANES
    from gearbench.contact.batch import solve_one_chunk
    from gearbench.robustness.dataset import robust_dataset
    from gearbench.robustness.montecarlo import RobustProblem, default_threads, prepare_phases, respond

    def prepared(trial: Trial) -> RobustProblem:
        return prepare_phases(scene, trial.lines.mesh_phase, trial.weight)

    few, many = prepared(trials.short), prepared(trials.long)
    errors = few.draw(SAMPLES, 0, "sobol")
    draws = errors[:LANES] - few.mean
    responses, _ = respond(few, errors)
    threads = default_threads()
    rounds = -(-SAMPLES // (LANES * threads))
    seconds = trials.seconds(prepared)
    seconds += rounds * trials.seconds(lambda t: solve_one_chunk((few if t is trials.short else many).batch, draws))
    seconds += quickest(
        [lambda: robust_dataset(few, errors, responses, complete=True, sampler="sobol", seed=0, wall_time=0.0)], REPEATS
    )[0]
    batch = many.batch
    path = "structured" if batch.reference is None else "conjugate gradients"
    size = f"{path}: rank {batch.rank} a block, {batch.modes.shape[1]} errors, {threads} threads"
    return [Part(f"robust ({SAMPLES} samples)", "batch of samples in lanes", size, seconds)]
