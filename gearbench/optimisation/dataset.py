"""Datasets of an optimisation: one for each generation, and the final one of all designs and their front."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.archive import Archive
from gearbench.optimisation.problem import Evaluation, values_of
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.results.responses import described

if TYPE_CHECKING:
    import xarray as xr

#: Dimensions, whose names a variable must not have.
DIMENSIONS = frozenset({"design", "generation", "variable", "constraint", "objective_name", "member"})

#: Rows of an array that are read at a time.
ROWS = 10_000


def designs_dataset(
    study: OptimisationStudy, designs: Sequence[Design], results: Sequence[Evaluation], first: Sequence[int]
) -> xr.Dataset:
    """Designs with all that is known of them, dimension ``design``; ``first`` is the generation of each."""
    import xarray as xr

    codes = np.array(designs, dtype=float).reshape(len(designs), len(study.variables))
    objectives = np.array([result.objectives(study) for result in results]).reshape(len(results), -1)
    known: dict[str, tuple] = {
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
    variables = described(known)
    shown = [values_of(study, design) for design in designs]
    for i, variable in enumerate(study.variables):
        attrs = {"long_name": variable.name, "paths": ", ".join(variable.paths)}
        # of all its values, so that parts of a search are alike
        kind = np.array(variable.grid or [0.0]).dtype
        values = np.array([row[i] for row in shown], dtype=kind)
        variables[variable.name] = ("design", values.astype("int8") if values.dtype == bool else values, attrs)
    for name, limit in study.constraints.items():
        given = {"limit_min": limit.min, "limit_max": limit.max}
        variables[name][2].update({key: value for key, value in given.items() if value is not None})
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
    return ("code", "violation", "reason", "evaluated_samples", *study.constraints, *study.statistics)


def read_designs(arrays: Mapping[str, NDArray], study: OptimisationStudy) -> list[tuple[Design, Evaluation]]:
    """Designs and results from the variables ``read_names``, exactly as they were."""
    kinds = [float if variable.kind == "real" else int for variable in study.variables]
    count = len(arrays["code"])
    constraints = np.array([arrays[name] for name in study.constraints]).reshape(-1, count).T
    statistics = np.array([arrays[name] for name in study.statistics]).T
    columns = [arrays[name] for name in ("code", "violation", "reason", "evaluated_samples")]
    rows = zip(*columns, constraints, statistics, strict=True)
    return [
        (
            tuple(kind(code) for kind, code in zip(kinds, codes, strict=True)),
            Evaluation(
                violation=float(violation),
                reason=str(reason),
                constraints=tuple(map(float, limited)),
                # a number that is limited, too, is known of designs that are not feasible
                statistics=tuple(float(x) if violation == 0 else math.nan for x in known),
                samples=int(samples),
            ),
        )
        for codes, violation, reason, samples, limited, known in rows
    ]


def front_dataset(archive: Archive, population: Sequence[Design], wall_time: float) -> xr.Dataset:
    """All designs of a finished search and its history, dimensions ``design`` and ``generation``."""
    from gearbench.results.provenance import run_provenance

    dataset, history = _all_designs(archive), history_dataset(archive, population)
    dataset = dataset.assign(history.data_vars).assign_coords(history.coords)
    sha256 = checksum({str(name): dataset[name].values for name in dataset.variables})
    return dataset.assign_attrs(data_sha256=sha256, **run_provenance(wall_time=wall_time))


def _all_designs(archive: Archive) -> xr.Dataset:
    """``designs_dataset`` of all designs, made of batches: as objects a million of them would fill the memory."""
    import xarray as xr

    parts = list(batches(archive))
    if len(parts) > 1:
        return xr.concat(parts, "design", data_vars="minimal", coords="minimal", compat="override", join="override")
    return parts[0]


def batches(archive: Archive) -> Iterator[xr.Dataset]:
    """``designs_dataset`` of some designs after the other."""
    return (designs_dataset(archive.study, *map(list, zip(*batch, strict=True))) for batch in archive.batches())


def history_dataset(archive: Archive, population: Sequence[Design]) -> xr.Dataset:
    """How a finished search went, and which of its designs were left at its end."""
    import xarray as xr

    everything = np.arange(len(archive))
    members = np.full((len(archive.asked), archive.study.algorithm.population), -1, dtype="int64")
    for row, asked in zip(members, archive.asked_numbers(), strict=True):
        row[: len(asked)] = asked
    found = {
        "on_front": ("design", np.isin(everything, archive.front).astype("int8")),
        "in_population": ("design", np.isin(everything, archive.numbers(population)).astype("int8")),
        "asked_design": (("generation", "member"), members),
        "asked": ("generation", archive.asked),
        "evaluated": ("generation", archive.evaluated),
        "feasible_found": ("generation", archive.feasible_found),
        "hypervolume": ("generation", archive.hypervolumes),
        "reference_point": ("objective_name", archive.reference_point),
    }
    return xr.Dataset(described(found), coords={"generation": np.arange(1, len(archive.asked) + 1)})


def checksum(arrays: Mapping[str, Any]) -> str:
    """SHA-256 over names and values: equal for equal results, wherever and whenever computed.

    Of each array some rows at a time are read: it may be one in a file.
    """
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = arrays[name]
        digest.update(f"{name} {tuple(values.shape)} ".encode())
        rows = range(0, len(values), ROWS) if values.ndim else [None]
        for first in rows:
            part = np.asarray(values[()] if first is None else values[first : first + ROWS])
            if part.dtype.kind not in "OUS":
                digest.update(np.ascontiguousarray(part).tobytes())
                continue
            digest.update(b"\0" * bool(first) + "\0".join(map(str, part.ravel())).encode())
    return digest.hexdigest()
