"""Refinement of a front: a local search over the continuous variables improves every design in all objectives at once.

A search keeps stepped variables on their steps, and finds the optimum of real ones only approximately. From each design
of the front, the refinement minimises Σ_j f_j/s_j, with s_j the front's extent in objective j. The limits hold, and no
objective may get worse. The result therefore dominates the design it started from. All evaluations use the same error
samples, so the objectives are smooth in the amounts and lengths of micro-geometry. COBYQA (Ragonneau & Zhang
2022-2024, in SciPy) models them by quadratics in a trust region, without derivatives.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.optimisation.dataset import designs_dataset
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.front import hypervolume, non_dominated
from gearbench.optimisation.problem import Evaluation, evaluate
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.variables import Variable
from gearbench.optimisation.workers import side_by_side, worker_processes
from gearbench.results.provenance import run_provenance
from gearbench.results.responses import described
from gearbench.threads import default_threads

#: Default of the largest number of evaluations per design.
EVALUATIONS = 60
#: First and last radius of the trust region, as shares of the variables' ranges.
RADIUS, LEAST_RADIUS = 0.05, 1e-4
#: An objective may get worse by no more than this share of its extent (rounding).
ROUNDING = 1e-12
#: Value of each objective, divided by its extent, that an infeasible design gets.
INFEASIBLE = 1e3


def continuous(study: OptimisationStudy) -> OptimisationStudy:
    """Return the study with real variables in place of stepped decimal ones, and without ``racing``.

    Raises
    ------
    InputError
        If the resulting study has no real variable.
    """
    variables = tuple(_released(variable) for variable in study.variables)
    if all(variable.kind != "real" for variable in variables):
        raise InputError("variables", "all whole or listed", "nothing to refine: needs a variable with decimal values")
    return replace(study, variables=variables, robustness=replace(study.robustness, racing=False))


def _released(variable: Variable) -> Variable:
    """Return the variable as a real one between the ends of its grid, if its grid holds decimals."""
    grid = variable.grid
    if variable.min is None or grid is None or not all(isinstance(value, float) for value in grid) or len(grid) < 2:
        return variable
    return replace(variable, min=float(grid[0]), max=float(grid[-1]), step=None)


def polish(
    designs: Designs,
    *,
    evaluations: int = EVALUATIONS,
    threads: int | None = None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> xr.Dataset:
    """Refine the front of a stored optimisation.

    Parameters
    ----------
    designs
        From ``gearbench.optimisation.select.open_designs``.
    evaluations
        Maximum number of evaluations per design.
    threads
        Number of worker processes; by default the number of processors. It does not change the result.
    progress
        Called with the number of designs done and the number of all designs.

    Returns
    -------
    Dataset like that of an optimisation of ``continuous(study)``. Its designs are the refined designs of the front,
    with ``on_front`` (Pareto-optimal among them), ``objective_before``, and ``number`` (in the stored optimisation).
    Attributes ``hypervolume_before`` and ``hypervolume_after`` are shares of the box from 0 to the reference point of
    the front (``Archive.reference_point``).

    Raises
    ------
    InputError
        If no variable is continuous, or no design is feasible.
    """
    start = time.perf_counter()
    study = continuous(designs.study)
    numbers = designs.require_feasible("on_front")
    starts = [_as_continuous(designs, study, int(number)) for number in numbers]
    F = designs.dataset["objective"].values[numbers]
    extent = np.where(np.ptp(F, axis=0) > 0, np.ptp(F, axis=0), np.abs(F).max(axis=0))
    work = partial(refine_design, study, extent=extent, evaluations=evaluations)
    answers: dict[Design, tuple[Design, Evaluation, Evaluation]] = {}
    with worker_processes(threads or default_threads()) as workers:
        for design, answer in side_by_side(workers, study, work, [[design] for design in starts]):
            answers[design] = answer
            progress(len(answers), len(starts))
    dataset = _dataset(
        study, numbers, [answers[design] for design in starts], designs.dataset["reference_point"].values
    )
    return dataset.assign_attrs(wall_time_s=time.perf_counter() - start)


def _as_continuous(designs: Designs, study: OptimisationStudy, number: int) -> Design:
    """Convert a design of the stored study to codes of the continuous study."""
    codes = designs.design(number)
    return tuple(
        float(old.value(code)) if new.kind == "real" else code  # pyright: ignore[reportArgumentType]
        for old, new, code in zip(designs.study.variables, study.variables, codes, strict=True)
    )


def refine_design(
    study: OptimisationStudy, design: Design, *, extent: NDArray, evaluations: int
) -> tuple[Design, Evaluation, Evaluation]:
    """Refine a design; return the best design, its evaluation, and the evaluation of ``design``.

    ``extent`` is the front's extent, (objective,). If nothing is better, the best design is ``design`` itself.
    """
    from scipy.optimize import NonlinearConstraint, minimize

    run = _Refinement(study=study, design=design, extent=extent, seen={})
    before = run.evaluated(run.start)
    if not before.feasible:
        return design, before, before
    f_0 = np.array(before.objectives(study)) / extent

    def excess(x: NDArray) -> NDArray:  # (objective + 1,), to be kept at most 0
        return np.append(run.objectives(x) - f_0, run.evaluated(x).violation)

    zero = np.zeros(len(extent) + 1)
    minimize(
        lambda x: float(run.objectives(x).sum()),
        run.start,
        method="COBYQA",
        bounds=[(0.0, 1.0)] * len(run.start),
        constraints=NonlinearConstraint(excess, -np.inf, zero),
        options={"maxfev": evaluations, "initial_tr_radius": RADIUS, "final_tr_radius": LEAST_RADIUS},
    )
    feasible = {key: result for key, result in run.seen.items() if result.feasible}
    scaled = {key: np.array(result.objectives(study)) / extent for key, result in feasible.items()}
    # in no objective worse than the design itself
    totals = {key: float(f.sum()) for key, f in scaled.items() if np.all(f <= f_0 + ROUNDING)}
    best = min(totals, key=totals.__getitem__, default=run.start.tobytes())
    return run.codes(np.frombuffer(best)), run.seen[best], before


@dataclass(frozen=True, kw_only=True)
class _Refinement:
    """Refinement of one design; x are its real variables as shares of their ranges, (real variable,).

    ``extent`` is the front's extent, (objective,); ``seen`` keeps the evaluations by the bytes of x.
    """

    study: OptimisationStudy
    design: Design
    extent: NDArray
    seen: dict[bytes, Evaluation]

    @property
    def _real(self) -> list[tuple[int, float, float]]:
        """Index, lower end and range of every real variable."""
        ends = [(i, *v.bounds) for i, v in enumerate(self.study.variables) if v.kind == "real"]
        return [(i, float(low), float(high - low)) for i, low, high in ends]

    @property
    def start(self) -> NDArray:
        """Start point x: the design to refine."""
        return np.array([(self.design[i] - low) / span for i, low, span in self._real])

    def codes(self, x: NDArray) -> Design:
        """Convert x to the codes of a design."""
        codes = list(self.design)
        for (i, low, span), share in zip(self._real, x, strict=True):
            codes[i] = low + span * float(np.clip(share, 0.0, 1.0))
        return tuple(codes)

    def evaluated(self, x: NDArray) -> Evaluation:
        """Evaluation at x, kept in ``seen``."""
        key = np.asarray(x, dtype=float).tobytes()
        if key not in self.seen:
            # the start design keeps its codes to the bit
            design = self.design if np.array_equal(x, self.start) else self.codes(x)
            self.seen[key] = replace(evaluate(self.study, design), values=None)
        return self.seen[key]

    def objectives(self, x: NDArray) -> NDArray:
        """Objectives divided by their extents, (objective,)."""
        result = self.evaluated(x)
        if not result.feasible:
            return np.full(len(self.extent), INFEASIBLE)
        return np.array(result.objectives(self.study)) / self.extent


def _dataset(
    study: OptimisationStudy,
    numbers: NDArray,
    answers: Sequence[tuple[Design, Evaluation, Evaluation]],
    reference: NDArray,
) -> xr.Dataset:
    """Dataset of the refined designs; ``reference`` is the reference point of the front."""
    refined = [design for design, _, _ in answers]
    dataset = designs_dataset(study, refined, [after for _, after, _ in answers], first=[1] * len(answers))
    before = np.array([evaluation.objectives(study) for _, _, evaluation in answers])
    after = dataset["objective"].values
    further = {
        "objective_before": (("design", "objective_name"), before),
        "number": ("design", numbers),
        "on_front": ("design", non_dominated(after).astype("int8")),
        "reference_point": ("objective_name", reference),
    }
    attrs = {"hypervolume_before": hypervolume(before / reference), "hypervolume_after": hypervolume(after / reference)}
    return dataset.assign(described(further)).assign_attrs(attrs | run_provenance(wall_time=0.0))
