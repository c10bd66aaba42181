"""Evaluation of designs side by side: by processes of this machine, or by any executor of ``concurrent.futures``.

Workers are processes, because most of an evaluation is Python code, which runs on one thread per process at a time.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from itertools import groupby
from multiprocessing import active_children, get_context, parent_process
from threading import Thread
from types import ModuleType

from gearbench.budget import VARIABLE, memory_limit
from gearbench.errors import GearbenchError
from gearbench.optimisation.problem import Evaluation, evaluate, macro_geometry
from gearbench.optimisation.racing import Incumbents
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.threads import single_threaded_blas

#: Largest number of designs with the same macro-geometry that one worker evaluates one after the other.
TOGETHER = 8


@contextmanager
def worker_processes(count: int) -> Iterator[Executor | None]:
    """Context with an executor of ``count`` processes; None for one, because this process does the work then."""
    if count == 1:
        yield None
        return
    others = {*active_children()}
    memory = f"{memory_limit() / count:.0f}"
    executor = ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_begin, initargs=(memory,))
    # started at once, and so that they do not run the program of this process again
    program, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
    try:
        for _ in range(count):
            executor.submit(os.getpid)
    finally:
        sys.modules["__main__"] = program
    try:
        yield executor
    finally:
        for process in {*active_children()} - others:
            process.kill()
        executor.shutdown(cancel_futures=True)


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


def evaluations(
    executor: Executor | None,
    study: OptimisationStudy,
    designs: Sequence[Design],
    incumbents: Incumbents | None = None,
) -> Iterator[tuple[Design, Evaluation]]:
    """Yield designs with their evaluations as they are finished; see ``problem.evaluate``.

    Without ``executor``, this process evaluates them.

    Raises
    ------
    GearbenchError
        If a worker process ends.
    """
    # designs of the same teeth go to one worker, which computes the compliance of these teeth once
    ordered = sorted(designs, key=lambda design: macro_geometry(study, design))
    alike = [list(group) for _, group in groupby(ordered, key=lambda design: macro_geometry(study, design))]
    shares = [group[i : i + TOGETHER] for group in alike for i in range(0, len(group), TOGETHER)]
    if executor is None:
        for share in shares:
            for design in share:
                yield design, _evaluate(study, [design], incumbents)[0]
        return
    futures: dict[Future[list[Evaluation]], list[Design]] = {}
    try:
        futures |= {executor.submit(_evaluate, study, share, incumbents): share for share in shares}
        for future in as_completed(futures):
            yield from zip(futures[future], future.result(), strict=True)
    except BrokenExecutor:
        raise GearbenchError("a worker process has ended: too little memory? --resume continues the search") from None
    finally:
        for future in futures:
            future.cancel()


@single_threaded_blas()
def _evaluate(study: OptimisationStudy, designs: Sequence[Design], incumbents: Incumbents | None) -> list[Evaluation]:
    return [evaluate(study, design, incumbents) for design in designs]
