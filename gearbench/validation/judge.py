"""Choice of a reference accurate enough to judge the fast model.

Every judged difference must be at least five times its error bar, or too small to matter. The error bar of a number is
its change if the finest level of the finite elements replaces the value extrapolated from the last two levels.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gearbench.budget import MemoryBudgetError
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.size import require_contact_memory
from gearbench.contact.transitions import mesh_phases
from gearbench.results.cycle import Phases
from gearbench.scene import Scene
from gearbench.solution import dataset, solve_lines
from gearbench.validation.mac import compare_shapes, line_mac
from gearbench.validation.reference import finest_level, finite_elements, reference_scene, solved_reference
from gearbench.validation.ste_error import CURVES, OUTPUTS, cycle_errors, error_bars

if TYPE_CHECKING:
    import xarray as xr

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
    size, positions = unknowns(reference), len(mesh_phases(scene)[0])
    for each in (scene, reference):
        require_contact_memory(each, positions)
    return size


def unknowns(reference: Scene) -> int:
    """Number of unknowns still to solve for a reference, over all levels of both gears; 0 if they are cached."""
    levels = finite_elements(reference).missing_levels(reference.pair, reference.effects_by_name)
    return sum(level.unknowns for level in levels)


def _judgement(scene: Scene, fast: xr.Dataset, reference: Scene) -> Judgement:
    exact, bare = solved_reference(reference), finest_level(reference)
    cycle, again = (cycle_beside(fast, each, reference) for each in (exact, bare))
    found = cycle_errors(fast, cycle) | shapes(scene, exact)
    bars = error_bars(found, cycle_errors(fast, again) | shapes(scene, bare))
    return Judgement(reference=reference, cycle=cycle, found=found | bars, settled=settled(found | bars))


def cycle_beside(fast: xr.Dataset, solved: Scene, reference: Scene) -> xr.Dataset:
    """Simulate the scene ``solved`` at the mesh phases of the Dataset ``fast``.

    At other phases, which would follow from its changes of contact, peak-to-peak values of quiet pairs would seem to
    differ by a percent or two. The Dataset stores the scene ``reference``, which can be written to a file.
    """
    start, phases = time.perf_counter(), Phases.of_dataset(fast)
    found = solve_lines(solved, scene_lines(solved, phases.phase), phases.weight, phases.size)
    return dataset(replace(found, scene=reference), OUTPUTS, start)


def settled(found: dict[str, tuple]) -> bool:
    """Whether ``TIMES`` the error bar is at most the difference, or ``NEGLIGIBLE``, for all judged differences."""
    errors, bars = (np.array([float(found[name + end][1]) for name in JUDGED]) for end in ("", "_bar"))
    return bool(np.all(TIMES * bars <= np.maximum(np.abs(errors), NEGLIGIBLE)))


def shapes(scene: Scene, reference: Scene) -> dict[str, tuple]:
    """Variables of a comparison on the deflection shapes of both gears."""
    found = [compare_shapes(scene, reference, index) for index in (0, 1)]
    over = ("gear", "load_height", "load_face")
    criterion = np.array([each.mac for each in found])
    lines = np.array([line_mac(scene, reference, index) for index in (0, 1)])
    return {
        "mac": (over, criterion),
        "mac_worst": (("gear",), criterion.min(axis=(1, 2))),
        "mac_mean": (("gear",), criterion.mean(axis=(1, 2))),
        "line_mac_worst": (("gear",), lines[:, 0]),
        "line_mac_mean": (("gear",), lines[:, 1]),
        "norm_ratio": (over, np.array([each.norm_ratio for each in found])),
        "compliance_ratio": (("gear",), np.array([each.compliance_ratio for each in found])),
    }
