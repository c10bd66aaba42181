"""Parts of a run with the cost of each: measured on a few mesh phases and extrapolated.

Every part costs an amount once for a pair that is new (the Ritz system of a tooth, say), a constant, and an amount for
each mesh phase. They are found by running it on a few phases (``trials``), so that the prediction holds on any machine
and for any effect. What is large is run coarser: two numbers of segments show how each part grows with them, and
set-ups grow like the matrices of their functions. A set-up that is kept on disk is not run but estimated. Memory is
that by which runs are refused, see ``gearbench.budget``. Of several loads the greatest is tried: the others share its
set-ups, and mostly its contact lines and compliance (``sweeps.loads``).
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np

from gearbench.accuracy.choose import SEARCH_TIME, first_settings
from gearbench.contact.assemble import (
    COARSE_PHASES,
    COARSE_SEGMENTS,
    conforming,
    flank_separation,
    mesh_phases,
    scene_lines,
)
from gearbench.contact.size import contact_memory, kept_memory, pairs_of_teeth
from gearbench.contact.transitions import loaded_phases
from gearbench.effects.base import ComplianceEffect, Dense, Effect, GapEffect, LowRank
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.clock import peak_megabytes
from gearbench.effort.forecast import Forecast, forecasts
from gearbench.effort.robust_plan import SAMPLES, robust_part
from gearbench.effort.trials import Reduced, Trial, Trials, first_trial, reduced, spent, timed_once, trials
from gearbench.loads import WeightedLoad, greatest_load
from gearbench.results.outputs import DEFAULT_OUTPUTS
from gearbench.scene import Resolution, Scene
from gearbench.solution import dataset
from gearbench.sweeps.loads import phases_follow, positions_together, under_loads
from gearbench.sweeps.run import sweep

#: Power of the number of segments that the time of each phase may grow with, at most.
STEEPEST = 2.5
#: Set-ups that take longer than this are not run again for their memory [s].
TRACED = 0.3
_number = count(1)


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
        Predicted time [s] of ``robust``, set-ups included; 0 without random errors.
    others
        Of the other commands that the scene is fit for.
    """

    parts: tuple[Part, ...]
    seconds: float
    megabytes: float
    robust_seconds: float = 0.0
    others: tuple[Forecast, ...] = ()


@dataclass(frozen=True, kw_only=True)
class _Cost:
    """What a part costs once for a new pair, and for all phases [s]."""

    once: float = 0.0
    cycle: float = 0.0


def plan(scene: Scene, samples: int = SAMPLES, threads: int | None = None) -> Plan:
    """Plan of ``simulate`` for ``scene``, and of ``robust`` with so many samples where it has random errors.

    ``threads`` of ``robust``: all processors by default. Of several loads both are over all of them.

    Where the scene asks for an accuracy, of the settings that the search for them begins with, and of the search.
    """
    loads, groups, together = scene.one_mesh.loads, 1, 0
    if loads:
        # loads with phases of their own are solved together, but each of them has them to be found and solved
        own = phases_follow(scene)
        groups = len(loads) if own else len(under_loads(scene, [each.load.torque for each in scene.each_load]))
        scene = scene.under(scene.load)
        together = positions_together(scene) if own else 0
    asked = scene.resolution.accuracy is not None
    scene = first_settings(scene) if asked else scene
    prepared = sum(effect.preparation(scene.pair, scene.effects_by_name) or 0.0 for effect in scene.effects)
    small = reduced(_without_preparation(scene))
    measured = _Measured.of(scene, small, loads, groups)
    parts = [measured.lines(scene), *measured.panels(), *measured.effects(scene), *measured.solution()]
    if prepared:
        parts.insert(1, Part("finite elements", "computed once and kept on disk", "", prepared))
    if asked:
        parts.append(_choice(parts, prepared))
    whole = replace(measured.trials.short.scene, resolution=scene.resolution)
    total, robust = measured.trials.total, []
    at_once = max(total, min(total * len(loads), together))
    kept = kept_memory(scene, total) * len(loads)
    batch = robust_part(measured.trials, small, len(mesh_phases(whole)[0]), samples, threads)
    if batch is not None:
        name, size, seconds = batch
        seconds *= max(len(loads), 1)
        robust = [Part(name, "batch of samples in lanes", size, seconds + prepared + measured.set_ups)]
    seconds = sum(part.seconds for part in parts)
    return Plan(
        parts=(*parts, *robust),
        seconds=seconds,
        megabytes=max((contact_memory(scene, at_once, whole) + kept) / 1e6, measured.megabytes),
        robust_seconds=sum(part.seconds for part in robust),
        others=() if loads else forecasts(scene, small, measured.trials, seconds, measured.set_ups),
    )


