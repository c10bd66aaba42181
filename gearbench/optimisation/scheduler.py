"""Workers of dask.distributed as the executor of a search (option ``--scheduler`` of ``optimise``)."""

from __future__ import annotations

import asyncio
import logging
import re
import signal
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from multiprocessing import resource_tracker
from typing import Any

from gearbench.errors import GearbenchError, InputError, install_extra, shortened

#: Longest wait [s] for the answer of a scheduler, and for its first worker.
ANSWER_LIMIT, WORKER_LIMIT = 6.0, 600.0


@contextmanager
def dask_workers(scheduler: str) -> Iterator[Executor]:
    """Context with an executor of dask workers; their scheduler gives the tasks of lost workers to others.

    Parameters
    ----------
    scheduler
        "local:N" for N worker processes on this machine, or the address of a scheduler.

    Raises
    ------
    InputError
        If ``scheduler`` is neither local:N nor an address, dask.distributed is not installed, no scheduler answers, or
        no worker connects within ten minutes.
    GearbenchError
        If the connection to the scheduler is lost, or one task kills several workers in turn.
    """
    local = re.fullmatch(r"local:([1-9]\d{0,3})", scheduler)
    if local is None and not re.fullmatch(r"(tcp|tls)://[^\s/]+:\d+|(?!local:)[\w.-]+:\d+", scheduler):
        raise InputError("scheduler", scheduler, "must be local:N, or an address such as tcp://host:8786")
    if find_spec("distributed") is None:
        raise InputError("scheduler", scheduler, f"needs dask.distributed: {install_extra('optimise')}")
    from distributed import Client, KilledWorker, LocalCluster
    from distributed.comm.core import CommClosedError

    address: Any = scheduler
    with ExitStack() as stack:
        try:
            if local is None:
                asyncio.run(asyncio.wait_for(_answer(scheduler), ANSWER_LIMIT))
            else:
                quiet: Any = {"dashboard_address": None, "silence_logs": logging.CRITICAL + 1}  # no web page, no logs
                with _ctrl_c_blocked():
                    address = stack.enter_context(LocalCluster(n_workers=int(local[1]), threads_per_worker=1, **quiet))
            client = stack.enter_context(Client(address, set_as_default=False, timeout=ANSWER_LIMIT))
            client.wait_for_workers(1, timeout=WORKER_LIMIT)
        except (OSError, RuntimeError, TypeError, ValueError) as error:
            reason = shortened(error, 120) or "no answer in time"
            raise InputError("scheduler", scheduler, f"cannot be used ({reason})") from None
        try:
            # dask would not run a pure task that equals an earlier one, but return the earlier result
            yield client.get_executor(pure=False)
        except KilledWorker:
            raise GearbenchError("one task killed several workers in turn: too little memory?") from None
        except (CancelledError, CommClosedError):
            reason = "the connection to the scheduler is lost: start it again, and continue with --resume"
            raise GearbenchError(reason) from None


@contextmanager
def _ctrl_c_blocked() -> Iterator[None]:
    """Context to start threads and processes that never receive Ctrl-C; the caller receives it after the context."""
    resource_tracker.ensure_running()  # would unblock Ctrl-C if it started later
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


async def _answer(address: str) -> None:
    """Return once a dask scheduler answers at ``address``; a client would wait for ever if another program listens."""
    from distributed import Security, rpc

    async with rpc(address, connection_args=Security().get_connection_args("client")) as server:
        await server.identity()
