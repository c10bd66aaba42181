"""Plan of a run: parts, sizes and memory of a scene (nothing is solved), and time of a study (one design is)."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from gearbench.accuracy.choose import first_settings
from gearbench.budget import speed_memory
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.size import contact_memory, kept_memory, pairs_of_teeth
from gearbench.contact.transitions import mesh_phases
from gearbench.dynamics.analysis import HARMONICS
from gearbench.dynamics.size import bearings
from gearbench.effects.base import ComplianceEffect, Dense, Effect, LowRank
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.clock import timed
from gearbench.errors import GearbenchError, InputError
from gearbench.geometry.action import ContactLines
from gearbench.hunting.cycles import ORDERS, check_cycles, cycle_gap_amounts, hunting_memory, tooth_to_tooth_effects
from gearbench.optimisation.problem import evaluate, scene_of
from gearbench.optimisation.search import Search
from gearbench.optimisation.study import OptimisationStudy
from gearbench.robustness.montecarlo import SAMPLES
from gearbench.scene import Scene, check_scene
from gearbench.threads import default_threads
from gearbench.trains.cycles import check_train_cycles, train_cycles_memory
from gearbench.trains.solve import check_train, mesh_scenes, train_phases
from gearbench.validation.reference import reference_memory, reference_scene

#: Speeds at which the memory of ``response`` is given.
SPEEDS = 200
#: Maximum number of designs evaluated to estimate the time of a study.
TRIED = 6


@dataclass(frozen=True)
class PlanPart:
    """One part of a run: name, purpose, size."""

    name: str
    does: str
    size: str = ""


#: Part of a scene that asks for an accuracy.
CHOICE = PlanPart("choice", "coarser runs that show the error; finer ones if it is too large")


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Parts of the run of a scene, their sizes and memory.

    Parameters
    ----------
    parts
        Parts in the order they run; the last one is ``robust`` if the scene has random errors.
    megabytes
        Command → peak memory [MB] at its default options, for commands that accept the scene; within a factor of two,
        and an upper bound for sets, whose equal meshes in phase are solved once.
    """

    parts: tuple[PlanPart, ...]
    megabytes: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class StudyPlan:
    """Upper bound of the cost of a search; invalid and repeated designs, which cost nothing, are counted as evaluated.

    Parameters
    ----------
    designs, samples, threads
        Number of designs that the search asks for, of error samples per design, and of designs evaluated in parallel.
    design_seconds, seconds
        Measured time of one evaluation, and time of the search if every evaluation takes that long [s].
    megabytes
        Peak memory of all threads [MB].
    """

    designs: int
    samples: int
    threads: int
    design_seconds: float
    seconds: float
    megabytes: float


def plan(scene: Scene) -> Plan:
    """Plan the commands for ``scene``.

    If the scene asks for an accuracy, the plan uses the settings with which the search for the resolution starts. Mesh
    phases are those of the unloaded pair, to which changes of contact under load may add some; those of a set are the
    phases that ``simulate`` uses.
    """
    check_scene(scene)
    if scene.coupled:
        return _train_plan(scene)
    loads = max(len(scene.one_mesh.loads), 1)
    asked = scene.resolution.accuracy is not None
    scene = scene.under(scene.load) if loads > 1 else scene
    scene = first_settings(scene) if asked else scene
    positions = len(mesh_phases(scene)[0])
    parts = _contact_parts(scene, positions, loads)
    if asked:
        parts.append(CHOICE)
    if scene.effect("manufacturing_errors") is not None:
        parts.append(PlanPart("robust", "samples of the errors, side by side", f"{SAMPLES} samples"))
    kept = kept_memory(scene, positions) * (loads - 1)
    megabytes = {"simulate": contact_memory(scene, positions) + kept}
    megabytes |= _others(scene, positions)
    return Plan(parts=tuple(parts), megabytes={name: size / 1e6 for name, size in megabytes.items()})