def _choice(parts: list[Part], prepared: float) -> Part:
    """The search for settings: coarser companions take about as long as the run itself, and rounds have an end."""
    seconds = min(sum(part.seconds for part in parts) - prepared, SEARCH_TIME)
    return Part("choice", "coarser runs that show the error; finer ones if it is too large", "", seconds)


def _without_preparation(scene: Scene) -> Scene:
    """The scene with a quick tooth in place of one, with its body, that would first compute for minutes."""
    if not any(effect.preparation(scene.pair, scene.effects_by_name) for effect in scene.effects):
        return scene
    rest = tuple(effect for effect in scene.effects if effect.name not in (ToothBending.name, "gear_body"))
    return replace(scene, effects=(ToothBending(order=(5, 5)), *rest))


@dataclass(frozen=True, kw_only=True)
class _Measured:
    """Costs of the parts of a scene under so many ``loads``, from trials of the ``small`` one under the greatest.

    Loads of one of the ``groups`` share contact lines and compliance.
    """

    loads: int
    groups: int
    small: Reduced
    trials: Trials
    costs: dict[str, _Cost]
    sizes: dict[str, str]
    megabytes: float

    @property
    def set_ups(self) -> float:
        """Time that the effects take once for a pair [s]."""
        return sum(self.costs[effect.name].once for effect in self.trials.short.scene.effects)

    @classmethod
    def of(cls, scene: Scene, small: Reduced, loads: Sequence[WeightedLoad], groups: int) -> _Measured:
        """Costs found by trials."""
        short, first = timed_once(lambda: first_trial(small.scene, next(_number)))
        once = {e.name: _once(e, short) * small.set_up for e in short.scene.effects}
        short.solved()  # compiled code is loaded, tables are made
        total, once["panels"] = _phases(scene, short)
        few = _parts(short)
        both = trials(short, sum(few.values()), total)
        many = _parts(both.long)
        cycle = {name: small.pairs * both.at_all(few[name], many[name]) for name in few}
        if small.segments > 1:
            coarse = _with_segments(short, max(1, small.scene.resolution.segments // 2))
            coarser, numbers = _parts(coarse), [s.resolution.segments for s in (coarse.scene, short.scene, scene)]
            cycle = {n: t * growth(coarser[n], few[n], *numbers) for n, t in cycle.items()}
        once["panels"] *= small.pairs * groups
        if loads:
            cycle["dataset"] = _joined(short.scene, loads) / len(loads)
        if flank_separation(scene) is not None:  # set up with the lines
            once["contact lines"] = max(first - few["contact lines"], 0.0)
        names = dict.fromkeys((*once, *cycle))
        return cls(
            loads=max(len(loads), 1),
            groups=groups,
            small=small,
            trials=both,
            costs={name: _Cost(once=once.get(name, 0.0), cycle=cycle.get(name, 0.0)) for name in names},
            sizes={effect.name: _size(effect, short) for effect in short.scene.effects},
            megabytes=_set_up_megabytes(small, sum(once.values())),
        )

    def lines(self, scene: Scene) -> Part:
        """The contact lines."""
        how = "uniform" if scene.resolution.positions is not None else "Gauss panels"
        pairs, segments = pairs_of_teeth(scene), scene.resolution.segments
        size = f"{self.trials.total} positions ({how}) × {pairs} pairs × {segments} segments"
        return self._part("contact lines", "positions and lengths of all segments", size)

    def panels(self) -> list[Part]:
        """The coarse solution that shows where the contact changes, where there is one."""
        if not self.costs["panels"].once:
            return []
        size = f"{COARSE_PHASES} positions × {COARSE_SEGMENTS} segments"
        return [self._part("panels", "phases at which the contact changes under load", size)]

    def effects(self, scene: Scene) -> list[Part]:
        """Contributions of the effects of the scene, or of what stands for those that are not there yet."""
        own = {effect.name: effect for effect in self.trials.short.scene.effects}
        named = [own[effect.name] for effect in scene.effects if effect.name in own]
        return [self._part(effect.name, effect.summary, self.sizes[effect.name]) for effect in named]

    def solution(self) -> list[Part]:
        """The contact solution and its Dataset."""
        lines = self.trials.long.lines
        segments = lines.shape[2] * self.small.segments * math.sqrt(self.small.pairs)
        loaded = f"{int(np.mean(lines.active.sum(axis=1)) * self.trials.total * segments)} loaded segments"
        loaded += f" × {self.loads} loads" if self.loads > 1 else ""
        contact = self._part("contact", "structured Newton, amplitudes and approach", loaded, self.loads)
        return [contact, self._part("dataset", "variables and provenance", "", self.loads)]

    def _part(self, name: str, does: str, size: str, times: int | None = None) -> Part:
        """A part that runs so many ``times``, by default once for each group of loads."""
        cost = self.costs[name]
        return Part(name, does, size, cost.once + (times or self.groups) * cost.cycle)


def _phases(scene: Scene, trial: Trial) -> tuple[int, float]:
    """Number of mesh phases of ``simulate``, and the time to find them [s]."""
    if scene.resolution.positions is not None:
        return scene.resolution.positions, 0.0
    found, seconds = timed_once(lambda: loaded_phases(replace(trial.scene, resolution=scene.resolution)))
    return len(found[0]), 0.0 if conforming(trial.scene) else seconds


def _with_segments(trial: Trial, segments: int) -> Trial:
    scene = replace(trial.scene, resolution=replace(trial.scene.resolution, segments=segments))
    return Trial(scene, scene_lines(scene, trial.lines.mesh_phase))


def growth(few: float, many: float, n: int, m: int, most: int) -> float:
    """How many times as long a part takes with ``most`` segments as with m; it takes ``few`` with n, ``many`` with m.

    Like a power of the number; where that is below 1, a constant and an amount for each segment.
    """
    if not few or not many:
        return 1.0
    power = math.log(many / few) / math.log(m / n)
    if power < 1:
        return 1 + max(1 - few / many, 0.0) / (m - n) * (most - m)
    return (most / m) ** min(power, STEEPEST)


def _once(effect: Effect, trial: Trial) -> float:
    """Time [s] that the effect takes for a pair it has not seen, beyond the time it takes each time."""
    if effect.preparation(trial.scene.pair, trial.scene.effects_by_name) is not None:
        return 0.0  # kept on disk
    first = timed_once(lambda: _contribution(effect, trial))[1]
    return max(first - spent(lambda: _contribution(effect, trial))[1], 0.0)


def _parts(trial: Trial) -> dict[str, float]:
    """Time [s] of each part of a trial, set-ups left out."""
    found = {e.name: spent(lambda e=e: _contribution(e, trial))[1] for e in trial.scene.effects}
    solved, seconds = spent(trial.solved)
    found["contact"] = max(seconds - sum(found.values()), 0.0)
    found["contact lines"] = spent(lambda: scene_lines(trial.scene, trial.lines.mesh_phase))[1]
    found["dataset"] = spent(lambda: dataset(solved, DEFAULT_OUTPUTS, time.perf_counter()))[1]
    return found


def _joined(scene: Scene, loads: Sequence[WeightedLoad]) -> float:
    """Time [s] of the Datasets of several loads and of joining them: of a sweep over them at a single phase."""
    tiny = Resolution(positions=1, segments=1)
    several = replace(scene, load=greatest_load(loads), loads=tuple(loads), resolution=tiny)
    sweep(several, threads=1)  # code is loaded, tables are made
    return spent(lambda: sweep(several, threads=1))[1]


def _contribution(effect: Effect, trial: Trial) -> Any:
    """Gap or compliance that the effect adds on the lines of the trial."""
    if isinstance(effect, GapEffect):
        return effect.gap(trial.lines)
    return effect.compliance(trial.lines, trial.scene.effects_by_name) if isinstance(effect, ComplianceEffect) else None


def _set_up_megabytes(small: Reduced, seconds: float) -> float:
    """Peak memory [MB] of the set-ups, like their matrices; 0 where they would take long."""
    if seconds > TRACED * small.set_up:
        return 0.0
    trial = first_trial(small.scene, next(_number))
    found = peak_megabytes(lambda: [_contribution(effect, trial) for effect in trial.scene.effects])
    return found * small.set_up


def _size(effect: Effect, trial: Trial) -> str:
    """Unknowns that the effect adds."""
    if not isinstance(effect, ComplianceEffect):
        return ""
    part = _contribution(effect, trial)
    if isinstance(part, LowRank):
        return f"{part.factor.shape[-1]} amplitudes a pair"
    return "all segments with each other" if isinstance(part, Dense) else "one law a segment"
