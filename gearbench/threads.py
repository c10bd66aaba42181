"""Threads: BLAS runs on one thread, because gearbench's own threads do the parallel work.

A BLAS that starts a thread per processor for matrices of a few dozen rows spends its time waiting for them, a hundred
times longer if the machine is busy.
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
#: One entry per running computation; the first entry restores the number of threads after the last computation.
_running: list[Any] = []


@contextmanager
def single_threaded_blas() -> Iterator[None]:
    """Context and decorator: NumPy and SciPy multiply matrices on one thread, whatever the environment says.

    After the last computation of the process, the number of threads is restored. Code that starts threads must enter
    the context first, because threadpoolctl lets only one thread set the number. MKL, which the direct solver of finite
    elements uses, is not changed.
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
    """Find the thread pools of NumPy and SciPy; cached, because the search takes a millisecond."""
    import scipy.linalg.cython_blas  # noqa: F401, loads the library that compiled kernels call, after that of NumPy
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(internal_api=["openblas", "blis"])


def default_threads() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class lazy(Generic[Value]):
    """Cached property without the lock of ``functools.cached_property``, which all objects share in Python 3.11.

    Two threads that access the property of an object at the same time compute its value twice.
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
        """Compute the value and store it in the object's dictionary, where later accesses find it."""
        if instance is None:
            return self
        value = self._function(instance)
        instance.__dict__[self._name] = value
        return value
