"""Parts of kernels (``gearbench.compiled.part``) as functions that Python can call."""

from collections.abc import Callable
from functools import cache
from typing import Any


@cache
def callable_part(part: Any) -> Callable[..., Any]:
    from numba import njit

    return njit(lambda *arguments: part(*arguments), error_model="numpy")
