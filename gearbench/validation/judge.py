"""A reference accurate enough to judge by: each difference is five times its error bar, or too small to matter.

The error bar of a number is its change where the finest level of the finite elements alone takes the place of the
value extrapolated from the last two levels.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gearbench.budget import MemoryBudgetError
from gearbench.contact.look import scene_lines
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

#: Errors that are judged, and how much better the reference is to be than each of them.
JUDGED = tuple(f"{curve}_{part}_error" for curve in CURVES for part in ("mean", "peak_to_peak"))
TIMES = 5.0
#: Differences below this need not be told from none [%].
NEGLIGIBLE = 1.0
#: Accuracies of the compliance that are tried in turn, and the unknowns that a better one may have.
ACCURACIES = (0.01, 0.001, 0.00025)
MOST_UNKNOWNS = 400_000


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """A scene against a reference.

    Parameters
    ----------
    reference, cycle
        The reference and its mesh cycle.
    found
        Variables of the comparison, with their error bars.
    settled
        Whether the reference is ``TIMES`` better than each difference judged.
    reason
        Why no better reference was taken where it is not; empty where it is, or where the accuracy was given.
    """

    reference: Scene
    cycle: xr.Dataset
    found: dict[str, tuple]
    settled: bool
    reason: str = ""


def judge(scene: Scene, fast: xr.Dataset, accuracy: float | None = None) -> Judgement:
    """Compare the cycle ``fast`` of a scene with a reference of the ``accuracy`` given, or with one that can judge it.

    Raises
    ------
    AccuracyError, MemoryBudgetError
        If no reference can be had at the first accuracy; says what fits.
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
    """Unknowns of the finite elements that a scene is compared with first.

    Raises
    ------
    AccuracyError, MemoryBudgetError
        If they, or the contact on them, need more memory than there may be; says what fits.
    """
    reference = reference_scene(scene, accuracy or ACCURACIES[0])
    size, positions = unknowns(reference), len(mesh_phases(scene)[0])
    for each in (scene, reference):
        require_contact_memory(each, positions)
    return size


def unknowns(reference: Scene) -> int:
    """Unknowns of the finite elements of a reference, all levels of both gears; 0 where they are kept."""
    levels = finite_elements(reference).missing_levels(reference.pair, reference.effects_by_name)
    return sum(level.unknowns for level in levels)


def _judgement(scene: Scene, fast: xr.Dataset, reference: Scene) -> Judgement:
    exact, bare = solved_reference(reference), finest_level(reference)
    cycle, again = (cycle_beside(fast, each, reference) for each in (exact, bare))
    found = cycle_errors(fast, cycle) | shapes(scene, exact)
    bars = error_bars(found, cycle_errors(fast, again) | shapes(scene, bare))
    return Judgement(reference=reference, cycle=cycle, found=found | bars, settled=settled(found | bars))


def cycle_beside(fast: xr.Dataset, solved: Scene, reference: Scene) -> xr.Dataset:
    """Result of ``simulate`` for the scene ``solved``, at the phases of the Dataset ``fast``.

    Phases of its own follow from its own changes of contact; beside them peak-to-peak values of quiet pairs would seem
    to differ by a percent or two. The Dataset bears the name of ``reference``, which can be written to a file.
    """
    start, phases = time.perf_counter(), Phases.of_dataset(fast)
    found = solve_lines(solved, scene_lines(solved, phases.phase), phases.weight, phases.size)
    return dataset(replace(found, scene=reference), OUTPUTS, start)


def settled(found: dict[str, tuple]) -> bool:
    """Whether the bar of each difference judged is a fifth of it, or of ``NEGLIGIBLE``, at most."""
    errors, bars = (np.array([float(found[name + end][1]) for name in JUDGED]) for end in ("", "_bar"))
    return bool(np.all(TIMES * bars <= np.maximum(np.abs(errors), NEGLIGIBLE)))


def shapes(scene: Scene, reference: Scene) -> dict[str, tuple]:
    """Variables that compare the deflection shapes of both gears."""
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
