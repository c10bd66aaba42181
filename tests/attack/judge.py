"""One attacked input through the command line, in this process, and the judgement on how it went."""

from __future__ import annotations

import contextlib
import io
import signal
import sys
import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import h5py
import numpy as np
from numpy.typing import NDArray

#: Longest line of an error, and longest run [s].
LINE, SECONDS = 300, 30


class Hang(BaseException):
    """A command that takes too long."""


@dataclass(frozen=True, kw_only=True)
class Ending:
    """How a command ended: exit code, both streams, warnings, exceptions that went through."""

    code: int
    out: str
    err: str
    warned: tuple[str, ...] = ()
    escaped: str = ""
    seconds: float = 0.0


def shoot(arguments: Sequence[object]) -> Ending:
    """Run the command line in this process, as the shell does."""
    import gearbench.cli.app as application
    from gearbench.cli import main

    out, err, before = io.StringIO(), io.StringIO(), sys.argv
    code, escaped, begun = 0, "", time.process_time()
    sys.argv = ["gearbench", *map(str, arguments)]
    try:
        with (
            warnings.catch_warnings(record=True) as caught,
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            # made anew for each call, the commands would cost as much time as the inputs
            mock.patch.object(application, "application", mock.Mock(return_value=_command())),
            _alarm(),
        ):
            warnings.simplefilter("always")
            try:
                main()
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
            except (Exception, Hang) as error:
                code, escaped = 1, f"{type(error).__name__}: {error}"[:400]
    finally:
        sys.argv = before
    warned = tuple(f"{w.category.__name__}: {w.message} ({Path(w.filename).name}:{w.lineno})" for w in caught)
    return Ending(
        code=code, out=out.getvalue(), err=err.getvalue(), warned=warned, escaped=escaped,
        seconds=time.process_time() - begun,
    )  # fmt: skip


@cache
def _command() -> Any:
    import typer

    from gearbench.cli.app import application

    return typer.main.get_command(application())


@contextlib.contextmanager
def _alarm() -> Iterator[None]:
    """Ends a command that takes too much processor time, or waits for ten times as long."""

    def ring(*_: object) -> None:
        raise Hang(f"longer than {SECONDS} s")

    clocks = {signal.SIGPROF: (signal.ITIMER_PROF, SECONDS), signal.SIGALRM: (signal.ITIMER_REAL, 10 * SECONDS)}
    before = {number: signal.signal(number, ring) for number in clocks}
    for clock, seconds in clocks.values():
        signal.setitimer(clock, seconds)
    try:
        yield
    finally:
        for number, (clock, _) in clocks.items():
            signal.setitimer(clock, 0)
            signal.signal(number, before[number])


def faults(ending: Ending, folder: Path, given: frozenset[str], targets: Sequence[str]) -> list[str]:
    """All that is not as it must be: ``given`` stood in ``folder`` before, ``targets`` stand there after success."""
    found = [f"escaped: {ending.escaped}"] if ending.escaped else []
    found += [f"warning: {text}" for text in ending.warned[:1]]
    if "Traceback" in ending.err:
        found.append(f"traceback: {ending.err[-300:]}")
    new = {path.name for path in folder.iterdir()} - given
    if ending.code == 0:
        if ending.err:
            found.append(f"success, but: {ending.err[:300]}")
        # the further stages of a gearbox have files beside that of the one asked for
        stems = tuple(f"{Path(name).stem}_stage_" for name in targets)
        found += [f"debris: {name}" for name in new - set(targets) if not name.startswith(stems)]
        found += [f"not written: {name}" for name in set(targets) - new]
        found += [fault for name in new & set(targets) for fault in unfit(folder / name)]
        return found
    found += [f"debris: {name}" for name in new]
    lines = ending.err.splitlines()
    if len(lines) != 1 or not ending.err.endswith("\n"):
        found.append(f"{len(lines)} lines: {ending.err[:300]!r}")
    elif len(lines[0]) > LINE:
        found.append(f"{len(lines[0])} characters: {lines[0][:LINE]}…")
    elif not lines[0].startswith("gearbench: ") or not lines[0].isprintable():
        found.append(f"not a line of ours: {lines[0]!r}")
    if ending.code not in (1, 2):
        found.append(f"exit code {ending.code}")
    if ending.code == 1 and "report" in ending.err:
        found.append(f"unexpected: {ending.err}")
    if ending.out:
        found.append(f"output before the fault: {ending.out[:100]!r}")
    return found


#: Quantities that are unknown of few samples, or of responses that do not scatter.
UNKNOWN = ("_standard_error", "_first_order", "_total", "_tightened", "_noise_floor")


def unfit(path: Path) -> list[str]:
    """NaN and infinities in a result, but for phases that a point of a sweep has not: their weight is zero."""
    if path.suffix != ".nc":
        return []
    with h5py.File(path, "r") as file:
        return [
            f"{name} is not finite"
            for name, values in file.items()
            if values.dtype.kind == "f" and not name.endswith(UNKNOWN) and not _known(name, values[...], file)
        ]


def _known(name: str, values: NDArray, file: h5py.File) -> bool:
    """Whether ``values`` are finite at all mesh phases that count."""
    weight = file["phase_weight"][...] if "phase_weight" in file else np.ones(())
    if weight.all():
        return bool(np.isfinite(values).all())
    if name.startswith("panel_"):
        return bool(np.isfinite(values[..., 0]).all())
    counts = weight > 0
    return bool(np.isfinite(values[counts] if values.shape[: weight.ndim] == weight.shape else values).all())
