"""Design variables of an optimisation, and the values each may take."""

from __future__ import annotations

import math
import re
from functools import cached_property
from typing import Any, Literal

from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.schema import STRICT, given

Value = bool | int | float | str

#: Most values of a grid; a variable with more should be real, without a step.
MOST_VALUES = 1_000_000
#: Largest whole number; beyond it a double does not resolve neighbours.
LARGEST = 1e15


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Variable:
    """One design variable.

    Parameters
    ----------
    name
        Name of its table in the study.
    paths
        Keys of the scene that take its value, e.g. ``("pair.pinion.teeth", "pair.wheel.teeth")``, or names of
        ``gearbench.optimisation.derived``. In a file the variable's name is the key, where ``paths`` is absent.
    min, max
        Range. Whole numbers without a step: every whole number between them. Otherwise a real variable, or, with a
        step, the values min, min + step, … up to max.
    step
        See above.
    values
        The values themselves, instead of a range.
    sets
        Instead of values and paths: by the name of each value the keys of the scene that it sets, the same ones for
        all, e.g. module and dedendum of the tools at hand.

    Raises
    ------
    InputError
        If they describe no values. Wrapped by pydantic's ``ValidationError``.
    """

    name: str
    paths: tuple[str, ...]
    min: int | float | None = None
    max: int | float | None = None
    step: int | float | None = None
    values: tuple[Value, ...] | None = None
    sets: dict[str, dict[str, Value]] | None = None

    def __post_init__(self) -> None:
        if re.fullmatch(r"\w+(\.\w+)*", self.name) is None:
            raise InputError("name", self.name, "must consist of letters, digits, underscores and dots")
        if not self.paths:
            raise InputError("paths", "none", "must name at least one key of the scene")
        if self.sets is not None:
            self._check_listed("sets", ("min", "max", "step", "values"))
        elif self.values is not None:
            self._check_listed("values", ("min", "max", "step"))
        else:
            self._check_range()

    def _check_listed(self, one: str, others: tuple[str, ...]) -> None:
        if not getattr(self, one):
            raise InputError(one, "none", "must hold at least one value")
        for key in others:
            if getattr(self, key) is not None:
                raise InputError(key, getattr(self, key), f"conflicts with {one}: give one of the two")
        for name, keys in (self.sets or {}).items():
            if keys.keys() != set(self.paths):
                raise InputError(f"sets.{name}", ", ".join(keys), f"must set {', '.join(self.paths)}, as the others")

    def _check_range(self) -> None:
        for key in ("min", "max"):
            if getattr(self, key) is None:
                raise InputError(key, "missing", "is required where values is absent")
        for key in ("min", "max", "step"):
            if abs(getattr(self, key) or 0) > LARGEST:
                raise InputError(key, getattr(self, key), f"must be within ±{LARGEST:g}")
        low, high = self._range
        if high < low:
            raise InputError("max", high, f"must not be below min = {low:g}")
        if self.step is not None and not self.step > 0:
            raise InputError("step", self.step, "must be positive; without it the variable is real")
        if self._step is not None and (high - low) / self._step >= MOST_VALUES:
            reason = f"makes more than {MOST_VALUES} values; a real variable has decimals as ends, and no step"
            raise InputError("step", self._step, reason)

    @property
    def _range(self) -> tuple[int | float, int | float]:
        assert self.min is not None
        assert self.max is not None
        return self.min, self.max

    @property
    def _step(self) -> int | float | None:
        """Distance of its values; whole numbers follow each other without one."""
        return 1 if self.step is None and all(isinstance(end, int) for end in self._range) else self.step

    @cached_property
    def grid(self) -> tuple[Value, ...] | None:
        """All its values in order; None where it is real."""
        if self.sets is not None:
            return tuple(self.sets)
        if self.values is not None:
            return self.values
        (low, high), step = self._range, self._step
        if step is None:
            return None
        positions = range(math.floor((high - low) / step + 1e-9) + 1)
        if isinstance(low, int) and isinstance(step, int):
            return tuple(low + i * step for i in positions)
        # the decimals written down, 0.3 and not 0.30000000000000004
        return tuple(float(f"{low + i * step:.12g}") for i in positions)

    @cached_property
    def kind(self) -> Literal["real", "ordered", "choice"]:
        """Kind for the search operators: "choice" where the values have no order."""
        if self.grid is None:
            return "real"
        numbers = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in self.grid)
        return "ordered" if numbers else "choice"

    @property
    def bounds(self) -> tuple[float, float] | tuple[int, int]:
        """Least and greatest code: of the value itself where it is real, else of its position in the grid."""
        if self.grid is not None:
            return 0, len(self.grid) - 1
        low, high = self._range
        return float(low), float(high)

    def value(self, code: float) -> Value:
        """Value of a code: the code itself, or the position in the grid."""
        return float(code) if self.grid is None else self.grid[int(code)]

    def assigned(self, code: float) -> dict[str, Value]:
        """Keys of the scene and their values for a code."""
        value = self.value(code)
        return dict.fromkeys(self.paths, value) if self.sets is None else self.sets[str(value)]

    def given(self) -> dict[str, Any]:
        """Table of a study file."""
        table = given(self)
        del table["name"]
        if self.sets is not None or self.paths == (self.name,):
            del table["paths"]
        return table
