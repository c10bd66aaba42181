"""Parser of conditions, rankings and ranges given as text to ``select``; the text is never evaluated as code."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError

_COMPARE: Mapping[str, Callable[[Any, Any], Any]] = MappingProxyType(
    {
        "<=": lambda x, limit: (x <= limit) | _same(x, limit),
        ">=": lambda x, limit: (x >= limit) | _same(x, limit),
        "<": lambda x, limit: (x < limit) & ~_same(x, limit),
        ">": lambda x, limit: (x > limit) & ~_same(x, limit),
        "==": lambda x, limit: _same(x, limit),
        "!=": lambda x, limit: ~_same(x, limit) & ~np.isnan(x),
    }
)
_NAME = r"[A-Za-z_]\w*(?:\.\w+)*"
_CONDITION = re.compile(rf"\s*({_NAME})\s*(<=|>=|==|!=|<|>)\s*(\S(?:.*\S)?)\s*")
_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_TERM = re.compile(rf"\s*([+-]?)\s*(?:({_NUMBER})\s*\*?\s*)?({_NAME})\s*")
_RANGE = re.compile(rf"\s*({_NUMBER})\s*:\s*({_NUMBER})\s*")


def _same(x: NDArray, limit: float) -> NDArray:
    """Whether each value equals ``limit`` to nine digits, so that the rounding of decimals does not matter."""
    return np.isclose(x, limit, rtol=1e-9, atol=1e-12)


@dataclass(frozen=True, kw_only=True)
class Condition:
    """A comparison that a design must pass; an unknown value (NaN) fails it.

    Parameters
    ----------
    name
        Name of the quantity.
    comparison
        One of <= >= < > == !=; numbers that agree to nine digits are equal.
    limit
        A number; a text if the values of the variable are texts.
    """

    name: str
    comparison: str
    limit: float | str

    def __str__(self) -> str:
        limit = self.limit if isinstance(self.limit, str) else f"{self.limit:g}"
        return f"{self.name} {self.comparison} {limit}"

    def holds(self, values: NDArray) -> NDArray:
        """Check every value, elementwise.

        Raises
        ------
        InputError
            If numbers are compared with a text, or texts with one of <= >= < >.
        """
        if values.dtype.kind not in "iufb":
            if self.comparison not in ("==", "!="):
                raise InputError("where", str(self), f"{self.name} is a text: compare it with == or !=")
            equal = values.astype(str) == str(self.limit)
            return equal if self.comparison == "==" else ~equal
        if isinstance(self.limit, str):
            raise InputError("where", str(self), f"{self.name} must be compared with a number")
        return np.asarray(_COMPARE[self.comparison](values.astype(float), self.limit), dtype=bool)


def parse_condition(text: str) -> Condition:
    """Read a condition from a text such as ``helix_angle<=15``.

    Raises
    ------
    InputError
        If the text is not a condition.
    """
    match = _CONDITION.fullmatch(text)
    if match is None:
        raise InputError("where", text, "must be NAME <= NUMBER (or < > >= == !=), or NAME == TEXT")
    name, comparison, limit_text = match.groups()
    try:
        limit: float | str = float(limit_text)
    except ValueError:
        limit = limit_text.strip("\"'")
    if isinstance(limit, float) and not math.isfinite(limit):
        raise InputError("where", text, "must compare with a finite number")
    return Condition(name=name, comparison=comparison, limit=limit)


def parse_ranking(text: str) -> dict[str, float]:
    """Read weights by name from a text such as ``mesh_stiffness_rms_mean + 2*transmission_error_rms_max``.

    Raises
    ------
    InputError
        If the text is not a weighted sum.
    """
    weights: dict[str, float] = {}
    position = 0
    while position < len(text):
        match = _TERM.match(text, position)
        if match is None or (position > 0 and not match[1]):  # every term but the first needs a sign
            break
        sign, factor, name = match.groups()
        weight = (-1.0 if sign == "-" else 1.0) * float(factor or 1.0)
        if name in weights:
            raise InputError("rank", name, "given twice")
        if weight == 0 or not math.isfinite(weight):
            raise InputError("rank", text, f"the weight of {name} must be finite and not 0")
        weights[name] = weight
        position = match.end()
    if position < len(text) or not weights:
        raise InputError("rank", text, "must be NAME + 2*NAME + …, with a minus sign where more is better")
    return weights


def parse_range(key: str, text: str) -> tuple[float, float]:
    """Read the lower and upper end of a range from a text such as ``900:1100``; ``key`` names the option in messages.

    Raises
    ------
    InputError
        If the text is not a range LOW:HIGH of numbers that are not negative.
    """
    match = _RANGE.fullmatch(text)
    low, high = (float(x) for x in match.groups()) if match else (math.nan, math.nan)
    if not low <= high or not math.isfinite(high):
        raise InputError(key, text, "must be LOW:HIGH with 0 <= LOW <= HIGH, e.g. 900:1100")
    return low, high
