"""Ctrl-C and SIGTERM end a program once and for all.

Python raises ``KeyboardInterrupt`` wherever its main thread happens to be. Under the import of an extension module, in
a callback from C or a finaliser the exception is swallowed, or comes out as another one, and the program goes on to its
end. Here the signal is remembered. While a module is being imported the exception waits; and it is raised again until
it is seen on its way, or whoever caught it says so by ``arrived``.
"""

from __future__ import annotations

import atexit
import signal
import sys
from types import FrameType, TracebackType
from typing import Any

#: Seconds after which is looked again whether the exception is on its way.
AGAIN = 0.05
#: Exit code of a program that a signal ended, less the number of the signal.
ENDED_BY = 128
#: The signals that end a program, where the system has them.
_SIGNALS = (signal.SIGINT, signal.SIGTERM)

_hearing: Hearing | None = None
#: What ended an interrupted program, and with it all that was half made: finalisers complain of that.
_left: BaseException | None = None


class _Interruption(KeyboardInterrupt):
    """What the signals raise, a class of its own.

    Python takes note when a ``KeyboardInterrupt``, and none of its subclasses, leaves text that is evaluated (``exec``,
    ``eval``): at its end it sends itself SIGINT then, whatever the exit code of a module that it runs (``-m``).
    Source: ``run_eval_code_obj`` in CPython's pythonrun.c, ``Py_RunMain`` in main.c.
    """


class Hearing:
    """Context of a program: inside, both signals raise ``KeyboardInterrupt`` in the main thread, and are never lost.

    A program that a signal ended leaves the context by ``SystemExit``, 130 for Ctrl-C and 143 for SIGTERM, with one
    line on the error stream unless ``arrived`` says that somebody has spoken already. Off the main thread it does
    nothing, and a signal that is ignored (as in the background of a shell) stays ignored.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self.arrived = False
        self._over = False
        self._before: dict[int, Any] = {}
        self._unraisable, self._printed = sys.unraisablehook, sys.excepthook

    def __enter__(self) -> Hearing:
        global _hearing
        try:
            for number in _SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._on_signal)
            if hasattr(signal, "SIGALRM"):
                self._before[signal.SIGALRM] = signal.signal(signal.SIGALRM, self._on_alarm)
        except ValueError:  # not the main thread
            return self
        self._unraisable, sys.unraisablehook = sys.unraisablehook, self._on_unraisable
        self._printed, sys.excepthook = sys.excepthook, self._on_printed
        _hearing = self
        atexit.unregister(_end_at_once)
        atexit.register(_end_at_once)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        global _hearing, _left
        self._over = True
        if _hearing is self:
            _hearing, sys.unraisablehook, sys.excepthook = None, self._unraisable, self._printed
            self._look_again(0.0)
        for number, before in self._before.items():
            signal.signal(number, before)
        code = error.code if isinstance(error, SystemExit) else None
        if self.number is None or (self.arrived and code != ENDED_BY + signal.SIGINT):
            return
        if not self.arrived:
            print("gearbench: interrupted", file=sys.stderr)
        _left = error
        raise SystemExit(ENDED_BY + self.number) from None

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        insists, self.number, self.arrived = self.number is not None, self.number or number, False
        self._raise(frame, importing=not insists and _importing(frame))

    def _on_alarm(self, _: int, frame: FrameType | None) -> None:
        if not self.arrived:
            self._raise(frame, importing=_importing(frame))

    def _raise(self, frame: FrameType | None, *, importing: bool) -> None:
        if self._over:  # the context is being left, and its end sees the number
            return
        later = self._look_again(AGAIN)
        if (importing and later) or _on_its_way():
            return
        raise _Interruption

    def _on_unraisable(self, fault: Any) -> None:
        """Not a word about an exception that was swallowed, it is raised again; nor about what it left half made."""
        if self.number is None and not issubclass(fault.exc_type, KeyboardInterrupt):
            self._unraisable(fault)

    def _on_printed(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        """Nor its trace, which Cython prints before that where a function cannot raise (scipy's Sobol points)."""
        if self.number is None or not issubclass(kind, KeyboardInterrupt):
            self._printed(kind, error, trace)

    @staticmethod
    def _look_again(seconds: float) -> bool:
        """Set the alarm, or stop it by 0; whether the system has one."""
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, seconds)
        return hasattr(signal, "setitimer")


def arrived(*, dealt_with: bool = True) -> None:
    """Say that a ``KeyboardInterrupt`` has been caught and dealt with: it is not raised again; or was not yet."""
    if _hearing is not None:
        _hearing.arrived = dealt_with


def pending() -> bool:
    """Whether a signal was heard that nobody has dealt with: whatever ends the program now, the signal did."""
    return _hearing is not None and _hearing.number is not None and not _hearing.arrived


def _end_at_once() -> None:
    """While Python takes itself apart, Ctrl-C ends it without a word, and so do finalisers of what is half made."""
    global _left
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if _left is not None:
        sys.unraisablehook = lambda _: None
        _left = None


def _importing(frame: FrameType | None) -> bool:
    """Whether a module is being imported in this frame or a caller of it."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _on_its_way() -> bool:
    """Whether a ``KeyboardInterrupt`` is being handled, in a ``finally`` block say: a second one would cut that off."""
    error = sys.exception()
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__context__
    return False
