"""Executors of ``concurrent.futures`` whose workers evaluate designs: processes of this machine, or workers of dask.

Workers must run the same software as the asking process: each task carries the versions and the hash of the code.
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
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import cache
from importlib.util import find_spec
from multiprocessing import parent_process, resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess
from pathlib import Path
from threading import Thread
from types import ModuleType
from typing import Any

from gearbench.budget import VARIABLE, memory_limit
from gearbench.effects.registry import installed
from gearbench.errors import GearbenchError, InputError
from gearbench.results.provenance import versions

_LOG = logging.getLogger(__name__)

#: Timeouts [s]: for the answer of a scheduler, for its first worker, and for the line that says so.
ANSWERS, WAIT, SILENCE = 6.0, 600.0, 10.0


class Pool(ABC):
    """Workers behind an executor."""

    #: Exceptions of a task whose worker is lost, and of one that lost all workers.
    lost: tuple[type[BaseException], ...]
    disconnected: tuple[type[BaseException], ...]
    #: Whether workers are there before they are asked for.
    ready: bool

    @property
    @abstractmethod
    def count(self) -> int:
        """Evaluations side by side."""

    @abstractmethod
    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """``function`` with its ``arguments`` on a worker."""

    @abstractmethod
    def common(self, data: bytes) -> Any:
        """An argument that many tasks have in common."""

    @abstractmethod
    def close(self) -> None:
        """End what was started here, whatever it is doing."""


class ProcessPool(Pool):
    """Processes of this machine, started when they are first asked for; lost ones are replaced by new ones.

    Parameters
    ----------
    count
        How many.
    """

    lost, disconnected, ready = (BrokenExecutor,), (), False

    def __init__(self, count: int) -> None:
        self._count, self._memory = count, f"{memory_limit() / count:.0f}"
        self._executor: Executor | None = None
        self._context = _Context()

    @property
    def count(self) -> int:
        """See ``Pool``."""
        return self._count

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """See ``Pool``."""
        for _ in range(2):
            if self._executor is None:
                options = {"mp_context": self._context, "initializer": _begin, "initargs": (self._memory,)}
                self._executor = ProcessPoolExecutor(self._count, **options)
            try:
                return self._executor.submit(function, *arguments)
            except BrokenExecutor:
                self.close()
        raise GearbenchError("worker processes end as they are started: with --threads 1 there are none")

    def common(self, data: bytes) -> bytes:
        """See ``Pool``."""
        return data

    def close(self) -> None:
        """See ``Pool``."""
        for process in self._context.started:
            if process.pid is not None:
                process.kill()
        if self._executor is not None:
            self._executor.shutdown(cancel_futures=True)
        self._context.started.clear()
        self._executor = None


class DaskPool(Pool):
    """Workers of a dask scheduler, which gives the tasks of lost workers to others.

    Parameters
    ----------
    scheduler
        "local:N", N worker processes on this machine, or the address of a scheduler.

    Raises
    ------
    InputError
        If it is neither, or dask.distributed is not installed.
    GearbenchError
        If no scheduler answers there, or no worker comes.
    """

    ready = True

    def __init__(self, scheduler: str) -> None:
        local = check_scheduler(scheduler)
        from distributed import KilledWorker
        from distributed.comm.core import CommClosedError

        self.lost, self.disconnected = (KilledWorker,), (CommClosedError, CancelledError)
        self._open = ExitStack()
        try:
            self._open.enter_context(silent())
            if local is None:
                require_scheduler(scheduler)
            self._client = self._open.enter_context(_connected(scheduler, local))
            _wait_for_workers(self._client, scheduler)
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

    def common(self, data: bytes) -> Any:
        """See ``Pool``.

        It is a task itself: dask sends it once, from worker to worker, and computes it again if it is lost.
        """
        return self._client.submit(bytes, data, pure=False)

    def close(self) -> None:
        """See ``Pool``."""
        self._open.close()


# -- worker processes --------------------------------------------------------------------------------------------------
class _Process(SpawnProcess):
    """Process that ignores Ctrl-C and does not run the starting script again."""

    def start(self) -> None:
        """Start it with SIGINT blocked, which is handed down."""
        main = sys.modules["__main__"]
        with _deaf():
            try:
                sys.modules["__main__"] = ModuleType("__main__")
                super().start()
            finally:
                sys.modules["__main__"] = main


@contextmanager
def _deaf() -> Iterator[None]:
    """Context in which Ctrl-C waits and started processes ignore it."""
    resource_tracker.ensure_running()  # it would unblock them
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Context(SpawnContext):
    """Start method of worker processes, and the processes that it started."""

    def __init__(self) -> None:
        self.started: list[_Process] = []

    def Process(self, *arguments: Any, **options: Any) -> _Process:  # pyright: ignore[reportIncompatibleVariableOverride]
        """A process that is to be started."""
        process = _Process(*arguments, **options)
        self.started.append(process)
        return process


def _begin(memory: str) -> None:
    """Begin a worker: its share of the memory [bytes], and an end with the process that started it."""
    os.environ[VARIABLE] = memory
    parent = parent_process()
    assert parent is not None

    def end() -> None:
        parent.join()
        os._exit(0)

    Thread(target=end, daemon=True).start()


# -- dask --------------------------------------------------------------------------------------------------------------
def check_scheduler(text: str) -> int | None:
    """Number of workers on this machine that ``text`` asks for; None where it is the address of a scheduler.

    Raises
    ------
    InputError
        If it is neither, or dask.distributed is not installed.
    """
    local = re.fullmatch(r"local:([1-9]\d{0,3})", text)
    address = re.fullmatch(r"(tcp|tls)://[^\s/]+:\d+|(?!local:)[\w.-]+:\d+", text)
    if local is None and address is None:
        raise InputError("scheduler", text, "must be local:N, or an address such as tcp://host:8786")
    if find_spec("distributed") is None:
        raise InputError("scheduler", text, "needs dask.distributed: install the extra gearbench[optimise]")
    return int(local[1]) if local is not None else None


def require_scheduler(address: str) -> None:
    """Make sure, within ten seconds, that a dask scheduler answers at ``address``: a client would wait for ever.

    Raises
    ------
    GearbenchError
        If it does not; says how it failed.
    """
    kind: Future[str] = Future()

    def ask() -> None:
        try:
            kind.set_result(asyncio.run(asyncio.wait_for(_kind(address), ANSWERS)))
        except Exception as error:  # any answer of another program
            kind.set_exception(error)

    # of its own, because the name of a host may be looked up for longer
    Thread(target=ask, daemon=True).start()
    try:
        if (found := kind.result(ANSWERS + 1)) == "Scheduler":
            return
        reason = f"a dask {found.lower()} answers there, not a scheduler"
    except TimeoutError:
        reason = f"no answer within {ANSWERS:.0f} s"
    except Exception as error:
        said = " ".join(str(error).split())[:120] or type(error).__name__
        reason = f"no dask scheduler answers there ({said})"
    raise GearbenchError(f"scheduler {address}: {reason}")


async def _kind(address: str) -> str:
    """The kind of dask server that answers: "Scheduler", "Worker", "Nanny"."""
    from distributed import Security, rpc

    arguments = Security().get_connection_args("client")
    async with rpc(address, connection_args=arguments) as server:
        identity: Any = await server.identity()
        return str(identity["type"])


@contextmanager
def silent() -> Iterator[None]:
    """Context in which dask logs nothing: errors are reported in one line."""
    import distributed  # noqa: F401, sets its levels as it is imported

    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in ("distributed", "tornado")]
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


@contextmanager
def _connected(scheduler: str, local: int | None) -> Iterator[Any]:
    """A client of a scheduler, or of one that is started here with ``local`` workers.

    Ctrl-C waits until it is connected, because a half-connected client cannot be closed.

    Raises
    ------
    GearbenchError
        If local workers cannot be started.
    """
    from distributed import Client, LocalCluster

    with ExitStack() as stack:
        with _deaf():
            address: Any = scheduler
            if local is not None:
                options: dict[str, Any] = {"dashboard_address": None, "silence_logs": logging.CRITICAL + 1}
                try:
                    address = stack.enter_context(LocalCluster(n_workers=local, threads_per_worker=1, **options))
                except (RuntimeError, OSError) as error:
                    raise GearbenchError(f"scheduler {scheduler}: workers could not be started: {error}") from None
            client = stack.enter_context(Client(address, set_as_default=False, timeout=ANSWERS))
        yield client


def _wait_for_workers(client: Any, scheduler: str) -> None:
    """Wait for the first worker.

    Raises
    ------
    GearbenchError
        If none comes within ten minutes.
    """
    for seconds in (SILENCE, WAIT):
        try:
            client.wait_for_workers(1, timeout=seconds)
        except TimeoutError:
            missing = f"no worker is connected to the scheduler {scheduler}"
            if seconds == WAIT:
                raise GearbenchError(f"{missing} within {WAIT / 60:.0f} min") from None
            _LOG.warning("gearbench: %s; waiting up to %.0f min", missing, WAIT / 60)
        else:
            return


# -- the same code -----------------------------------------------------------------------------------------------------
@cache
def identity() -> dict[str, str]:
    """Software of this process: versions of Python and packages, and the SHA-256 of the sources.

    Those are the ones of gearbench, of its finite elements, and of the effects that other packages bring.
    """
    package = Path(__file__).parents[1]
    paths = [*package.rglob("*.py"), *(package.parent / "fem_reference").rglob("*.py")]
    origins = (find_spec(entry.module) for entry in installed().values())
    paths += [Path(spec.origin) for spec in origins if spec is not None and spec.origin is not None]
    files = sorted(hashlib.sha256(path.read_bytes()).digest() for path in paths)
    return {"versions": versions(), "sources": hashlib.sha256(b"".join(files)).hexdigest()}


#: Taken as this process loads its code: the files may change while it runs.
identity()


def require_same(asked_by: dict[str, str]) -> None:
    """Refuse to work for a process with other software.

    Raises
    ------
    InputError
        Naming the machine, and the versions where they differ.
    """
    ours = identity()
    if asked_by["versions"] != ours["versions"]:
        fault = f"has {ours['versions']}, the search {asked_by['versions']}"
    elif asked_by["sources"] != ours["sources"]:
        fault = "has other source files of gearbench"
    else:
        return
    raise InputError("worker", f"on {platform.node()}", f"{fault}: install the same there, and restart it")
