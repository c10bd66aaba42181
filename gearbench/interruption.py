"""Ctrl-C and SIGTERM end a command at once, with the exit codes 130 and 143.

Python raises ``KeyboardInterrupt`` wherever its main thread happens to be. While an extension module is imported, in a
callback from C or in a finaliser, the exception is swallowed or comes out as another one; and an interpreter that shuts
down with half-imported modules, or beside threads in native code, may crash. A command therefore ends where it is. Only
work that keeps what is done, or that has a process to stop, asks for the exception: see ``raising``.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

#: Exit code of a command that Ctrl-C ended.
INTERRUPTED = 128 + signal.SIGINT
#: Removes the files that are being written; called when a signal ends the program.
cleanups: list[Callable[[], None]] = []
#: Number of the signal that ``raising`` has turned into an exception, and how many such blocks are open.
_heard = _raising = 0


@contextmanager
def ending() -> Iterator[None]:
    """Let both signals end the program inside the block; signals that are ignored stay ignored."""
    global _heard
    _heard, before = 0, {}
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            before[number] = signal.signal(number, _on_signal)
    unraisable = sys.unraisablehook
    # an exception that a callback swallows is raised again by ``check``: not a word about it
    sys.unraisablehook = lambda fault: None if _heard else unraisable(fault)
    try:
        yield
    except KeyboardInterrupt:
        if _heard:
            _end(_heard)
        print("gearbench: interrupted", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None
    except SystemExit as end:
        if _heard and end.code == INTERRUPTED:  # the command has said what it keeps
            sys.stdout.flush()
            os._exit(128 + _heard)
        if _heard:
            _end(_heard)
        raise
    finally:
        sys.unraisablehook = unraisable
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def raising() -> Iterator[None]:
    """Inside the block, the first signal raises ``KeyboardInterrupt``; a second one ends the program."""
    global _raising
    _raising += 1
    try:
        yield
    except Exception:
        check()  # the signal came out as another exception
        raise
    finally:
        _raising -= 1


def check() -> None:
    """Raise ``KeyboardInterrupt`` again where one was swallowed."""
    if _heard:
        raise KeyboardInterrupt


def _on_signal(number: int, _: FrameType | None) -> None:
    global _heard
    if not _raising or _heard:
        _end(number)
    _heard = number
    raise KeyboardInterrupt


def _end(number: int) -> None:
    for cleanup in cleanups:
        cleanup()
    os.write(2, b"gearbench: interrupted\n")
    os._exit(128 + number)