def _train_plan(scene: Scene) -> Plan:
    """Plan a train whose meshes form one contact problem: parts of every kind of mesh, then the balance of all.

    Every mesh is solved at the transitions of all meshes, which are searched for.
    """
    linkage = check_train(scene)
    asked = scene.resolution.accuracy is not None
    scenes = {name: first_settings(each) if asked else each for name, each in mesh_scenes(scene).items()}
    positions = len(train_phases(scenes, scene.geometry, coast=scene.load.coast).phase)
    parts: list[PlanPart] = []
    for mesh_scene in reversed({each.pair: each for each in reversed(scenes.values())}.values()):
        alike = sum(each.pair == mesh_scene.pair for each in scenes.values())
        z = [gear.teeth for gear in mesh_scene.pair.gears]
        parts.append(PlanPart(" to ".join(mesh_scene.gear_names), "a mesh", f"z {z[0]}/{z[1]}, {alike} of the kind"))
        parts += _contact_parts(mesh_scene, positions)
    size = f"{len(scenes)} meshes, {len(linkage.motions)} free motions"
    parts.append(PlanPart("balance", "forces and motions of all meshes, Newton's method", size))
    if asked:
        parts.append(CHOICE)
    short = scene.planetary
    drawn = {
        "pins, planets and run-outs": short is not None and short.keys.scatter is not None,
        "flanks": scene.effect("manufacturing_errors") is not None,
    }
    if any(drawn.values()):
        of = " and of ".join(name for name, given in drawn.items() if given)
        parts.append(PlanPart("robust", f"samples of {of}", f"{SAMPLES} samples"))
    memory = {"simulate": sum(contact_memory(each, positions) for each in scenes.values())}
    with suppress(InputError):  # all cycles are alike, or there are too many: the command itself reports that
        memory["hunting"] = train_cycles_memory(len(scenes), positions, check_train_cycles(scene), ORDERS)
    return Plan(parts=tuple(parts), megabytes={name: size / 1e6 for name, size in memory.items()})


def _contact_parts(scene: Scene, positions: int, loads: int = 1) -> list[PlanPart]:
    """Parts of the contact of a mesh at a number of positions, under a number of loads."""
    pairs, segments = pairs_of_teeth(scene), scene.resolution.segments
    lines = scene_lines(scene, np.array([0.5]))
    how = "uniform" if scene.resolution.positions is not None else "Gauss panels"
    loaded = f"{positions * int(lines.active.sum()) * segments} segments" + (f" × {loads} loads" if loads > 1 else "")
    size = f"{positions} positions ({how}) × {pairs} pairs × {segments} segments"
    return [
        PlanPart("contact lines", "where teeth touch", size),
        *(PlanPart(effect.name, effect.summary, _size(effect, scene, lines)) for effect in scene.effects),
        PlanPart("contact", "Newton's method, amplitudes and approach", loaded),
    ]


def _size(effect: Effect, scene: Scene, lines: ContactLines) -> str:
    """Text on the unknowns that an effect adds; "" if none."""
    if not isinstance(effect, ComplianceEffect):
        return ""
    if isinstance(effect, ToothBending) and (missing := effect.missing_levels(scene.pair, scene.effects_by_name)):
        return f"finite elements of {sum(level.unknowns for level in missing)} unknowns, kept on disk"
    part = effect.compliance(lines, scene.effects_by_name)
    if isinstance(part, LowRank):
        return f"{part.factor.shape[-1]} amplitudes a pair"
    return "all segments with each other" if isinstance(part, Dense) else "one law a segment"


def _others(scene: Scene, positions: int) -> dict[str, float]:
    """Memory of the other commands that accept the scene [bytes]."""
    memory: dict[str, float] = {}
    tooth_effects = () if scene.has_shafts else tooth_to_tooth_effects(scene)
    if tooth_effects:
        modes = cycle_gap_amounts(tooth_effects, scene_lines(scene, np.zeros(1)), 1).shape[-1]
        with suppress(InputError):  # too many cycles: the command itself reports that
            memory["hunting"] = hunting_memory(scene, positions, check_cycles(scene.pair.gears), ORDERS, modes)
    if scene.system is not None:
        per_speed = speed_memory(HARMONICS, len(scene.pairs), bearings(scene))
        memory[f"response at {SPEEDS} speeds"] = SPEEDS * per_speed + contact_memory(scene, positions)
    with suppress(InputError, GearbenchError):  # no reference, or none that fits into memory
        memory["validate"] = reference_memory(reference_scene(scene, 0.01), positions)
    return memory


def study_plan(study: OptimisationStudy, threads: int | None = None) -> StudyPlan:
    """Plan ``optimise`` for ``study``: evaluate a few designs of the first generation and take the longest time.

    Raises
    ------
    GearbenchError
        If none of the designs of the first generation is a valid gear set.
    """
    threads, samples = threads or default_threads(), study.robustness.samples
    gears, reason = [], ""
    for design in Search(study).ask():
        try:
            gears.append((design, scene_of(study, design)))
        except InputError as error:
            reason = str(error)
    if not gears:
        first = study.algorithm.population
        raise GearbenchError(f"no valid gear set among the first {first} designs; last error: {reason}")
    # the first evaluation also loads compiled code; designs that violate a limit take less time than others
    costs = [timed(lambda design=design: evaluate(study, design))[1].seconds for design, _ in gears[:TRIED]]
    designs = study.algorithm.population * study.algorithm.generations
    seconds = max(costs[1:] or costs)
    return StudyPlan(
        designs=designs,
        samples=samples,
        threads=threads,
        design_seconds=seconds,
        seconds=designs * seconds / threads,
        megabytes=threads * plan(gears[0][1]).megabytes["simulate"],
    )
