"""Datasets of an optimisation: one for each generation, and the final one of all designs and their front."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.optimise.archive import Archive
from gearbench.optimise.problem import Evaluation
from gearbench.optimise.study import Design, OptimisationStudy
from gearbench.results.responses import described

if TYPE_CHECKING:
    import xarray as xr

_OURS = {
    "code": "what the search works with: place in the grid of a variable's values, or its value where it is real",
    "objective": "objectives, to be made small",
    "violation": "sum of the relative violations of the limits",
    "feasible": "whether the design keeps all limits",
    "reason": "why the design is not feasible",
    "first_generation": "generation in which the design was first asked for",
    "on_front": "whether no feasible design dominates this one",
    "in_population": "whether the design survived the last generation",
    "asked": "designs the search asked for",
    "asked_design": "the designs that the search asked for; -1 where there were fewer than the population",
    "evaluated": "designs that were computed, and not known before",
    "feasible_found": "feasible designs known so far",
    "hypervolume": "share of the box below the reference point that the front known so far dominates",
    "reference_point": "reference point of the hypervolume",
}
#: Names that a variable must not have.
RESERVED = frozenset({*_OURS, "design", "generation", "variable", "constraint", "objective_name", "member"})


def designs_dataset(
    study: OptimisationStudy, designs: Sequence[Design], results: Sequence[Evaluation], first: Sequence[int]
) -> xr.Dataset:
    """Designs with all that is known of them, dimension ``design``; ``first`` is the generation of each."""
    import xarray as xr

    codes = np.array(designs, dtype=float).reshape(len(designs), len(study.variables))
    variables: dict[str, tuple] = {"code": (("design", "variable"), codes, _attrs("code"))}
    for i, variable in enumerate(study.variables):
        attrs = {"long_name": variable.name, "paths": ", ".join(variable.paths)}
        values = np.array([variable.value(design[i]) for design in designs])
        variables[variable.name] = ("design", values.astype("int8") if values.dtype == bool else values, attrs)
    objectives = np.array([result.objectives(study) for result in results]).reshape(len(results), -1)
    variables["objective"] = (("design", "objective_name"), objectives, _attrs("objective"))
    known = {name: ("design", [r.statistics[i] for r in results]) for i, name in enumerate(study.statistics)}
    known |= {name: ("design", [r.constraints[i] for r in results]) for i, name in enumerate(study.constraints)}
    variables |= described(known)
    for name, limit in study.constraints.items():
        given = {"limit_min": limit.min, "limit_max": limit.max}
        variables[name][2].update({key: value for key, value in given.items() if value is not None})
    variables["violation"] = ("design", np.array([r.violation for r in results]), _attrs("violation"))
    variables["feasible"] = ("design", np.array([r.feasible for r in results], dtype="int8"), _attrs("feasible"))
    variables["reason"] = ("design", np.array([r.reason for r in results], dtype=object), _attrs("reason"))
    variables["first_generation"] = ("design", np.array(first, dtype="int64"), _attrs("first_generation"))
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


def read_names(study: OptimisationStudy) -> tuple[str, ...]:
    """Names of the variables of ``designs_dataset`` that the others follow from."""
    return ("code", "violation", "reason", *study.constraints, *study.statistics)


def read_designs(arrays: Mapping[str, NDArray], study: OptimisationStudy) -> list[tuple[Design, Evaluation]]:
    """Designs and results from the variables ``read_names``, exactly as they were."""
    kinds = [float if variable.kind == "real" else int for variable in study.variables]
    count = len(arrays["code"])
    constraints = np.array([arrays[name] for name in study.constraints]).reshape(-1, count).T
    statistics = np.array([arrays[name] for name in study.statistics]).T
    rows = zip(arrays["code"], arrays["violation"], arrays["reason"], constraints, statistics, strict=True)
    return [
        (
            tuple(kind(code) for kind, code in zip(kinds, codes, strict=True)),
            Evaluation(
                violation=float(violation),
                reason=str(reason),
                constraints=tuple(map(float, limited)),
                statistics=tuple(map(float, known)),
            ),
        )
        for codes, violation, reason, limited, known in rows
    ]


def front_dataset(archive: Archive, population: Sequence[Design], wall_time: float) -> xr.Dataset:
    """All designs of a finished search and its history, dimensions ``design`` and ``generation``."""
    from gearbench.results.provenance import run_provenance

    study = archive.study
    dataset = designs_dataset(study, archive.designs, archive.results, archive.first)
    everything = np.arange(len(archive.designs))
    survived = np.isin(everything, archive.places(population))
    dataset["on_front"] = ("design", np.isin(everything, archive.front).astype("int8"), _attrs("on_front"))
    dataset["in_population"] = ("design", survived.astype("int8"), _attrs("in_population"))
    members = np.full((len(archive.asked), study.algorithm.population), -1, dtype="int64")
    for row, asked in zip(members, archive.asked, strict=True):
        row[: len(asked)] = asked
    dataset["asked_design"] = (("generation", "member"), members, _attrs("asked_design"))
    history = {
        "asked": [len(asked) for asked in archive.asked],
        "evaluated": archive.evaluated,
        "feasible_found": archive.feasible_found,
        "hypervolume": archive.hypervolumes,
    }
    for name, values in history.items():
        dataset[name] = ("generation", np.array(values), _attrs(name))
    dataset["reference_point"] = ("objective_name", archive.reference_point, _attrs("reference_point"))
    dataset = dataset.assign_coords(generation=np.arange(1, len(archive.asked) + 1))
    sha256 = checksum({str(name): dataset[name].values for name in dataset.variables})
    return dataset.assign_attrs(data_sha256=sha256, **run_provenance(wall_time=wall_time))


def checksum(arrays: Mapping[str, NDArray]) -> str:
    """SHA-256 over names and values: equal for equal results, wherever and whenever computed."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = arrays[name]
        text = values.dtype.kind in "OUS"
        digest.update(f"{name} {values.shape} ".encode())
        digest.update("\0".join(map(str, values.ravel())).encode() if text else np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _attrs(name: str) -> dict[str, str]:
    return {"units": "1", "long_name": _OURS[name]}
