"""Verification of a front: evaluate its designs again with finite elements instead of the fast tooth compliance."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.gear_body import GearBody
from gearbench.effects.tooth_bending import ToothBending
from gearbench.errors import GearbenchError, InputError
from gearbench.lazy import xr
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.problem import Evaluation, macro_geometry
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.workers import evaluations, worker_processes
from gearbench.results.provenance import run_provenance
from gearbench.results.responses import described
from gearbench.threads import default_threads


def verify(
    designs: Designs,
    *,
    numbers: Sequence[int] | None = None,
    accuracy: float = 0.01,
    threads: int | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> xr.Dataset:
    """Evaluate designs of a stored optimisation with finite elements instead of the fast tooth compliance.

    Gaps, errors and their samples, contact law and resolution stay those of the study. The teeth are clamped at the
    root; if the study has gear bodies, the FE model includes the body down to the bore. Designs that differ in effects
    alone have the same macro-geometry and share one FE model, which is cached on disk.

    Parameters
    ----------
    designs
        From ``gearbench.optimisation.select.open_designs``.
    numbers
        Numbers of the designs in the dimension ``design``; the front by default.
    accuracy
        Relative error of the compliance to which the FE meshes are refined.
    threads
        Number of worker processes; by default the number of processors.
    progress
        Called with one line of text before each step.

    Returns
    -------
    Dataset over ``design``: ``number`` of the design, the variables, the stored statistics and their values with finite
    elements (``<statistic>_verified``), ``objective`` and ``objective_verified`` (design, objective_name), the
    relative ``shift`` of the objectives [%], ``on_front_verified``, and ``verified`` (0 if the finite elements failed;
    ``reason`` says why). Also ``rank_correlation``, (objective_name,), between stored and verified objectives.

    Raises
    ------
    InputError
        If the study has no tooth bending, a variable changes an effect that the finite elements replace, the designs
        are planetary sets, or a design is not feasible.
    MemoryBudgetError
        If the finite elements need more memory than the budget allows; raised before any are solved.
    GearbenchError
        If the finite elements fail for all designs.
    """
    start = time.perf_counter()
    study = reference_study(designs.study, accuracy)
    chosen = _numbers(designs, numbers)
    chosen_designs = [designs.design(int(number)) for number in chosen]
    model_count = _prepare(designs, chosen, study, chosen_designs, progress)
    progress(f"evaluating {len(chosen)} designs with the compliance of the finite elements")
    with worker_processes(threads or default_threads()) as workers:
        evaluated = dict(evaluations(workers, study, list(dict.fromkeys(chosen_designs))))
    results = [evaluated[design] for design in chosen_designs]
    if not any(result.feasible for result in results):
        raise GearbenchError(f"finite elements failed for all designs, for the first because: {results[0].reason}")
    result = _dataset(designs, chosen, results)
    return result.assign_attrs(_attrs(designs.study, study, model_count, time.perf_counter() - start))


def reference_study(study: OptimisationStudy, accuracy: float) -> OptimisationStudy:
    """Return ``study`` with finite elements instead of the fast tooth compliance.

    It has no limits, so that a design that exceeds one with finite elements still gets values.

    Raises
    ------
    InputError
        If the study has no tooth bending, a variable changes an effect that the finite elements replace, or the designs
        are planetary sets.
    """
    if study.of_set:
        raise InputError("base.planetary", "given", "designs of planetary sets cannot be verified, only those of pairs")
    effects: dict[str, Any] = deepcopy(dict(study.base.get("effects", {})))
    for variable in study.variables:
        for path in variable.paths:
            if path.split(".")[:2] in [["effects", kind.name] for kind in (ToothBending, GearBody)]:
                raise InputError(f"variables.{variable.name}", path, "must not vary: finite elements replace it")
    if ToothBending.name not in effects:
        raise InputError(f"base.effects.{ToothBending.name}", "missing", "is required: finite elements replace it")
    effects[ToothBending.name] = {"model": "finite_elements", "accuracy": accuracy}
    if GearBody.name in effects:
        effects[GearBody.name] = {}  # its own model is dropped: the FE mesh reaches to the bore
    return replace(study, base={**study.base, "effects": effects}, constraints={})


def rank_correlation(a: NDArray, b: NDArray) -> float:
    """Spearman's rank correlation of the finite points; NaN for fewer than three, or if all values are equal."""
    from scipy.stats import rankdata

    known = np.isfinite(a) & np.isfinite(b)
    if known.sum() < 3 or np.ptp(a[known]) == 0 or np.ptp(b[known]) == 0:
        return float("nan")
    return float(np.corrcoef(rankdata(a[known]), rankdata(b[known]))[0, 1])


