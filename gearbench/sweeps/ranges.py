"""Parsing of value ranges: 20:300:20, or 50,100,200."""

from __future__ import annotations

import math

import numpy as np

from gearbench.errors import InputError

_FORM = "must be FIRST:LAST:STEP, or numbers separated by commas, e.g. 20:300:20 or 50,100,200"
#: Largest number of values of a range.
_MOST = 100_000


def parse_range(key: str, text: str) -> list[float]:
    """Values of a range; LAST is included if the steps reach it.

    A torque range skips 0, where neither flank carries load.

    Raises
    ------
    InputError
        If ``text`` is not a range; the error names ``key``.
    """
    try:
        parts = [float(part) for part in text.split(":" if ":" in text else ",")]
    except ValueError:
        raise InputError(key, text, _FORM) from None
    if not all(map(math.isfinite, parts)) or (":" in text and len(parts) != 3):
        raise InputError(key, text, _FORM)
    if ":" not in text:
        return parts
    first, last, step = parts
    if step <= 0 or last < first:
        raise InputError(key, text, "must rise from FIRST to LAST by a positive STEP")
    # tolerance: 20:300:20 ends at 300 despite rounding
    steps = (last - first) / step
    if steps >= _MOST:
        raise InputError(key, text, f"must be at most {_MOST} values")
    values = first + step * np.arange(math.floor(steps + 1e-9) + 1)
    if key in ("torque", "load.torque") and len(values) > 1:
        values = values[abs(values) > 1e-9 * step]
    return values.tolist()


def parse_setting(text: str) -> tuple[str, list[float]]:
    """Parse KEY=RANGE into the key and its values.

    Raises
    ------
    InputError
        If ``text`` does not have this form.
    """
    key, equals, values = text.partition("=")
    if not equals or not key.strip():
        raise InputError("set", text, "must be KEY=RANGE, e.g. effects.crowning.amount=0:8:2")
    return key.strip(), parse_range(key.strip(), values)
