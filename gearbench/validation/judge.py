"""Choice of a reference accurate enough to judge the fast model.

Every judged difference must be at least five times its error bar, or too small to matter. The error bar of a number is
its change if the finest level of the finite elements replaces the value extrapolated from the last two levels.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from gearbench.budget import MemoryBudgetError
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.size import require_contact_memory
from gearbench.contact.transitions import mesh_phases
from gearbench.lazy import xr
from gearbench.results.cycle import Phases
from gearbench.scene import Scene
from gearbench.solution import dataset, solve_lines
from gearbench.trains.solve import unnamed
from gearbench.validation.mac import compare_shapes, line_mac
from gearbench.validation.reference import finest_level, missing_levels, reference_scene, solved_reference
from gearbench.validation.sets import distinct, members, meshes_of, set_cycle
from gearbench.validation.ste_error import CURVES, OUTPUTS, cycle_errors, error_bars

#: Errors that are judged; factor by which the reference must be more accurate than they are.
JUDGED = tuple(f"{curve}_{part}_error" for curve in CURVES for part in ("mean", "peak_to_peak"))
TIMES = 5.0
#: Differences below this need not be distinguished from zero [%].
NEGLIGIBLE = 1.0
#: Accuracies of the compliance, tried in turn; maximum number of unknowns for all but the first.
ACCURACIES = (0.01, 0.001, 0.00025)
MOST_UNKNOWNS = 400_000


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """Comparison of a scene with its reference.

    Parameters
    ----------
    reference, cycle
        The reference, and its mesh cycle.
    found
        Variables of the comparison, with their error bars.
    settled
        Whether all judged differences, or ``NEGLIGIBLE``, are at least ``TIMES`` their error bars.
    reason
        Why no better reference was used although it is not settled; else empty, also if the accuracy was given.
    """

    reference: Scene
    cycle: xr.Dataset
    found: dict[str, tuple]
    settled: bool
    reason: str = ""


def judge(scene: Scene, fast: xr.Dataset, accuracy: float | None = None) -> Judgement:
    """Compare the mesh cycle ``fast`` of a scene with a reference of given ``accuracy``, or with one that settles it.

    Raises
    ------
    AccuracyError, MemoryBudgetError
        If no reference can be computed at the first accuracy; says what is possible.
    """
    from fem_reference.refinement import AccuracyError

    judged: Judgement | None = None
    for tried in ACCURACIES if accuracy is None else (accuracy,):
        reference = reference_scene(scene, tried)
        try:
            if judged is not None and (size := unknowns(reference)) > MOST_UNKNOWNS:
                raise AccuracyError(f"accuracy = {tried:g} would take finite elements of {size} unknowns")
            judged = _judgement(scene, fast, reference)
        except (AccuracyError, MemoryBudgetError) as error:
            if judged is None:
                raise
            return Judgement(**{**vars(judged), "reason": str(error)})
        if judged.settled:
            break
    assert judged is not None
    if judged.settled or accuracy is not None:
        return judged
    return Judgement(**{**vars(judged), "reason": f"accuracy = {ACCURACIES[-1]:g} is the finest that is tried"})


def require_reference(scene: Scene, accuracy: float | None) -> int:
    """Number of unknowns of the first reference of a scene; checks that it fits into memory.

    Raises
    ------
    AccuracyError, MemoryBudgetError
        If its finite elements or its contact problem need more memory than the budget allows; says what is possible.
    """
    reference = reference_scene(scene, accuracy or ACCURACIES[0])
    size = unknowns(reference)
    for each in (scene, reference):
        for own in meshes_of(each).values():
            require_contact_memory(own, len(mesh_phases(own)[0]))
    return size


def unknowns(reference: Scene) -> int:
    """Number of unknowns still to solve for a reference, over all levels of all gears; 0 if they are cached."""
    return sum(level.unknowns for each in distinct(meshes_of(reference)).values() for level in missing_levels(each))


def _judgement(scene: Scene, fast: xr.Dataset, reference: Scene) -> Judgement:
    meshes = meshes_of(scene)
    exact, bare = (_with_teeth(meshes_of(reference), kind) for kind in (solved_reference, finest_level))
    if scene.coupled:
        cycle, again = (set_cycle(scene, each, Phases.of_dataset(fast)) for each in (exact, bare))
    else:
        cycle, again = (cycle_beside(fast, own, reference) for each in (exact, bare) for own in each.values())
    errors = cycle_errors(fast, cycle) | shapes(meshes, exact)
    bars = error_bars(errors, cycle_errors(fast, again) | shapes(meshes, bare))
    return Judgement(reference=reference, cycle=cycle, found=errors | bars, settled=settled(errors | bars))


def _with_teeth(meshes: Mapping[str, Scene], kind: Callable[[Scene], Scene]) -> dict[str, Scene]:
    """Meshes of a reference with the teeth that ``kind`` puts inside, the same ones in equal meshes."""
    known: dict[Scene, Scene] = {}
    for plain in map(unnamed, meshes.values()):
        if plain not in known:
            known[plain] = kind(plain)
    return {name: known[unnamed(scene)] for name, scene in meshes.items()}


def cycle_beside(fast: xr.Dataset, solved: Scene, reference: Scene) -> xr.Dataset:
    """Simulate the scene ``solved`` at the mesh phases of the Dataset ``fast``.

    At other phases, which would follow from its changes of contact, peak-to-peak values of quiet pairs would seem to
    differ by a percent or two. The Dataset stores the scene ``reference``, which can be written to a file.
    """
    start, phases = time.perf_counter(), Phases.of_dataset(fast)
    solved_beside = solve_lines(solved, scene_lines(solved, phases.phase), phases.weight, phases.size)
    return dataset(replace(solved_beside, scene=reference), OUTPUTS, start)


def settled(variables: dict[str, tuple]) -> bool:
    """Whether ``TIMES`` the error bar is at most the difference, or ``NEGLIGIBLE``, for all judged differences."""
    errors, bars = (np.array([float(variables[name + end][1]) for name in JUDGED]) for end in ("", "_bar"))
    return bool(np.all(TIMES * bars <= np.maximum(np.abs(errors), NEGLIGIBLE)))


def shapes(meshes: Mapping[str, Scene], reference: Mapping[str, Scene]) -> dict[str, tuple]:
    """Variables of a comparison on the deflection shapes of the gears, from the meshes of both models."""
    both = [(meshes[mesh], reference[mesh], index) for _, mesh, index in members(meshes)]
    comparisons = [compare_shapes(*each) for each in both]
    over = ("gear", "load_height", "load_face")
    criterion = np.array([each.mac for each in comparisons])
    lines = np.array([line_mac(*each) for each in both])
    return {
        "mac": (over, criterion),
        "mac_worst": (("gear",), criterion.min(axis=(1, 2))),
        "mac_mean": (("gear",), criterion.mean(axis=(1, 2))),
        "line_mac_worst": (("gear",), lines[:, 0]),
        "line_mac_mean": (("gear",), lines[:, 1]),
        "norm_ratio": (over, np.array([each.norm_ratio for each in comparisons])),
        "compliance_ratio": (("gear",), np.array([each.compliance_ratio for each in comparisons])),
    }
