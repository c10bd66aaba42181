"""Where designs are evaluated: threads of this process, or workers of dask.distributed. The results are the same."""

from __future__ import annotations

import logging
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from importlib.util import find_spec
from typing import Any

from gearbench.errors import GearbenchError, InputError
from gearbench.optimisation.problem import Evaluation, evaluate, macro_geometry
from gearbench.optimisation.study import Design, OptimisationStudy

#: Module that local workers load as they begin.
WORKER = "gearbench.optimisation.worker"
#: Tasks of a generation for each worker: a worker that is lost costs one of them, a slow one holds up the others less.
TASKS = 8


class Engine(ABC):
    """Evaluates designs of a study; a context that holds its resources."""

    @abstractmethod
    def evaluate(self, study: OptimisationStudy, designs: Sequence[Design]) -> Iterator[tuple[Design, Evaluation]]:
        """Results of ``designs``, in any order, as they come."""

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
        self._count = count

    def evaluate(self, study: OptimisationStudy, designs: Sequence[Design]) -> Iterator[tuple[Design, Evaluation]]:
        """See ``Engine``."""
        pool = ThreadPoolExecutor(self._count)
        try:
            futures = {pool.submit(evaluate, study, design): design for design in by_geometry(study, designs)}
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            pool.shutdown(cancel_futures=True)


class Dask(Engine):
    """Designs on the workers of a dask scheduler, a few at a time; connected inside its context.

    Parameters
    ----------
    scheduler
        "local:N", N worker processes on this machine, or the address of a scheduler.

    Raises
    ------
    InputError
        If it is neither, or dask.distributed is not installed.
    OSError
        If no scheduler answers there (on entering the context).
    """

    def __init__(self, scheduler: str) -> None:
        local = re.fullmatch(r"local:([1-9]\d{0,3})", scheduler)
        address = re.fullmatch(r"\w+://\S+|(?!local:)[\w.-]+:\d+", scheduler)
        if local is None and address is None:
            raise InputError("scheduler", scheduler, "must be local:N, or an address such as tcp://host:8786")
        if find_spec("distributed") is None:
            raise InputError("scheduler", scheduler, "needs dask.distributed: install the extra gearbench[optimise]")
        self._scheduler, self._workers = scheduler, int(local[1]) if local is not None else None
        self.client: Any = None
        self._cluster: Any = None

    def __enter__(self) -> Dask:
        from distributed import Client, LocalCluster

        # a lost connection is reported here, in one line
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        if self._workers is not None:
            options: dict[str, Any] = {"dashboard_address": None, "silence_logs": 50, "preload": WORKER}
            self._cluster = LocalCluster(n_workers=self._workers, threads_per_worker=1, **options)
        try:
            self.client = Client(self._cluster or self._scheduler, set_as_default=False)
        except BaseException:
            self.close()
            raise
        return self

    def evaluate(self, study: OptimisationStudy, designs: Sequence[Design]) -> Iterator[tuple[Design, Evaluation]]:
        """See ``Engine``. A task on a worker that is lost is given to another one."""
        from distributed import KilledWorker, as_completed

        ordered = by_geometry(study, designs)
        workers = max(1, sum(self.client.nthreads().values()))
        count = min(len(ordered), TASKS * workers)
        # dealt out in turn: gears that do not exist cost nothing, and stand side by side in this order
        tasks = [ordered[i::count] for i in range(count)]
        futures = [self.client.submit(_evaluate_all, study, task, pure=False) for task in tasks]
        try:
            for future in as_completed(futures, loop=self.client.loop):
                yield from future.result()
        except KilledWorker as error:
            raise GearbenchError(f"workers keep dying while they evaluate designs: {error}") from None
        except CancelledError:
            raise GearbenchError("the connection to the scheduler is lost: start it again and continue") from None
        finally:
            for future in futures:
                future.cancel()

    def close(self) -> None:
        """Leave the scheduler; end the workers started here."""
        if self.client is not None:
            self.client.close()
        if self._cluster is not None:
            self._cluster.close()


def choose_engine(scheduler: str | None, threads: int | None) -> Engine:
    """Dask where a scheduler is given, threads otherwise."""
    if scheduler is not None:
        return Dask(scheduler)
    from gearbench.robustness.montecarlo import default_threads

    return Threads(threads or default_threads())


def by_geometry(study: OptimisationStudy, designs: Sequence[Design]) -> list[Design]:
    """Designs in the order of their macro-geometry: those that share the compliance of a tooth follow each other."""
    return sorted(designs, key=lambda design: macro_geometry(study, design))


def _evaluate_all(study: OptimisationStudy, designs: Sequence[Design]) -> list[tuple[Design, Evaluation]]:
    return [(design, evaluate(study, design)) for design in designs]
