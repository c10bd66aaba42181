"""Handling of Ctrl-C and SIGTERM: they end a command at once, with the exit codes 130 and 143.

By default, Python raises ``KeyboardInterrupt`` wherever its main thread happens to be. During the import of an
extension module, in a callback from C, or in a finaliser, the exception is swallowed or turns into another one. An
interpreter that shuts down with half-imported modules, or while threads run native code, may crash. A command therefore
ends without shutting down. Only work that must save its results or stop a process asks for the exception, see
``raising``.
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
#: Functions that remove unfinished files; called when a signal ends the program.
cleanups: list[Callable[[], None]] = []
#: Number of the signal that ``raising`` has turned into an exception, and number of open ``raising`` blocks.
_heard = _raising = 0


@contextmanager
def ending() -> Iterator[None]:
    """Context in which both signals end the program; ignored signals stay ignored."""
    global _heard
    _heard, before = 0, {}
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            before[number] = signal.signal(number, _on_signal)
    unraisable = sys.unraisablehook
    # ``check`` raises an exception again that a callback has swallowed: do not report it here
    sys.unraisablehook = lambda fault: None if _heard else unraisable(fault)
    try:
        yield
    except KeyboardInterrupt:
        if _heard:
            _end(_heard)
        print("gearbench: interrupted", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None
    except SystemExit as end:
        if _heard and end.code == INTERRUPTED:  # the command has already reported
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
    """Context in which the first signal raises ``KeyboardInterrupt``; a second one ends the program."""
    global _raising
    _raising += 1
    try:
        yield
    except Exception:
        check()  # the signal may have turned into this exception
        raise
    finally:
        _raising -= 1


def check() -> None:
    """Raise ``KeyboardInterrupt`` again if one was swallowed."""
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
