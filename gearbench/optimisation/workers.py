"""Designs evaluated side by side by the worker processes of an executor.

Most of an evaluation is not in compiled kernels but in Python, which works on one thread of a process at a time.
"""

from __future__ import annotations

import pickle
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from functools import lru_cache, partial
from typing import Any, TypeVar

from gearbench.budget import shared
from gearbench.errors import GearbenchError
from gearbench.optimisation.executors import DaskPool, Pool, ProcessPool, identity, require_same
from gearbench.optimisation.problem import Evaluation, evaluate, macro_geometry
from gearbench.optimisation.racing import Incumbents
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.threads import default_threads, single_threaded_blas

Item = TypeVar("Item")
Result = TypeVar("Result")

#: Seconds of processor time that this process works alone before it starts workers, which need as long to start.
AFTER = 1.5
#: Tasks for each worker that are handed out ahead, and parts into which what is left is divided: the last tasks are
#: small, so that workers end together.
AHEAD, PARTS = 2, 2


class LostError(GearbenchError):
    """A worker process ended twice with the same ``item``."""

    def __init__(self, item: Any) -> None:
        super().__init__("a worker process ended twice with the same design")
        self.item = item


class Workers:
    """Applies functions to items on the workers of a pool, which it closes at the end of its context.

    Parameters
    ----------
    pool
        The workers.
    after
        Seconds of processor time that the calling process works alone before it starts workers.
    """

    def __init__(self, pool: Pool, after: float = AFTER) -> None:
        self._pool, self._after, self._spent = pool, after, 0.0
        self._warming: list[Future[Any]] | None = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.close()

    def map(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result]]:
        """Items and their results, as they come; neighbours in ``items`` are likely to be done by the same worker.

        Until workers are ready, the calling process does the work.

        Raises
        ------
        LostError
            If a worker ends while it works on an item, and another one that works on that item alone.
        GearbenchError, InputError
            If the connection to the workers is lost, or one of them runs other code.
        """
        waiting, whole = deque(items), False
        try:
            with single_threaded_blas(), shared(self._pool.count):
                while waiting and not self._ready():
                    item, start = waiting.popleft(), time.thread_time()
                    result = function(item)
                    self._spent += time.thread_time() - start
                    if self._warming is None and self._spent > self._after and self._pool.count > 1:
                        # each worker loads its kernels; the result is already known
                        work = pickle.dumps(function)
                        self._warming = [self._submit(work, [item]) for _ in range(self._pool.count)]
                    yield item, result
            if waiting:
                yield from self._side_by_side(self._pool.common(pickle.dumps(function)), waiting)
            whole = True
        except self._pool.disconnected:
            reason = "the connection to the scheduler is lost: start it again, and continue with --resume"
            raise GearbenchError(reason) from None
        finally:
            if not whole:
                self._pool.close()

    def _ready(self) -> bool:
        """Whether workers exist and have loaded their kernels."""
        return self._pool.ready or (self._warming is not None and all(future.done() for future in self._warming))

    def _side_by_side(self, work: Any, waiting: deque[Item]) -> Iterator[tuple[Item, Any]]:
        running: dict[Future[Any], list[Item]] = {}
        # items whose worker was lost: one at a time, so that the next loss is known to be theirs
        suspects: deque[Item] = deque()
        suspected: set[Item] = set()
        while waiting or suspects or running:
            if suspects and not running:
                alone = [suspects.popleft()]
                running[self._submit(work, alone)] = alone
            while waiting and not suspected and len(running) < AHEAD * self._pool.count:
                share = [waiting.popleft() for _ in range(max(1, len(waiting) // (PARTS * self._pool.count)))]
                running[self._submit(work, share)] = share
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                share = running.pop(future, [])
                try:
                    results = future.result()
                except self._pool.lost as error:
                    if len(share) == 1 and share[0] in suspected:
                        raise LostError(share[0]) from None
                    if isinstance(error, BrokenExecutor):  # all of its tasks are lost
                        share += [item for other in running.values() for item in other]
                        running.clear()
                    suspects += share
                    suspected |= {*share}
                    break
                yield from zip(share, results, strict=True)
            if suspected and not suspects and not running:
                suspected.clear()

    def _submit(self, work: Any, share: list[Any]) -> Future[Any]:
        return self._pool.submit(_apply, identity(), work, share)


def open_workers(scheduler: str | None = None, threads: int | None = None, after: float = AFTER) -> Workers:
    """Worker processes of this machine, ``threads`` or as many as processors; those of dask where there is a scheduler.

    Raises
    ------
    InputError
        If ``scheduler`` is neither "local:N" nor an address, or dask.distributed is not installed.
    GearbenchError
        If no scheduler answers there, or it has no workers.
    """
    return Workers(ProcessPool(threads or default_threads()) if scheduler is None else DaskPool(scheduler), after)


def evaluations(
    workers: Workers, study: OptimisationStudy, designs: Sequence[Design], incumbents: Incumbents | None = None
) -> Iterator[tuple[Design, Evaluation]]:
    """Designs and their evaluations, as they come; see ``problem.evaluate``.

    Raises
    ------
    GearbenchError
        As ``Workers.map``, naming the values of a design that ends its workers.
    """
    # those that share the compliance of a tooth follow each other
    ordered = sorted(designs, key=lambda design: macro_geometry(study, design))
    try:
        yield from workers.map(partial(evaluate, study, incumbents=incumbents), ordered)
    except LostError as error:
        values = ", ".join(f"{name} = {value}" for name, value in study.values(error.item).items())
        raise GearbenchError(f"the design {values} ended two worker processes: too little memory?") from None


@single_threaded_blas()
def _apply(asked_by: dict[str, str], work: bytes, items: Sequence[Any]) -> list[Any]:
    """Results of some items, in a worker that runs what the process that asks runs."""
    require_same(asked_by)
    function = _function(work)
    return [function(item) for item in items]


@lru_cache(maxsize=1)
def _function(work: bytes) -> Callable[[Any], Any]:
    """Common part of the tasks of a generation, unpacked once."""
    return pickle.loads(work)
