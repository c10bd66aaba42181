"""Classes of an optimisation study: fixed data, design variables, objectives, constraints and algorithm."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError, one_of
from gearbench.optimisation.numbers import NUMBERS, OF_PAIR, OF_SET
from gearbench.optimisation.variables import Value, Variable
from gearbench.results.responses import (
    STATISTICS,
    is_of_train,
    is_over_speed,
    responses,
    split_statistic,
    statistics_of,
)
from gearbench.robustness.sampling import Sampler
from gearbench.schema import STRICT, given

#: Point of the design space: one code per variable, see ``Variable.value``.
Design = tuple[float, ...]

#: Responses computed for every feasible pair, or planetary set, in addition to those of its objectives.
RESPONSES = ("mesh_stiffness_rms", "transmission_error_rms")
RESPONSES_OF_SET = ("mesh_load_factor", "train_transmission_error_rms")

#: Largest violation of one limit; the sum of all violations stays below ``problem.NO_GEAR``, the violation of an
#: invalid gear set.
MOST_VIOLATION = 1000.0

Whole = Annotated[int, Field(ge=1, le=1_000_000)]
Seed = Annotated[int, Field(ge=0)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Objective:
    """A weighted sum of statistics over the error samples and of other scalar quantities, to be minimised.

    Parameters
    ----------
    weights
        Positive weights by name. A name is a response with ``_mean``, ``_std`` or ``_max`` appended, or a quantity of
        ``gearbench.optimisation.numbers``.
    """

    weights: dict[str, Annotated[float, Field(gt=0.0)]]

    def __post_init__(self) -> None:
        if not self.weights:
            raise InputError("weights", "none", "must name at least one statistic")
        for name in self.weights:
            if split_statistic(name) is None and name not in NUMBERS:
                every = [f"{metric}_{statistic}" for metric in responses() for statistic in STATISTICS]
                raise InputError(name, "unknown statistic", one_of(name, (*every, *NUMBERS)))

    @property
    def label(self) -> str:
        """Text of the sum, e.g. "mesh_stiffness_rms_mean + 2 mesh_stiffness_rms_std"."""
        return " + ".join(name if w == 1 else f"{w:g} {name}" for name, w in self.weights.items())

    def value(self, statistics: Mapping[str, float]) -> float:
        """Weighted sum of ``statistics``, given by name."""
        return sum(w * statistics[name] for name, w in self.weights.items())


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Limit:
    """Least and greatest allowed value of a quantity; None: no limit on this side."""

    min: float | None = None
    max: float | None = None

    def __post_init__(self) -> None:
        if self.min is None and self.max is None:
            raise InputError("", "no limit", "give min or max")

    def violation(self, value: float) -> float:
        """Excess of ``value`` over its limit, relative to it: 0 within the limits, at most 1000, 1000 for NaN."""
        excess = 0.0
        if self.min is not None:
            excess = max(excess, (self.min - value) / (abs(self.min) or 1.0))
        if self.max is not None:
            excess = max(excess, (value - self.max) / (abs(self.max) or 1.0))
        return MOST_VIOLATION if math.isnan(value) else min(excess, MOST_VIOLATION)

    def worst(self, values: Sequence[float]) -> float:
        """Value that violates the limits most; if none does, the greatest, or the least if only ``min`` is set."""
        return max(values, key=lambda value: (self.violation(value), -value if self.max is None else value))

    def describe(self, name: str, value: float) -> str:
        """Text of a violation: name, value and limit."""
        if self.max is not None and not value <= self.max:  # also NaN
            return f"{name} {value:.4g} above {self.max:g}"
        return f"{name} {value:.4g} below {self.min:g}"


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Algorithm:
    """Method and size of the search.

    Parameters
    ----------
    method
        "nsga2" (Deb, Pratap, Agarwal & Meyarivan 2002), or "nsga3" (Deb & Jain 2014) for more than three objectives,
        where crowding distances lose their meaning; it spreads its population over reference directions instead.
    population
        Number of designs in a generation.
    generations
        Number of generations, including the first, random one.
    seed
        Seed of the search.
    """

    method: Literal["nsga2", "nsga3"] = "nsga2"
    population: Annotated[int, Field(ge=4, le=100_000)] = 100
    generations: Whole = 200
    seed: Seed = 0


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Robustness:
    """Error samples, the same for every design.

    Parameters
    ----------
    samples
        Number of samples; with 0, the scene is computed once without samples, as in ``simulate``.
    sampler, seed
        Sampling method, and its seed.
    racing
        Whether the evaluation of a design stops early if the front clearly beats it, see
        ``gearbench.optimisation.racing``.
    """

    samples: Annotated[int, Field(ge=0, le=1_000_000)] = 1000
    sampler: Sampler = "sobol"
    seed: Seed = 0
    racing: bool = False


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Speeds:
    """Speeds at which the mesh force is evaluated, for objectives and limits with ``mesh_force``.

    Parameters
    ----------
    lowest, highest
        Ends of the speed range of the pinion [1/min].
    count
        Number of speeds, at equal steps.
    harmonics
        Number of orders of the mesh frequency.
    """

    lowest: Annotated[float, Field(gt=0.0, le=1e6)]
    highest: Annotated[float, Field(gt=0.0, le=1e6)]
    count: Annotated[int, Field(ge=1, le=10_000)] = 40
    harmonics: Annotated[int, Field(ge=1, le=200)] = 10

    def __post_init__(self) -> None:
        if self.highest < self.lowest:
            raise InputError("highest", self.highest, f"must be at least lowest, {self.lowest:g}")

    @property
    def values(self) -> NDArray:
        """All speeds, (count,) [1/min]."""
        return np.linspace(self.lowest, self.highest, self.count)


@dataclass(frozen=True, kw_only=True, config=STRICT)
class OptimisationStudy:
    """Everything an optimisation needs; ``read_study`` reads one from a TOML file.

    Parameters
    ----------
    name
        Free text.
    base
        Tables of a scene, as in a scene file, common to all designs.
    variables
        The design variables.
    objectives
        One or more objectives, to be minimised.
    constraints
        Limits by name of the quantity, see ``gearbench.optimisation.constraints``.
    algorithm, robustness
        Settings of the search and of the error samples.
    costs
        Variable → value as text → cost of the value. The quantity ``cost`` of a design is the sum over its variables.
    over_loads
        How responses under several loads are combined, per error sample: weighted mean ("mean") or greatest value
        ("max"). Limits hold under every load.
    speeds
        Speeds at which the mesh force is evaluated, if an objective or a limit uses it.

    Raises
    ------
    InputError
        If a table is missing or empty, or the parts contradict each other, e.g. an objective needs samples but none are
        drawn. pydantic wraps it in a ``ValidationError``.
    """

    name: str = ""
    base: dict[str, Any]
    variables: tuple[Variable, ...]
    objectives: tuple[Objective, ...]
    constraints: dict[str, Limit] = field(default_factory=dict)
    algorithm: Algorithm = Algorithm()
    robustness: Robustness = Robustness()
    costs: dict[str, dict[str, float]] = field(default_factory=dict)
    over_loads: Literal["mean", "max"] = "mean"
    speeds: Speeds | None = None

    def __post_init__(self) -> None:
        if not self.variables:
            raise InputError("variables", "none", "at least one variable is required")
        if self.over_loads != "mean" and "loads" not in self.base:
            raise InputError("over_loads", self.over_loads, "needs base.loads")
        if not self.objectives:
            raise InputError("objectives", "none", "at least one objective is required")
        if self.algorithm.method == "nsga3" and not 2 <= len(self.objectives) <= self.algorithm.population:
            reason = f"needs two objectives or more, and no more than the population: there are {len(self.objectives)}"
            raise InputError("algorithm.method", "nsga3", reason)
        labels = [objective.label for objective in self.objectives]
        for label in labels:
            if labels.count(label) > 1:
                raise InputError("objectives", label, "given twice")
        if self.robustness.samples < 2:
            for name in {name for objective in self.objectives for name in objective.weights}:
                if not name.endswith("_mean") and name not in NUMBERS:
                    raise InputError("objectives", name, "needs robustness.samples of at least 2")
        self._check_kind()
        self._check_speeds()

    def _check_kind(self) -> None:
        """Refuse quantities that only pairs have if the base is a planetary set, and the other way round."""
        used = [(f"constraints.{name}", name) for name in self.constraints]
        used += [("objectives", name) for objective in self.objectives for name in objective.weights]
        for key, name in used:
            quantity, statistic = split_statistic(name) or (name, "")
            if quantity in NUMBERS:  # those in neither list belong to both kinds
                only_of_set, only_of_pair = quantity in OF_SET, quantity in OF_PAIR
            else:  # responses belong to one kind
                only_of_set, only_of_pair = is_of_train(quantity), not is_of_train(quantity)
            if only_of_pair if self.of_set else only_of_set:
                instead = (RESPONSES_OF_SET if self.of_set else RESPONSES)[1]
                example = f"{instead}_{statistic}" if statistic else instead
                kinds = ("a planetary set", "a pair") if only_of_set else ("a pair", "a planetary set")
                raise InputError(key, name, f"belongs to {kinds[0]}, but the base is {kinds[1]}: use e.g. {example}")
        if self.of_set and "loads" in self.base:
            raise InputError("base.loads", "given", "are for pairs: give a planetary set one [base.load]")

    @property
    def of_set(self) -> bool:
        """Whether the designs are planetary sets."""
        return "planetary" in self.base

    def _check_speeds(self) -> None:
        """Check that a study of the mesh force over speed gives speeds, a system and enough positions.

        Other studies must give no speeds.
        """
        used = [name for name in (*self.responses, *self.constraints) if is_over_speed(name)]
        if not used and self.speeds is not None:
            raise InputError("speeds", "given", "need an objective or a limit of mesh_force")
        if not used or self.speeds is None:
            if used:
                raise InputError("speeds", "missing", f"{used[0]} needs [speeds]: lowest and highest [1/min]")
            return
        if "system" not in self.base:
            raise InputError("base.system", "missing", f"{used[0]} needs it: shafts, or inertias of the two gears")
        positions = self.base.get("resolution", {}).get("positions")
        if positions is not None and positions <= 4 * self.speeds.harmonics:
            allowed = f"must be more than {4 * self.speeds.harmonics}, four times speeds.harmonics, or left out"
            raise InputError("base.resolution.positions", positions, allowed)

    @cached_property
    def responses(self) -> tuple[str, ...]:
        """Names of the responses computed for every design."""
        parts = [split_statistic(name) for objective in self.objectives for name in objective.weights]
        names = [part[0] for part in parts if part]
        return tuple(dict.fromkeys((*(RESPONSES_OF_SET if self.of_set else RESPONSES), *names)))

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the quantities of ``gearbench.optimisation.numbers`` that the objectives use."""
        used = (name for objective in self.objectives for name in objective.weights if name in NUMBERS)
        return tuple(dict.fromkeys(used))

    @cached_property
    def statistics(self) -> tuple[str, ...]:
        """Names of the values of a feasible design: statistics of ``responses`` over the samples, then ``numbers``."""
        return (*statistics_of(self.responses), *self.numbers)

    def values(self, design: Design) -> dict[str, Value]:
        """Values of a design's variables, by name of the variable."""
        return {v.name: v.value(code) for v, code in zip(self.variables, design, strict=True)}

    def to_mapping(self) -> dict[str, Any]:
        """Study as nested tables, as in a file."""
        return {
            "name": self.name,
            **({} if self.over_loads == "mean" else {"over_loads": self.over_loads}),
            "objectives": [dict(objective.weights) for objective in self.objectives],
            "algorithm": asdict(self.algorithm),
            "robustness": asdict(self.robustness),
            "constraints": {name: given(limit) for name, limit in self.constraints.items()},
            "variables": {variable.name: variable.given() for variable in self.variables},
            **({"costs": self.costs} if self.costs else {}),
            **({} if self.speeds is None else {"speeds": given(self.speeds)}),
            "base": self.base,
        }

    def to_toml(self) -> str:
        """Study as the text of a TOML file."""
        import tomli_w

        return tomli_w.dumps(self.to_mapping())

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the TOML text."""
        return hashlib.sha256(self.to_toml().encode()).hexdigest()
