"""Where designs are evaluated: threads of this process, or workers of dask.distributed. The results are the same.

Processes of this machine are in ``processes``.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from contextlib import ExitStack, suppress
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any

from gearbench.budget import shared
from gearbench.errors import GearbenchError
from gearbench.optimisation.crew import Crew
from gearbench.optimisation.local_cluster import local_cluster
from gearbench.optimisation.problem import NO_GEAR, Evaluation, evaluate, macro_geometry
from gearbench.optimisation.racing import Rivals
from gearbench.optimisation.scheduler import check_scheduler, connected, persistently, require_scheduler, silent
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.threads import single_threaded_blas

#: Tasks of a generation for each thread of the workers: one that is lost costs one of them, a slow one holds up the
#: others less. So many are handed out at a time, so that workers that join get their share.
TASKS, AHEAD = 8, 2
#: Gears evaluated before there are threads, at most. The first time on a machine kernels are compiled, half a minute
#: and more: in the thread that hears Ctrl-C it ends that, in others it would have to wait for the compiler.
ALONE = 8
#: Seconds after which the workers are counted again.
LOOK = 1.0
#: Times that dask gives a task up before the search does. It gives up where four workers died with it one after the
#: other: so do those of one machine that is lost, and the task has nothing to do with it.
DEATHS = 3


class Engine(ABC):
    """Evaluates designs of a study; a context that holds its resources."""

    @abstractmethod
    def evaluate(
        self, study: OptimisationStudy, designs: Sequence[Design], rivals: Rivals | None = None
    ) -> Iterator[tuple[Design, Evaluation]]:
        """Results of ``designs``, in any order, as they come; see ``problem.evaluate``."""

    def close(self) -> None:
        """Release its resources."""
        return

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Threads(Engine):
    """Designs side by side on threads of this process; their kernels run outside Python's lock."""

    def __init__(self, count: int) -> None:
        self._count, self._alone = count, ALONE

    def evaluate(
        self, study: OptimisationStudy, designs: Sequence[Design], rivals: Rivals | None = None
    ) -> Iterator[tuple[Design, Evaluation]]:
        """See ``Engine``. The first designs are evaluated by the calling thread, until one is feasible."""
        with single_threaded_blas(), shared(self._count):
            waiting = deque(by_geometry(study, designs))
            while waiting and self._alone:
                design = waiting.popleft()
                result = evaluate(study, design, rivals)
                self._alone = 0 if result.feasible else self._alone - (result.violation < NO_GEAR)
                yield design, result
            pool = ThreadPoolExecutor(self._count)
            try:
                futures = {pool.submit(evaluate, study, design, rivals): design for design in waiting}
                for future in as_completed(futures):
                    yield futures[future], future.result()
            finally:
                pool.shutdown(cancel_futures=True)


