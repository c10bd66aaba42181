"""Design variables of an optimisation, their values, and the codes that stand for the values in the search."""

from __future__ import annotations

import math
import re
from functools import cached_property
from typing import Any, Literal

from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.schema import STRICT
from gearbench.schema import given as fields_given

Value = bool | int | float | str

#: Largest number of values in a grid; a variable with more should be real, without a step.
MOST_VALUES = 1_000_000
#: Largest magnitude of min, max and step; a double resolves neighbouring whole numbers up to 9e15.
LARGEST = 1e15


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Variable:
    """Design variable.

    Parameters
    ----------
    name
        Name of its table in the study.
    paths
        Keys of the scene that take its value, e.g. ``("pair.pinion.teeth", "pair.wheel.teeth")``, or names of
        ``gearbench.optimisation.derived``. A file may omit ``paths``: the variable's name is then the key.
    min, max
        Ends of the range. If both are whole numbers and there is no step, the variable takes every whole number
        between them. Otherwise it is real or, with a step, takes the values min, min + step, … up to max.
    step
        Step of the values, see ``min``.
    values
        List of values, instead of a range.
    sets
        Named sets of keys and values, instead of a range or ``values``: name of the set → key of the scene → value.
        Example: module and dedendum of the available tools. Every set gives the same keys, which ``paths`` lists; a
        file omits ``paths``.

    Raises
    ------
    InputError
        If the parameters do not describe any values. pydantic wraps it in a ``ValidationError``.
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

    def _check_listed(self, field: str, others: tuple[str, ...]) -> None:
        """Check the field ``field``, "values" or "sets"; the fields ``others`` must not be given with it."""
        if not getattr(self, field):
            raise InputError(field, "none", "must hold at least one value")
        for key in others:
            if getattr(self, key) is not None:
                raise InputError(key, getattr(self, key), f"conflicts with {field}: give one of the two")
        for name, keys in (self.sets or {}).items():
            if keys.keys() != set(self.paths):
                allowed = f"must set the same keys as the other sets: {', '.join(self.paths)}"
                raise InputError(f"sets.{name}", ", ".join(keys), allowed)

    def _check_range(self) -> None:
        for key in ("min", "max"):
            if getattr(self, key) is None:
                raise InputError(key, "missing", "is required unless values or sets is given")
        for key in ("min", "max", "step"):
            if abs(getattr(self, key) or 0) > LARGEST:
                raise InputError(key, getattr(self, key), f"must be within ±{LARGEST:g}")
        low, high = self._range
        if high < low:
            raise InputError("max", high, f"must not be below min = {low:g}")
        real = "for a real variable write min or max with a decimal point, and omit step"
        if self.step is not None and not self.step > 0:
            raise InputError("step", self.step, f"must be positive; {real}")
        if self._step is not None and (high - low) / self._step >= MOST_VALUES:
            reason = f"gives more than {MOST_VALUES} values between min and max; {real}"
            key = "max" if self.step is None else "step"
            raise InputError(key, getattr(self, key), reason)

    @property
    def _range(self) -> tuple[int | float, int | float]:
        assert self.min is not None
        assert self.max is not None
        return self.min, self.max

    @property
    def _step(self) -> int | float | None:
        """Step of the values: 1 for whole ends without a step; None if the variable is real."""
        return 1 if self.step is None and all(isinstance(end, int) for end in self._range) else self.step

    @cached_property
    def grid(self) -> tuple[Value, ...] | None:
        """All values in order; None if the variable is real."""
        if self.sets is not None:
            return tuple(self.sets)
        if self.values is not None:
            return self.values
        (low, high), step = self._range, self._step
        if step is None:
            return None
        positions = range(math.floor((high - low) / step + 1e-9) + 1)  # 1e-9: rounding must not lose max
        if isinstance(low, int) and isinstance(step, int):
            return tuple(low + i * step for i in positions)
        # decimals as a person writes them: 0.3, not 0.30000000000000004
        return tuple(float(f"{low + i * step:.12g}") for i in positions)

    @cached_property
    def kind(self) -> Literal["real", "ordered", "choice"]:
        """Kind for the search operators: a real number, a number of a grid ("ordered"), or a "choice" without order."""
        if self.grid is None:
            return "real"
        numbers = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in self.grid)
        return "ordered" if numbers else "choice"

    @property
    def bounds(self) -> tuple[float, float] | tuple[int, int]:
        """Least and greatest code. A code is the value of a real variable, or an index into the grid of others."""
        if self.grid is not None:
            return 0, len(self.grid) - 1
        low, high = self._range
        return float(low), float(high)

    def value(self, code: float) -> Value:
        """Value of a code: the code itself for a real variable, otherwise the grid value at this index."""
        return float(code) if self.grid is None else self.grid[int(code)]

    def assigned(self, code: float) -> dict[str, Value]:
        """Keys of the scene that a code sets, with their values."""
        value = self.value(code)
        return dict.fromkeys(self.paths, value) if self.sets is None else self.sets[str(value)]

    def given(self) -> dict[str, Any]:
        """Table of the variable in a study file."""
        table = fields_given(self)
        del table["name"]
        if self.sets is not None or self.paths == (self.name,):
            del table["paths"]
        return table
