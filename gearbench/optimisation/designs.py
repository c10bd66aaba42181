"""Designs of a stored optimisation: their quantities by name (stored, or computed from the scene) and their scenes.

``select``, ``refinement``, ``verify`` and the explorer read a finished search through ``Designs``.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from functools import cached_property, lru_cache
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError, naming
from gearbench.lazy import xr
from gearbench.optimisation.dataset import STORED
from gearbench.optimisation.numbers import OF_PAIR, OF_SCENE, OF_SET
from gearbench.optimisation.problem import scene_of
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.study_file import parse_study
from gearbench.results.provenance import support
from gearbench.results.quantities import QUANTITIES
from gearbench.scene import Scene

#: Number of scenes kept in memory.
SCENES = 4096


class Designs:
    """The designs of a stored optimisation.

    Parameters
    ----------
    dataset
        The final Dataset of an optimisation.
    source
        Name of the file in error messages.

    Raises
    ------
    InputError
        If the Dataset is not the result of an optimisation.
    """

    def __init__(self, dataset: xr.Dataset, source: str = "dataset") -> None:
        self.source = source
        if "study" not in dataset.attrs or "design" not in dataset.dims or "on_front" not in dataset:
            raise InputError("", source, "must be the result of an optimisation (front.nc)")
        if "evaluated_samples" not in dataset and "feasible" in dataset:  # a file written before racing existed
            dataset = dataset.assign(evaluated_samples=dataset.attrs.get("samples", 0) * dataset["feasible"])
        self.dataset = dataset
        _check(dataset, self.study, source)
        self._scene = lru_cache(maxsize=SCENES)(self._scene_of)

    @cached_property
    def study(self) -> OptimisationStudy:
        """The study that was run."""
        text = str(self.dataset.attrs["study"])
        digest = sha256(text.encode(errors="surrogatepass")).hexdigest()
        if self.dataset.attrs.get("study_sha256") not in (None, digest):
            raise InputError("", self.source, "is damaged or changed: its study does not match its digest")
        try:
            return parse_study(tomllib.loads(text))
        except (ValueError, RecursionError) as error:  # an InputError is a ValueError too
            raise InputError("", self.source, f"its study cannot be read: {error}") from None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all quantities that have one value per design."""
        stored = [str(name) for name, v in self.dataset.data_vars.items() if v.dims == ("design",)]
        undefined = OF_PAIR if self.study.of_set else tuple(OF_SET)
        return tuple(dict.fromkeys((*stored, *(name for name in OF_SCENE if name not in undefined))))

    def find(self, key: str, name: str) -> str:
        """Full name of a quantity, given in full or by its last parts if they are unambiguous.

        ``key`` is the option that gave ``name``, for messages.

        Raises
        ------
        InputError
            If no quantity or several match.
        """
        if name in self.names:
            return name
        matches = [full for full in self.names if full.endswith(f".{name}")]
        if len(matches) == 1:
            return matches[0]
        if matches:
            raise InputError(key, name, f"is ambiguous: {' or '.join(matches)}")
        raise InputError(key, name, f"unknown quantity; known: {', '.join(self.names)}")

    def values(self, name: str, numbers: NDArray) -> NDArray:
        """Values of a quantity (full name) for the designs ``numbers``, (number,); their gears must be valid."""
        if name in self.dataset:
            return self.dataset[name].values[numbers]
        return np.array([OF_SCENE[name](self.scene(int(number))) for number in numbers], dtype=float)

    def scene(self, number: int) -> Scene:
        """Scene of a design by its number in the dimension ``design``; the last ``SCENES`` are cached."""
        return self._scene(number)

    def _scene_of(self, number: int) -> Scene:
        with naming(f"{self.source}, design {number}"):
            return scene_of(self.study, self.design(number))

    def require_design(self, key: str, number: int, *, feasible: bool = False) -> None:
        """Refuse a number without a design; ``key`` is the option that gave it, for messages.

        Raises
        ------
        InputError
            If there is no such design, or if ``feasible`` is asked for and it is not.
        """
        count = self.dataset.sizes["design"]
        if not 0 <= number < count:
            raise InputError(key, number, f"must be the number of a design, 0 to {count - 1}")
        if feasible and not self.dataset["feasible"].values[number]:
            raise InputError(key, number, f"is not feasible: {self.dataset['reason'].values[number]}")

    def require_feasible(self, name: str = "feasible") -> NDArray:
        """Numbers of the designs flagged by ``name``, "feasible" or "on_front".

        Raises
        ------
        InputError
            If there are none.
        """
        numbers = np.flatnonzero(self.dataset[name].values)
        if numbers.size == 0:
            raise InputError("", self.source, "has no feasible design")
        return numbers

    def design(self, number: int) -> Design:
        """Codes of a design by its number in the dimension ``design``: real values, or indices into the grids."""
        codes = self.dataset["code"].values[number]
        return tuple(
            float(code) if variable.kind == "real" else int(code)
            for variable, code in zip(self.study.variables, codes, strict=True)
        )

    def unit(self, name: str) -> str:
        """Unit of a quantity, "" if it has none."""
        unit = self.dataset[name].attrs.get("units", "") if name in self.dataset else QUANTITIES[name].units
        return "" if unit == "1" else unit

    def support(self, numbers: Iterable[int]) -> str:
        """Names of the body models that support the teeth of the designs ``numbers``, joined by "or"."""
        return " or ".join(sorted({support(self.scene(int(number))) for number in numbers}))


def _check(dataset: xr.Dataset, study: OptimisationStudy, source: str) -> None:
    """Refuse a Dataset whose variables, codes and results do not fit its study."""
    text_names = {"reason", *(v.name for v in study.variables if v.kind == "choice")}
    flags_and_variables = {"feasible", "on_front", *(v.name for v in study.variables)}
    for name in (*STORED, *study.constraints, *study.statistics, *flags_and_variables):
        dims = ("design", "variable") if name == "code" else ("design",)
        if name not in dataset or dataset[name].dims != dims:
            raise InputError("", source, f"{name} is missing, or has other dimensions than {', '.join(dims)}")
        if name not in text_names and dataset[name].dtype.kind not in "iufb":
            raise InputError("", source, f"{name} must be numbers")
    codes = dataset["code"].values
    bounds = np.array([variable.bounds for variable in study.variables], dtype=float)
    if codes.shape[1] != len(bounds) or not np.all((codes >= bounds[:, 0]) & (codes <= bounds[:, 1])):
        raise InputError("", source, "the codes of its designs do not fit its study")


def design_scene(dataset: xr.Dataset, design: int) -> Scene:
    """Scene of a design of a stored optimisation, by its number in the dimension ``design``.

    Raises
    ------
    InputError
        If the Dataset is not from an optimisation, there is no such design, or it is not a valid gear set.
    """
    designs = Designs(dataset)
    designs.require_design("design", design)
    return designs.scene(design)
