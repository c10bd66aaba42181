"""A scheduler of dask.distributed: its address, whether one answers there, a client of it."""

from __future__ import annotations

import asyncio
import logging
import re
import signal
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, TypeVar

from gearbench.errors import GearbenchError, InputError

T = TypeVar("T")

#: Seconds within which a scheduler answers.
ANSWERS = 6.0
#: Seconds that dask itself waits for it where it is stopped by another clock: its own one may be set forward.
FAR = 3e7
#: Seconds until a scheduler is asked again.
AGAIN = 0.05


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
    """Make sure, within ten seconds, that a dask scheduler answers at ``address``.

    Raises
    ------
    GearbenchError
        If it does not; says how it failed.
    """
    found: SimpleQueue[str | Exception] = SimpleQueue()

    def ask() -> None:
        try:
            found.put(asyncio.run(asyncio.wait_for(_kind(address), ANSWERS)))
        except Exception as error:  # whatever a foreign program answers
            found.put(error)

    # of its own, because the name of a host may be looked up for longer
    Thread(target=ask, daemon=True).start()
    try:
        answer = found.get(timeout=ANSWERS + 1)
    except Empty:
        answer = TimeoutError()
    if answer == "Scheduler":
        return
    if isinstance(answer, str):
        raise GearbenchError(f"scheduler {address}: a dask {answer.lower()} answers there, not a scheduler")
    if isinstance(answer, TimeoutError):
        raise GearbenchError(f"scheduler {address}: no answer within {ANSWERS:.0f} s")
    reason = " ".join(str(answer).split())[:120] or type(answer).__name__
    raise GearbenchError(f"scheduler {address}: no dask scheduler answers there ({reason})")


async def _kind(address: str) -> str:
    """The kind of dask server that answers: "Scheduler", "Worker", "Nanny"."""
    from distributed import Security, rpc

    arguments = Security().get_connection_args("client")
    async with rpc(address, timeout=FAR, connection_args=arguments) as server:
        identity: Any = await server.identity()
        return str(identity["type"])


def persistently(ask: Callable[[], T], client: Any = None) -> T:
    """Answer of a scheduler, who is asked again for ``ANSWERS`` seconds where it does not come.

    dask gives a connection up by the time of day: at once, where the clock is set forward in that moment.

    Parameters
    ----------
    ask
        Asks once.
    client
        Who asks; where it has lost the scheduler, it is not asked again.

    Raises
    ------
    OSError
        That of the last time.
    """
    end = time.monotonic() + ANSWERS
    while True:
        try:
            return ask()
        except OSError:
            if time.monotonic() > end or (client is not None and client.status != "running"):
                raise
        time.sleep(AGAIN)


@contextmanager
def silent() -> Iterator[None]:
    """Inside, dask logs nothing: what goes wrong is reported here, in one line."""
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
def connected(address: str) -> Iterator[Any]:
    """A client of the scheduler, who leaves it at the end of the block.

    Ctrl-C waits until it is connected: nobody could end a client that is half there.
    """
    from distributed import Client

    blocks = hasattr(signal, "pthread_sigmask")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM}) if blocks else set()
    try:
        with warnings.catch_warnings(action="ignore"):  # of versions: workers prove theirs
            client = persistently(lambda: Client(address, set_as_default=False, timeout=ANSWERS))
    finally:
        if blocks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
    with client:
        yield client