def _numbers(designs: Designs, numbers: Sequence[int] | None) -> NDArray:
    """Numbers of the designs to verify: those given, or the front in order of the first objective."""
    dataset = designs.dataset
    if numbers is None:
        chosen = designs.require_feasible("on_front")
        return chosen[np.argsort(dataset["objective"].values[chosen, 0], kind="stable")]
    chosen = np.array(numbers, dtype=int)
    for number in chosen:
        designs.require_design("design", int(number), feasible=True)
    return chosen


def _prepare(
    designs: Designs,
    chosen: NDArray,
    study: OptimisationStudy,
    chosen_designs: Sequence[Design],
    progress: Callable[[str], None],
) -> int:
    """Compute the compliance of every macro-geometry one after the other; return their number.

    Without this, several workers that meet the same new pair would all mesh it.
    """
    # one design of each macro-geometry
    number_of = {macro_geometry(study, d): int(number) for d, number in zip(chosen_designs, chosen, strict=True)}
    effects = study.base["effects"]
    bodies = {GearBody.name: GearBody()} if GearBody.name in effects else {}
    reference = ToothBending(**effects[ToothBending.name])
    pairs = [designs.scene(number).pair for number in number_of.values()]
    # A GearbenchError is suppressed because the evaluation of the design raises it again and reports it as the reason.
    # A MemoryBudgetError is an InputError and no GearbenchError, so it ends the verification before any pair is solved.
    for pair in pairs:
        with suppress(GearbenchError):
            reference.missing_levels(pair, bodies)  # called only for its check of the memory
    for i, pair in enumerate(pairs, start=1):
        progress(f"finite elements of macro-geometry {i} of {len(number_of)}")
        with suppress(GearbenchError):
            for index in (0, 1):
                reference.flank(pair, index, bodies)
    return len(number_of)


def _dataset(designs: Designs, chosen: NDArray, results: Sequence[Evaluation]) -> xr.Dataset:
    """Dataset of the verified designs: stored values, values with finite elements, and their differences."""
    study, dataset = designs.study, designs.dataset
    names = [str(name) for name in dataset["variable"].values]
    stored = dataset[[*names, *study.statistics, "objective"]].isel(design=chosen)
    objective, verified = stored["objective"].values, np.array([r.objectives(study) for r in results])
    known = np.all(np.isfinite(verified), axis=1)
    on_front = np.zeros(len(chosen), dtype="int8")
    on_front[known] = non_dominated(verified[known])
    both = ("design", "objective_name")
    variables: dict[str, tuple] = {
        "number": ("design", chosen),
        "objective_verified": (both, verified),
        "shift": (both, 100 * (verified / objective - 1)),
        "on_front_verified": ("design", on_front),
        "verified": ("design", known.astype("int8")),
        "reason": ("design", np.array([r.reason for r in results], dtype=object)),
        "rank_correlation": (
            "objective_name",
            np.array([rank_correlation(a, b) for a, b in zip(objective.T, verified.T, strict=True)]),
        ),
    }
    for i, name in enumerate(study.statistics):
        variables[f"{name}_verified"] = ("design", [r.statistics[i] for r in results])
    return stored.assign(described(variables)).drop_attrs(deep=False)


def _attrs(
    study: OptimisationStudy, reference: OptimisationStudy, model_count: int, wall_time: float
) -> dict[str, Any]:
    """Attributes of the Dataset; ``model_count`` is the number of macro-geometries."""
    attrs = {"study": study.to_toml(), "study_sha256": study.digest, "macro_geometries": model_count}
    attrs["variables"] = ", ".join(variable.name for variable in study.variables)
    effects = reference.base["effects"]
    attrs["support"] = "finite_elements" if GearBody.name in effects else "clamped"
    return attrs | effects[ToothBending.name] | run_provenance(wall_time=wall_time)
