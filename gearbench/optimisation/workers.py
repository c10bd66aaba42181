"""Parallel evaluation of designs by processes of this machine or by dask workers.

Workers are processes, because most of an evaluation is Python code, which runs on one thread per process at a time.
They must run the same software as the calling process: every task carries its versions and the hash of its sources.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import os
import platform
import re
import signal
import sys
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, ProcessPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from importlib.util import find_spec
from multiprocessing import parent_process, resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess
from pathlib import Path
from threading import Thread
from types import ModuleType
from typing import Any, TypeVar

from gearbench.budget import VARIABLE, memory_limit, shared
from gearbench.effects.registry import installed
from gearbench.errors import GearbenchError, InputError, shortened
from gearbench.optimisation.problem import Evaluation, evaluate, macro_geometry
from gearbench.optimisation.racing import Incumbents
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.results.provenance import versions
from gearbench.threads import default_threads, single_threaded_blas

Item = TypeVar("Item")
Result = TypeVar("Result")

_LOG = logging.getLogger(__name__)
#: Processor time that this process works alone before it starts workers [s]; workers need about as long to start.
AFTER = 1.5
#: AHEAD: tasks per worker that are submitted in advance. PARTS: every new task takes 1/PARTS of a worker's share of the
#: remaining items, so the last tasks are small and the workers finish together.
AHEAD, PARTS = 2, 2
#: Time limits for a dask scheduler: to answer, and to get its first worker [s].
ANSWERS, WAIT = 6.0, 600.0


class LostError(GearbenchError):
    """A worker process ended twice with the same ``item``."""

    def __init__(self, item: Any) -> None:
        super().__init__("a worker process ended twice with the same design")
        self.item = item


class Pool(ABC):
    """Workers behind an executor of ``concurrent.futures``."""

    #: Exceptions of a task: its worker ended; the connection to all workers is lost.
    lost: tuple[type[BaseException], ...]
    disconnected: tuple[type[BaseException], ...]
    #: Whether workers are running before the first task is submitted.
    ready: bool

    @property
    @abstractmethod
    def count(self) -> int:
        """Number of evaluations that run in parallel."""

    @abstractmethod
    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Submit ``function(*arguments)`` to a worker."""

    @abstractmethod
    def close(self) -> None:
        """End the workers that this pool started, even if they are busy."""


