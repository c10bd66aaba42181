"""What a scene will run, part by part, with the cost of each part: measured on a few mesh phases and extrapolated.

Every part costs a constant and an amount for each mesh phase. Both are found by running it on a few phases, so that the
prediction holds on any machine and for any effect. What effects set up once for a pair (the Ritz system of a tooth,
say) is part of the prediction; what they keep on disk is not run but estimated.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import mesh_phases, scene_lines
from gearbench.effects.base import ComplianceEffect, Effect, GapEffect, LowRank
from gearbench.geometry.action import ContactLines
from gearbench.outputs import DEFAULT_OUTPUTS, Solved
from gearbench.scene import Scene
from gearbench.simulation import solve_lines
from gearbench.stopwatch import peak_megabytes, unseen

if TYPE_CHECKING:
    from gearbench.contact.batch import Batch
    from gearbench.robustness.montecarlo import RobustProblem

#: Phases of the short and the long trial; a cycle with no more phases than the long one is tried as a whole.
TRIALS = (4, 32)
#: Each trial is repeated, and the quickest counts: the machine has other things to do at times.
REPEATS = 2
#: Error samples of the robustness run that is predicted.
SAMPLES = 1000


@dataclass(frozen=True)
class Part:
    """One part of a run: name, what it does, size, and predicted time [s]."""

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
    """A scene on ``count`` of its mesh phases."""

    scene: Scene
    lines: ContactLines
    weight: NDArray

    @property
    def count(self) -> int:
        """Number of phases."""
        return len(self.weight)

    def solved(self) -> Solved:
        """The contact problem assembled and solved."""
        return solve_lines(self.scene, self.lines, self.weight)


def make_plan(scene: Scene) -> Plan:
    """Plan of ``simulate`` for ``scene``, and of ``robust`` where it has random errors."""
    phase, _ = mesh_phases(scene)
    kept = sum(effect.preparation(scene.pair, scene.effects_by_name) or 0.0 for effect in scene.effects)
    tried = _without_preparation(scene)
    short, long = _trials(tried, phase)
    long.solved()  # compiled code is loaded, tables are made
    lines, total = long.lines, len(phase)
    pairs, segments = lines.shape[1:]

    def at_all(few: float, many: float) -> float:
        return _extrapolate(few, many, short.count, long.count, total)

    def cost(work: Callable[[Trial], Any]) -> float:
        return at_all(_quickest(lambda: work(short)), _quickest(lambda: work(long)))

    how = "uniform" if scene.resolution.positions is not None else "Gauss panels"
    size = f"{total} positions ({how}) × {pairs} pairs × {segments} segments"
    parts = [Part("contact lines", "places and lengths of all segments", size, cost(_lines_again))]
    if kept:
        parts.append(Part("finite elements", "computed once and kept on disk", "", kept))
    for effect in tried.effects:
        seconds = cost(lambda t, e=effect: _contribution(e, t)) + _set_up(effect, short)
        parts.append(Part(effect.name, effect.summary, _size(effect, short), seconds))
    effects = sum(cost(lambda t, e=effect: _contribution(e, t)) for effect in tried.effects)
    loaded = int(np.mean(lines.active.sum(axis=1)) * total * segments)
    contact = max(cost(lambda t: t.solved()) - effects, 0.0)
    parts.append(Part("contact", "structured Newton, amplitudes and approach", f"{loaded} loaded segments", contact))
    solved = {t.count: t.solved() for t in (short, long)}
    parts.append(Part("dataset", "variables and provenance", "", cost(lambda t: _dataset(solved[t.count]))))
    # each stage has its own peak, and which one is the highest depends on the number of phases
    fresh = [(_unseen(short, n), _unseen(long, n + 1)) for n in (1, 3)]
    stages = (Trial.solved, lambda t: _dataset(t.solved()))
    megabytes = max(
        at_all(*(peak_megabytes(lambda t=t, s=s: s(t)) for t in pair)) for s, pair in zip(stages, fresh, strict=True)
    )
    seconds = sum(part.seconds for part in parts)
    robust = _robust_part(tried, phase)
    return Plan(
        parts=(*parts, *([robust] if robust else [])),
        seconds=seconds,
        megabytes=megabytes,
        robust_seconds=robust.seconds if robust else 0.0,
    )


def _trials(scene: Scene, phase: NDArray) -> tuple[Trial, Trial]:
    """The scene at few and at more of its phases, spread over the cycle: whole panels where it has Gauss panels."""
    size = scene.resolution.panel_size or 1
    by_panel = phase.reshape(-1, size)

    def trial(panels: int) -> Trial:
        some = np.linspace(0, len(by_panel) - 1, min(panels, len(by_panel))).round().astype(int)
        chosen = by_panel[some].ravel()
        return Trial(scene, scene_lines(scene, chosen), np.full(chosen.size, 1 / chosen.size))

    return trial(max(TRIALS[0] // size, 1)), trial(max(TRIALS[1] // size, 2))


def _without_preparation(scene: Scene) -> Scene:
    """The scene with a quick tooth in place of one, with its body, that would first compute for minutes."""
    if not any(effect.preparation(scene.pair, scene.effects_by_name) for effect in scene.effects):
        return scene
    from gearbench.effects.tooth_bending import ToothBending

    rest = tuple(effect for effect in scene.effects if effect.name not in (ToothBending.name, "gear_body"))
    return replace(scene, effects=(ToothBending(order=(5, 5)), *rest))


def _extrapolate(few: float, many: float, short: int, long: int, total: int) -> float:
    """Cost at ``total`` phases from those at ``short`` and ``long``: a constant and an amount for each phase."""
    if long >= total or short == long:
        return many
    return many + max(many - few, 0.0) / (long - short) * (total - long)


def _quickest(work: Callable[[], Any]) -> float:
    """Least time [s] of a few runs."""
    return min(_once(work) for _ in range(REPEATS))


def _lines_again(trial: Trial) -> None:
    scene_lines(trial.scene, trial.lines.mesh_phase)


def _contribution(effect: Effect, trial: Trial) -> Any:
    """Term of the effect on the lines of the trial."""
    if isinstance(effect, GapEffect):
        return effect.gap(trial.lines)
    return effect.compliance(trial.lines, trial.scene.effects_by_name) if isinstance(effect, ComplianceEffect) else None


def _unseen(trial: Trial, number: int) -> Trial:
    """The trial on a pair that no effect has set up anything for, unless that is kept on disk."""
    if any(_kept_on_disk(effect, trial) for effect in trial.scene.effects):
        return trial
    scene = unseen(trial.scene, number)
    return Trial(scene, scene_lines(scene, trial.lines.mesh_phase), trial.weight)


def _kept_on_disk(effect: Effect, trial: Trial) -> bool:
    return effect.preparation(trial.scene.pair, trial.scene.effects_by_name) is not None


def _set_up(effect: Effect, trial: Trial) -> float:
    """Time [s] that the effect takes for a pair it has not seen, beyond what it takes each time."""
    fresh = _unseen(trial, 5)
    first, again = (_once(lambda: _contribution(effect, fresh)) for _ in range(2))
    return 0.0 if _kept_on_disk(effect, trial) else max(first - again, 0.0)


def _once(work: Callable[[], Any]) -> float:
    """Processor time [s] of this thread: what the run takes where nothing else wants the processor."""
    start = time.thread_time()
    work()
    return time.thread_time() - start


def _size(effect: Effect, trial: Trial) -> str:
    """Unknowns that the effect adds."""
    if not isinstance(effect, ComplianceEffect):
        return ""
    part = _contribution(effect, trial)
    return f"{part.factor.shape[-1]} amplitudes a pair" if isinstance(part, LowRank) else "one law a segment"


def _dataset(solved: Solved) -> None:
    from gearbench.simulation import dataset

    dataset(solved, DEFAULT_OUTPUTS, time.perf_counter())


def _robust_part(scene: Scene, phase: NDArray) -> Part | None:
    """The batch of error samples: one chunk of them at a few phases, extrapolated."""
    if scene.effect("manufacturing_errors") is None:
        return None
    from gearbench.contact._batch_kernels import LANES
    from gearbench.contact.batch import solve_one_chunk
    from gearbench.robustness.dataset import robust_dataset
    from gearbench.robustness.montecarlo import default_threads, prepare_phases, respond

    short, long = _trials(scene, phase)
    few, many = (prepare_phases(scene, t.lines.mesh_phase, t.weight) for t in (short, long))
    errors = few.draw(SAMPLES, 0, "sobol")
    draws = errors[:LANES] - few.mean
    responses, _ = respond(few, errors)

    def cost(work: Callable[[Trial, RobustProblem], Any]) -> float:
        times = _quickest(lambda: work(short, few)), _quickest(lambda: work(long, many))
        return _extrapolate(*times, short.count, long.count, len(phase))

    threads = default_threads()
    rounds = -(-SAMPLES // (LANES * threads))
    seconds = cost(lambda t, _: prepare_phases(scene, t.lines.mesh_phase, t.weight))
    seconds += rounds * cost(lambda _, problem: solve_one_chunk(problem.batch, draws))
    seconds += _quickest(
        lambda: robust_dataset(few, errors, responses, complete=True, sampler="sobol", seed=0, wall_time=0.0)
    )
    return Part(f"robust ({SAMPLES} samples)", "batch of samples in lanes", _path(many.batch, threads), seconds)


def _path(batch: Batch, threads: int) -> str:
    """As many amplitudes as the compliance has independent columns on a contact line, or as there are segments."""
    full = batch.rank >= int(batch.count.max()) // int(batch.blocks.max())
    path = "dense, one amplitude a segment" if full else "structured"
    return f"{path}: rank {batch.rank} a block, {batch.modes.shape[1]} errors, {threads} threads"
