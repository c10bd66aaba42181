"""One thread for each product of small matrices: the parallel work is that of gearbench's own threads.

A BLAS that starts as many threads as there are processors for matrices of a few dozen rows spends its time waiting
for them, a hundred times longer where the machine has other work to do.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from threading import Lock
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, overload

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

Value = TypeVar("Value")

_LOCK = Lock()
#: Computations that are under way, and what restores the number of threads after the last of them.
_running: list[Any] = []


@contextmanager
def single_threaded_blas() -> Iterator[None]:
    """Inside, NumPy and SciPy multiply matrices on one thread, whatever the environment says; a decorator too.

    After the last computation of the process the number of threads is again what it was before the first one. Who
    starts threads of computations enters it first: threadpoolctl lets only one thread set the number. MKL, of which the
    direct solver for finite elements is a part, is left alone.
    """
    with _LOCK:
        _running.append(None if _running else _libraries().limit(limits=1))
    try:
        yield
    finally:
        with _LOCK:
            limit = _running[0]
            if len(_running) == 1:
                limit.restore_original_limits()
                _running.clear()
            else:
                _running.pop()


@lru_cache(maxsize=1)
def _libraries() -> ThreadpoolController:
    """Thread pools of NumPy and SciPy, cached: looking for them takes a millisecond."""
    import scipy.linalg.cython_blas  # noqa: F401, loads the library that compiled kernels call, after that of NumPy
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(internal_api=["openblas", "blis"])


def default_threads() -> int:
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class lazy(Generic[Value]):
    """``functools.cached_property`` without its lock, which in Python 3.11 all objects of a class share.

    Two threads that ask an object at the same time compute the value twice.
    """

    def __init__(self, function: Callable[[Any], Value]) -> None:
        self._function = function
        self.__doc__ = function.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> Value: ...
    def __get__(self, instance: object | None, owner: type) -> Self | Value:
        """The value, computed once and kept in the object's dictionary, which from then on answers instead."""
        if instance is None:
            return self
        value = self._function(instance)
        instance.__dict__[self._name] = value
        return value