class Workers:
    """Map functions over items on the workers of a pool; a context manager that closes the pool.

    Parameters
    ----------
    pool
        The workers.
    after
        Processor time that the calling process works alone before it starts workers [s].
    """

    def __init__(self, pool: Pool, after: float = AFTER) -> None:
        self._pool, self._after, self._spent = pool, after, 0.0
        self._warming: list[Future[Any]] | None = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.close()

    def map(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result]]:
        """Yield items with their results as they are finished.

        Neighbours in ``items`` tend to go to the same worker. Until workers are ready, the calling process does the
        work.

        Raises
        ------
        LostError
            If a worker ends while it works on an item, and ends again when given that item alone.
        GearbenchError, InputError
            If the connection to the workers is lost, or one of them runs other code.
        """
        waiting, done = deque(items), False
        try:
            with single_threaded_blas(), shared(self._pool.count):
                while waiting and not self._ready():
                    item, start = waiting.popleft(), time.thread_time()
                    result = function(item)
                    self._spent += time.thread_time() - start
                    if self._warming is None and self._spent > self._after and self._pool.count > 1:
                        # only to load the kernels in every worker; the result is already known
                        self._warming = [self._submit(function, [item]) for _ in range(self._pool.count)]
                    yield item, result
            if waiting:
                yield from self._side_by_side(function, waiting)
            done = True
        except self._pool.disconnected:
            reason = "the connection to the scheduler is lost: start it again, and continue with --resume"
            raise GearbenchError(reason) from None
        finally:
            if not done:
                self._pool.close()

    def _ready(self) -> bool:
        """Whether workers exist and have loaded their kernels."""
        return self._pool.ready or (self._warming is not None and all(future.done() for future in self._warming))

    def _side_by_side(self, function: Callable[[Item], Any], waiting: deque[Item]) -> Iterator[tuple[Item, Any]]:
        running: dict[Future[Any], list[Item]] = {}
        lost: list[Item] = []
        while waiting or running:
            while waiting and len(running) < AHEAD * self._pool.count:
                share = [waiting.popleft() for _ in range(max(1, len(waiting) // (PARTS * self._pool.count)))]
                running[self._submit(function, share)] = share
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                share = running.pop(future)
                try:
                    results = future.result()
                except self._pool.lost:
                    lost += share
                else:
                    yield from zip(share, results, strict=True)
        for item in lost:  # one at a time, so that a second loss can be blamed on the item
            try:
                yield item, self._submit(function, [item]).result()[0]
            except self._pool.lost:
                raise LostError(item) from None

    def _submit(self, function: Callable[[Item], Any], share: list[Item]) -> Future[Any]:
        return self._pool.submit(_apply, identity(), function, share)


def open_workers(scheduler: str | None = None, threads: int | None = None, after: float = AFTER) -> Workers:
    """Open workers: dask workers if ``scheduler`` is given, else ``threads`` processes (default: one per processor).

    Raises
    ------
    InputError
        If ``scheduler`` is neither "local:N" nor an address, or dask.distributed is not installed.
    GearbenchError
        If no scheduler answers, or it has no workers.
    """
    return Workers(ProcessPool(threads or default_threads()) if scheduler is None else DaskPool(scheduler), after)


def evaluations(
    workers: Workers, study: OptimisationStudy, designs: Sequence[Design], incumbents: Incumbents | None = None
) -> Iterator[tuple[Design, Evaluation]]:
    """Yield designs with their evaluations as they are finished; see ``problem.evaluate``.

    Raises
    ------
    GearbenchError
        As in ``Workers.map``; names the values of a design that ends its workers.
    """
    # designs with the same tooth compliance become neighbours
    ordered = sorted(designs, key=lambda design: macro_geometry(study, design))
    try:
        yield from workers.map(partial(evaluate, study, incumbents=incumbents), ordered)
    except LostError as error:
        values = ", ".join(f"{name} = {value}" for name, value in study.values(error.item).items())
        raise GearbenchError(f"the design {values} ended two worker processes: too little memory?") from None


@single_threaded_blas()
def _apply(asked_by: dict[str, str], function: Callable[[Any], Any], items: Sequence[Any]) -> list[Any]:
    """Apply ``function`` to ``items`` in a worker, after checking that it runs the software of the calling process."""
    require_same(asked_by)
    return [function(item) for item in items]


# -- processes of this machine -----------------------------------------------------------------------------------------
class ProcessPool(Pool):
    """Pool of ``count`` processes, started at the first task; if one of them ends, all are replaced."""

    lost, disconnected, ready = (BrokenExecutor,), (), False

    def __init__(self, count: int) -> None:
        self._count = count
        self._memory = f"{memory_limit() / count:.0f}"
        self._executor: ProcessPoolExecutor | None = None
        self._context = _Context()

    @property
    def count(self) -> int:
        """See ``Pool``."""
        return self._count

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """See ``Pool``."""
        with _starting_processes():
            for _ in range(2):
                if self._executor is None:
                    options = {"mp_context": self._context, "initializer": _begin, "initargs": (self._memory,)}
                    self._executor = ProcessPoolExecutor(self._count, **options)
                try:
                    return self._executor.submit(function, *arguments)
                except BrokenExecutor:
                    self.close()
        raise GearbenchError("worker processes end as they are started: with --threads 1 there are none")

    def close(self) -> None:
        """See ``Pool``."""
        for process in self._context.started:
            if process.pid is not None:
                process.kill()
        if self._executor is not None:
            self._executor.shutdown(cancel_futures=True)
        self._context.started.clear()
        self._executor = None


class _Context(SpawnContext):
    """Spawn context that remembers the processes it has started."""

    def __init__(self) -> None:
        self.started: list[SpawnProcess] = []

    def Process(self, *arguments: Any, **options: Any) -> SpawnProcess:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Make a process and remember it."""
        self.started.append(SpawnProcess(*arguments, **options))
        return self.started[-1]


@contextmanager
def _starting_processes() -> Iterator[None]:
    """Start processes inside this context: they ignore Ctrl-C and do not run the main script again.

    In this process, Ctrl-C waits until the context ends.
    """
    resource_tracker.ensure_running()  # if it started later, it would unblock Ctrl-C
    main = sys.modules["__main__"]
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(memory: str) -> None:
    """Initialise a worker: set its share of the memory [bytes], and end it when its parent process ends."""
    os.environ[VARIABLE] = memory
    parent = parent_process()
    assert parent is not None

    def end() -> None:
        parent.join()
        os._exit(0)

    Thread(target=end, daemon=True).start()


# -- dask --------------------------------------------------------------------------------------------------------------
class DaskPool(Pool):
    """Pool of dask workers; the scheduler hands the tasks of lost workers to others.

    Parameters
    ----------
    scheduler
        "local:N" for N worker processes on this machine, or the address of a scheduler.

    Raises
    ------
    InputError
        If ``scheduler`` is neither, or dask.distributed is not installed.
    GearbenchError
        If no scheduler answers, or no worker connects within ten minutes.
    """

    ready = True

    def __init__(self, scheduler: str) -> None:
        local = check_scheduler(scheduler)
        from distributed import Client, KilledWorker, LocalCluster
        from distributed.comm.core import CommClosedError

        self.lost, self.disconnected = (KilledWorker,), (CommClosedError, CancelledError)
        for name in ("distributed", "distributed.client"):  # errors are reported in one line instead
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        self._open = ExitStack()
        address: Any = scheduler
        try:
            with _starting_processes():
                if local is None:
                    asyncio.run(asyncio.wait_for(_answer(scheduler), ANSWERS))
                else:
                    quiet: dict[str, Any] = {"dashboard_address": None, "silence_logs": logging.CRITICAL + 1}
                    address: Any = self._open.enter_context(
                        LocalCluster(n_workers=local, threads_per_worker=1, **quiet)
                    )
                self._client: Any = self._open.enter_context(Client(address, set_as_default=False, timeout=ANSWERS))
            if not self._client.nthreads():
                _LOG.warning("gearbench: the scheduler %s has no worker; waiting up to %.0f min", scheduler, WAIT / 60)
            self._client.wait_for_workers(1, timeout=WAIT)
        except (OSError, RuntimeError, TypeError, ValueError) as error:
            self.close()
            reason = shortened(error, 120) or "no answer in time"
            raise GearbenchError(f"scheduler {scheduler}: cannot be used ({reason})") from None
        except BaseException:
            self.close()
            raise
        self._executor = self._client.get_executor(pure=False)

    @property
    def count(self) -> int:
        """See ``Pool``."""
        return max(1, sum(self._client.nthreads().values()))

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """See ``Pool``."""
        return self._executor.submit(function, *arguments)

    def close(self) -> None:
        """See ``Pool``."""
        self._open.close()


async def _answer(address: str) -> None:
    """Return once a dask scheduler answers at ``address``; a client would wait for ever if another program listens."""
    from distributed import Security, rpc

    async with rpc(address, connection_args=Security().get_connection_args("client")) as server:
        await server.identity()


def check_scheduler(text: str) -> int | None:
    """Number of local workers that ``text`` asks for; None if it is the address of a scheduler.

    Raises
    ------
    InputError
        If ``text`` is neither, or dask.distributed is not installed.
    """
    local = re.fullmatch(r"local:([1-9]\d{0,3})", text)
    address = re.fullmatch(r"(tcp|tls)://[^\s/]+:\d+|(?!local:)[\w.-]+:\d+", text)
    if local is None and address is None:
        raise InputError("scheduler", text, "must be local:N, or an address such as tcp://host:8786")
    if find_spec("distributed") is None:
        raise InputError("scheduler", text, "needs dask.distributed: install the extra gearbench[optimise]")
    return int(local[1]) if local is not None else None


# -- the same code -----------------------------------------------------------------------------------------------------
@cache
def identity() -> dict[str, str]:
    """Software of this process: versions of Python and packages, and the SHA-256 of the sources.

    The sources are those of gearbench, fem_reference, and the effects of installed packages.
    """
    package = Path(__file__).parents[1]
    paths = [*package.rglob("*.py"), *(package.parent / "fem_reference").rglob("*.py")]
    origins = (find_spec(entry.module) for entry in installed().values())
    paths += [Path(spec.origin) for spec in origins if spec is not None and spec.origin is not None]
    files = sorted(hashlib.sha256(path.read_bytes()).digest() for path in paths)
    return {"versions": versions(), "sources": hashlib.sha256(b"".join(files)).hexdigest()}


#: The hash is computed when this process loads its code, because the files may change while it runs.
identity()


def require_same(asked_by: dict[str, str]) -> None:
    """Refuse tasks from a process that runs other software.

    Raises
    ------
    InputError
        If the software differs; names the machine, and the versions if they differ.
    """
    ours = identity()
    if asked_by == ours:
        return
    fault = "has other source files of gearbench"
    if asked_by["versions"] != ours["versions"]:
        fault = f"has {ours['versions']}, the search {asked_by['versions']}"
    raise InputError("worker", f"on {platform.node()}", f"{fault}: install the same there, and restart it")
