"""Datasets of an optimisation: one per generation, and a final one with all designs and the front."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.lazy import xr
from gearbench.optimisation.archive import Archive
from gearbench.optimisation.problem import Evaluation, values_of
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.results.provenance import run_provenance
from gearbench.results.responses import described

#: Dimensions of the Datasets. A design variable must not have one of these names.
DIMENSIONS = frozenset({"design", "generation", "variable", "constraint", "objective_name", "member"})
#: Variables from which ``read_designs`` restores the designs, in addition to the study's constraints and statistics.
STORED = ("code", "violation", "reason", "evaluated_samples")


def designs_dataset(
    study: OptimisationStudy, designs: Sequence[Design], results: Sequence[Evaluation], first: Sequence[int] | NDArray
) -> xr.Dataset:
    """Dataset over ``design``: variables and results; ``first`` holds the first generation of each design.

    ``code`` (design, variable) holds the values of real variables and indices into the grids of others, see
    ``Variable.bounds``.
    """
    codes = np.array(designs, dtype=float).reshape(len(designs), len(study.variables))
    objectives = np.array([result.objectives(study) for result in results]).reshape(len(results), -1)
    results_by_name: dict[str, tuple] = {
        "code": (("design", "variable"), codes),
        "objective": (("design", "objective_name"), objectives),
        **{name: ("design", [r.statistics[i] for r in results]) for i, name in enumerate(study.statistics)},
        **{name: ("design", [r.constraints[i] for r in results]) for i, name in enumerate(study.constraints)},
        "violation": ("design", [r.violation for r in results]),
        "feasible": ("design", np.array([r.feasible for r in results], dtype="int8")),
        "reason": ("design", np.array([r.reason for r in results], dtype=object)),
        "evaluated_samples": ("design", np.array([r.samples for r in results], dtype="int64")),
        "first_generation": ("design", np.array(first, dtype="int64")),
    }
    variables = described(results_by_name)
    values_by_design = [values_of(study, design) for design in designs]
    for i, variable in enumerate(study.variables):
        attrs = {"long_name": variable.name, "paths": ", ".join(variable.paths)}
        # the type that holds all values of the variable, so that every generation has the same type
        dtype = np.array(variable.grid or [0.0]).dtype
        values = np.array([row[i] for row in values_by_design], dtype=dtype)
        variables[variable.name] = ("design", values.astype("int8") if values.dtype == bool else values, attrs)
    for name, limit in study.constraints.items():
        limits = {"limit_min": limit.min, "limit_max": limit.max}
        variables[name][2].update({key: value for key, value in limits.items() if value is not None})
    coords = {
        "variable": np.array([variable.name for variable in study.variables], dtype=object),
        "objective_name": np.array([objective.label for objective in study.objectives], dtype=object),
    }
    dataset = xr.Dataset(variables, coords=coords)
    return dataset.assign_attrs(
        study=study.to_toml(),
        study_sha256=study.digest,
        algorithm_seed=study.algorithm.seed,
        robustness_seed=study.robustness.seed,
        samples=study.robustness.samples,
        sampler=study.robustness.sampler,
    )


def read_designs(dataset: xr.Dataset, study: OptimisationStudy) -> list[tuple[Design, Evaluation]]:
    """Designs and results of a Dataset with the variables ``STORED``, exactly as stored.

    Statistics of infeasible designs are NaN.

    Raises
    ------
    LookupError, ValueError
        If the Dataset does not hold them.
    """
    types = [float if variable.kind == "real" else int for variable in study.variables]
    constraints, statistics = (
        np.array([dataset[name].values for name in group]).reshape(len(group), -1).T
        for group in (study.constraints, study.statistics)
    )
    constraints = constraints.reshape(dataset.sizes["design"], len(study.constraints))
    rows = zip(*(dataset[name].values for name in STORED), constraints, statistics, strict=True)
    return [
        (
            tuple(convert(code) for convert, code in zip(types, codes, strict=True)),
            Evaluation(
                violation=float(violation),
                reason=str(reason),
                constraints=tuple(map(float, constraint_values)),
                # a quantity may be limit and statistic: an infeasible design has stored the limited value
                statistics=tuple(float(x) if violation == 0 else math.nan for x in stored),
                samples=int(samples),
            ),
        )
        for codes, violation, reason, samples, constraint_values, stored in rows
    ]


def front_dataset(archive: Archive, population: Sequence[Design], wall_time: float) -> xr.Dataset:
    """Dataset of a finished search over ``design`` (all designs) and ``generation`` (history).

    ``population`` holds the designs that survived the last generation.
    """
    numbers, generations = range(len(archive.designs)), len(archive.asked)
    dataset = designs_dataset(archive.study, archive.designs, archive.results, archive.first_generations)
    members = np.full((generations, archive.study.algorithm.population), -1, dtype="int64")
    for row, asked in zip(members, archive.asked, strict=True):
        row[: len(asked)] = asked
    history = {
        "on_front": ("design", np.isin(numbers, archive.front).astype("int8")),
        "in_population": ("design", np.isin(numbers, archive.numbers(population)).astype("int8")),
        "asked_design": (("generation", "member"), members),
        "asked": ("generation", [len(asked) for asked in archive.asked]),
        "evaluated": ("generation", archive.evaluated),
        "feasible_found": ("generation", archive.feasible_found),
        "hypervolume": ("generation", archive.hypervolumes),
        "reference_point": ("objective_name", archive.reference_point),
    }
    dataset = dataset.assign(described(history)).assign_coords(generation=np.arange(1, generations + 1))
    return dataset.assign_attrs(run_provenance(wall_time=wall_time))
