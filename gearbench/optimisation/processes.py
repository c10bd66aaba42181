"""Designs on processes of this machine, one at a time on each.

Most of an evaluation is not in compiled kernels but in Python, which works on one thread of a process at a time: two
threads had 1.4 of two processors at work.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import pairwise
from queue import SimpleQueue
from threading import Lock

from gearbench.budget import shared
from gearbench.optimisation.engine import ALONE, Engine, by_geometry
from gearbench.optimisation.problem import NO_GEAR, Evaluation, evaluate
from gearbench.optimisation.racing import Rivals
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.worker import Common, LostError, Worker
from gearbench.threads import single_threaded_blas

#: Seconds of processor time that a search evaluates by itself before it starts others: each needs as long to be ready.
AFTER = 1.5


class Processes(Engine):
    """Designs side by side on processes of this machine.

    The calling process evaluates alone until it has seen a feasible design, so that all kernels are compiled, and until
    the others are ready; a short search is over by then. From then on they evaluate, and it does the rest.

    Parameters
    ----------
    count
        How many.
    after
        Seconds of processor time after which they are started.
    workers
        Those that evaluate.
    """

    def __init__(self, count: int, after: float = AFTER) -> None:
        self._count, self._after = count, after
        self._alone, self._spent = ALONE, 0.0
        self._starting: list[Future[Worker]] = []
        self.workers: list[Worker] = []
        self._all: list[Worker] = []
        self._pool: ThreadPoolExecutor | None = None

    def evaluate(
        self, study: OptimisationStudy, designs: Sequence[Design], rivals: Rivals | None = None
    ) -> Iterator[tuple[Design, Evaluation]]:
        """See ``Engine``. The designs of a process that is lost are given to the others.

        Raises
        ------
        LostError
            If all of them are lost.
        """
        shares, whole = Shares(by_geometry(study, designs), self._count), False
        try:
            with single_threaded_blas():
                while not self._ready() and (design := shares.take(0)) is not None:
                    start = time.thread_time()
                    with shared(self._count):
                        result = evaluate(study, design, rivals)
                    self._spent += time.thread_time() - start
                    self._alone = 0 if result.feasible else self._alone - (result.violation < NO_GEAR)
                    if self._spent > self._after and self._alone <= 0:
                        self._start((study, None), design)
                    yield design, result
            common = study, rivals
            while len(shares):
                if not self.workers:
                    raise LostError("all worker processes have ended: with --threads 1 there are none")
                yield from self._side_by_side(common, shares)
            whole = True
        finally:
            if not whole:
                self.close()

    def _start(self, common: Common, design: Design) -> None:
        """Start the processes, once, and let each load its kernels by evaluating ``design``."""
        if self._all or self._count == 1:
            return
        self._pool = pool = ThreadPoolExecutor(self._count)
        self._all = [Worker(self._count) for _ in range(self._count)]

        def ready(worker: Worker) -> Worker:
            worker.evaluate(common, design)
            return worker

        self._starting = [pool.submit(ready, worker) for worker in self._all]

    def _ready(self) -> bool:
        """Whether there are processes, and all of them can begin."""
        if self._starting and all(future.done() for future in self._starting):
            self.workers = [future.result() for future in self._starting]
            self._starting = []
        return bool(self.workers)

    def _side_by_side(self, common: Common, shares: Shares) -> Iterator[tuple[Design, Evaluation]]:
        """Results of ``shares``, as they come; those that lost processes were to evaluate are left."""
        done: SimpleQueue[tuple[Design, Evaluation] | None] = SimpleQueue()

        def keep_at_work(number: int, worker: Worker) -> Worker | None:
            """Evaluate by one process while there are designs; None if it is lost."""
            try:
                while (design := shares.take(number)) is not None:
                    try:
                        done.put((design, worker.evaluate(common, design)))
                    except LostError:
                        shares.put_back(design)
                        return None
                return worker
            finally:
                done.put(None)

        assert self._pool is not None
        at_work = [self._pool.submit(keep_at_work, *each) for each in enumerate(self.workers)]
        for _ in at_work:
            yield from iter(done.get, None)
        self.workers = [worker for future in at_work if (worker := future.result()) is not None]

    def close(self) -> None:
        """End the processes."""
        for worker in self._all:
            worker.end()
        self._all, self.workers, self._starting = [], [], []
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)


class Shares:
    """Designs dealt out to processes: to each a run of them, which it takes one by one; then those of the others.

    Designs that follow each other share the compliance of a tooth.
    """

    def __init__(self, ordered: Sequence[Design], count: int) -> None:
        ends = [len(ordered) * i // count for i in range(count + 1)]
        self._runs = [deque(ordered[a:b]) for a, b in pairwise(ends)]
        self._lock = Lock()

    def __len__(self) -> int:
        return sum(map(len, self._runs))

    def take(self, number: int) -> Design | None:
        """The next design of a process, from the end of the longest run where its own is empty; None at the end."""
        with self._lock:
            if self._runs[number]:
                return self._runs[number].popleft()
            longest = max(self._runs, key=len)
            return longest.pop() if longest else None

    def put_back(self, design: Design) -> None:
        """Let another process take a design."""
        with self._lock:
            self._runs[0].append(design)