class Dask(Engine):
    """Designs on the workers of a dask scheduler, a few at a time; connected inside its context.

    A worker is given designs once it has proved that it computes what this process does (``proof``), those that join
    later too. A search does not begin with a worker that differs; one that differs and joins later is left out.

    Parameters
    ----------
    scheduler
        "local:N", N worker processes on this machine, or the address of a scheduler.

    Raises
    ------
    InputError
        If it is neither, or dask.distributed is not installed.
    GearbenchError
        If no scheduler answers there (on entering the context).
    """

    def __init__(self, scheduler: str) -> None:
        self._scheduler, self._workers = scheduler, check_scheduler(scheduler)
        self._open = ExitStack()
        self.client: Any = None
        self._crew: Crew | None = None

    def __enter__(self) -> Dask:
        try:
            self._open.enter_context(silent())
            address = self._scheduler
            if self._workers is not None:
                address = self._open.enter_context(local_cluster(self._workers))
            require_scheduler(address)
            self.client = self._open.enter_context(connected(address))
        except BaseException:
            self.close()
            raise
        self._crew = Crew(self.client, self._scheduler)
        return self

    def evaluate(
        self, study: OptimisationStudy, designs: Sequence[Design], rivals: Rivals | None = None
    ) -> Iterator[tuple[Design, Evaluation]]:
        """See ``Engine``. A task on a worker that is lost is given to another one.

        Raises
        ------
        InputError
            If a worker differs before anything is evaluated.
        GearbenchError
            If no worker comes in time, workers keep dying, or the connection is lost.
        """
        from distributed import KilledWorker

        assert self._crew is not None
        if not designs:
            return
        try:
            yield from self._evaluated(study, by_geometry(study, designs), rivals, self._crew)
        except KilledWorker as error:
            raise GearbenchError(f"workers keep dying while they evaluate designs: {error}") from None
        except (CancelledError, OSError):
            reason = "the connection to the scheduler is lost: start it again, and continue with --resume"
            raise GearbenchError(reason) from None

    def _evaluated(
        self, study: OptimisationStudy, ordered: Sequence[Design], rivals: Rivals | None, crew: Crew
    ) -> Iterator[tuple[Design, Evaluation]]:
        from distributed import KilledWorker

        threads, counted = crew.proven(study), time.monotonic()
        count = min(len(ordered), TASKS * sum(threads.values()))
        # dealt out in turn: gears that do not exist cost nothing, and stand side by side in this order
        waiting = deque((ordered[i::count], 0) for i in range(count))
        running: dict[Any, tuple[Sequence[Design], int, set[str]]] = {}
        done: SimpleQueue[Any] = SimpleQueue()
        common: Any = None
        try:
            while waiting or running:
                if common is None or common.status == "error":
                    # sent once, and from worker to worker: with every task the rivals would be most of what is sent
                    options = {"workers": [*threads], "allow_other_workers": True, "pure": False}
                    common = self.client.submit(_common, study, rivals, **options)
                while waiting and len(running) < AHEAD * sum(threads.values()):
                    task, deaths = waiting.popleft()
                    future = self.client.submit(_evaluate_all, common, task, workers=[*threads], pure=False)
                    running[future] = task, deaths, {*threads}
                    future.add_done_callback(done.put)
                finished = {future: running.pop(future) for future in _taken(done) if future in running}
                for future in [future for future in finished if future.status == "error"]:
                    task, deaths, _ = finished.pop(future)
                    if not isinstance(future.exception(), KilledWorker) or deaths == DEATHS:
                        future.result()  # raises
                    waiting.append((task, deaths + 1))
                for results in persistently(partial(self.client.gather, [*finished]), self.client):
                    yield from results
                if time.monotonic() - counted < LOOK:
                    continue
                threads, counted = crew.proven(study), time.monotonic()
                for future, (task, deaths, given) in list(running.items()):
                    if not given & threads.keys():  # nobody is left who may do it
                        future.cancel()
                        del running[future]
                        waiting.append((task, deaths))
        finally:
            for future in running:
                future.cancel()

    def close(self) -> None:
        """Leave the scheduler; end the workers started here."""
        self._open.close()


def by_geometry(study: OptimisationStudy, designs: Sequence[Design]) -> list[Design]:
    """Designs in the order of their macro-geometry: those that share the compliance of a tooth follow each other."""
    return sorted(designs, key=lambda design: macro_geometry(study, design))


def _taken(queue: SimpleQueue[Any]) -> list[Any]:
    """All that is in a queue; waits for the first at most ``LOOK`` seconds."""
    found = []
    with suppress(Empty):
        found.append(queue.get(timeout=LOOK))
        while True:
            found.append(queue.get_nowait())
    return found


def _common(study: OptimisationStudy, rivals: Rivals | None) -> tuple[OptimisationStudy, Rivals | None]:
    """What all tasks of a generation need; a task itself, so that it is made again where its worker is lost."""
    return study, rivals


@single_threaded_blas()
def _evaluate_all(
    common: tuple[OptimisationStudy, Rivals | None], designs: Sequence[Design]
) -> list[tuple[Design, Evaluation]]:
    study, rivals = common
    return [(design, evaluate(study, design, rivals)) for design in designs]
