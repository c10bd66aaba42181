"""Processes that work for this one, as an executor of ``concurrent.futures``."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from multiprocessing import active_children, get_context, parent_process
from threading import Thread
from types import ModuleType
from typing import Any

from gearbench.budget import VARIABLE, memory_limit


class Processes(Executor):
    """Executor of ``count`` processes: they start with the first task, and with the next task after one has died."""

    def __init__(self, count: int) -> None:
        self._count, self._others = count, {*active_children()}
        self._pool: ProcessPoolExecutor | None = None

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is not None:
            return self._pool
        memory = f"{memory_limit() / self._count:.0f}"
        options = {"mp_context": get_context("spawn"), "initializer": _begin, "initargs": (memory,)}
        self._pool = ProcessPoolExecutor(self._count, **options)
        # start all now, with an empty __main__: a spawned process would run the user's program otherwise
        program, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
        try:
            for _ in range(self._count):
                self._pool.submit(os.getpid)
        finally:
            sys.modules["__main__"] = program
        return self._pool

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        """See ``Executor``."""
        try:
            return self._started().submit(function, *arguments, **options)
        except BrokenExecutor:
            self.shutdown()
            return self._started().submit(function, *arguments, **options)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = True) -> None:
        """End the processes, even if they are busy."""
        if self._pool is None:
            return
        for process in {*active_children()} - self._others:
            process.kill()
        self._pool.shutdown(wait, cancel_futures=cancel_futures)
        self._pool = None


def _begin(memory: str) -> None:
    """Initialise a worker: it has ``memory`` bytes, ignores Ctrl-C, and ends with the process that started it."""
    os.environ[VARIABLE] = memory
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def end() -> None:
        parent.join()
        os._exit(0)

    Thread(target=end, daemon=True).start()
