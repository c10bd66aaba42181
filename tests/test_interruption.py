"""Ctrl-C and SIGTERM at any moment: never lost, one line, the exit code of the signal, nothing left behind."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from gearbench import interruption
from gearbench.cli import main
from tests.support.paths import ROOT

SCENE = ROOT / "examples" / "gear55_robust.toml"


def start(*command: object, folder: Path | None = None) -> subprocess.Popen[str]:
    """A program that hears Ctrl-C, though it may be started by a shell's background, which hands down deafness."""
    heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "preexec_fn": heard, "start_new_session": True}
    return subprocess.Popen([*map(str, command)], text=True, cwd=folder, env=environment, **pipes)


def end(process: subprocess.Popen[str]) -> tuple[int, str]:
    try:
        _, err = process.communicate(timeout=30)
    finally:
        process.kill()
    return process.returncode, err


SWALLOWED = """
import os, signal, sys, time
from gearbench.interruption import Hearing

class Callback:
    def __del__(self):  # an exception raised in here is swallowed, as under the import of an extension module
        os.kill(os.getpid(), signal.{name})
        time.sleep(0.01)

with Hearing():
    if "{where}" == "import":
        sys.path.insert(0, "{folder}")
        import module
    else:
        Callback()
    time.sleep(20)
    print("went on to its end")
"""
MODULE = """
import os, signal
try:
    os.kill(os.getpid(), signal.{name})
    for _ in range(1000):
        pass
except BaseException:
    raise ImportError("as extension modules do")
"""


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
@pytest.mark.parametrize("where", ["import", "callback"])
def test_a_signal_is_not_lost_where_python_swallows_its_exception(tmp_path, name, code, where):
    (tmp_path / "module.py").write_text(MODULE.format(name=name))
    began = time.monotonic()
    program = SWALLOWED.format(name=name, where=where, folder=tmp_path)
    assert end(start(sys.executable, "-c", program)) == (code, "gearbench: interrupted\n")
    assert time.monotonic() - began < 15


HALF_MADE = """
import os, signal
from gearbench.interruption import Hearing

class Module:
    def __init__(self):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000):
            pass
        self.handle = 1

    def __del__(self):  # as those of compiled modules
        del self.handle

with Hearing():
    Module()
"""


def test_what_an_interruption_leaves_half_made_says_nothing():
    assert end(start(sys.executable, "-c", HALF_MADE)) == (130, "gearbench: interrupted\n")


TEXT = """
from gearbench.interruption import Hearing

with Hearing():
    eval("__import__('signal').raise_signal({number})")  # as typer does with annotations
"""


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_python_does_not_end_a_module_by_ctrl_c_that_was_raised_in_evaluated_text(tmp_path, number, code):
    (tmp_path / "program.py").write_text(TEXT.format(number=int(number)))
    program = start(sys.executable, "-m", "program", folder=tmp_path)
    assert end(program) == (code, "gearbench: interrupted\n")


def code_of(program: Callable[[], None]) -> int:
    """Exit code of a program that hears signals."""
    with pytest.raises(SystemExit) as left, interruption.Hearing():
        program()
    assert isinstance(left.value.code, int)
    return left.value.code


def test_a_second_exception_does_not_cut_off_what_the_first_one_ends():
    done = []

    def program() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            time.sleep(5 * interruption.AGAIN)
            done.append("tidied up")

    assert (code_of(program), done) == (130, ["tidied up"])


def test_who_has_dealt_with_it_goes_on():
    with interruption.Hearing() as hearing:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        assert interruption.pending()
        interruption.arrived()
        time.sleep(3 * interruption.AGAIN)
        assert not interruption.pending()
    assert hearing.number == signal.SIGTERM


def test_a_command_that_says_so_itself_ends_with_the_code_of_the_signal():
    def program() -> None:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        interruption.arrived()
        raise SystemExit(130)

    assert code_of(program) == 143


def test_a_signal_while_the_context_is_left_is_heard(monkeypatch, capsys):
    stop = signal.setitimer

    def signal_and_stop(timer: int, seconds: float) -> None:
        if not seconds:
            signal.raise_signal(signal.SIGTERM)
        stop(timer, seconds)

    monkeypatch.setattr("signal.setitimer", signal_and_stop)
    assert code_of(lambda: None) == 143
    assert capsys.readouterr().err == "gearbench: interrupted\n"


def handlers() -> tuple[object, ...]:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)
    return (*map(signal.getsignal, numbers), sys.unraisablehook)


def test_handlers_are_those_of_before_afterwards(run):
    before = handlers()
    assert run("--version")[0] == 0
    assert handlers() == before


def test_another_error_that_the_signal_became_is_the_signal(monkeypatch, capsys):
    def fails() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except BaseException as error:
            raise ImportError("numpy failed to import") from error

    monkeypatch.setattr("gearbench.cli.app.app", fails)
    with pytest.raises(SystemExit, match="130"):
        main()
    assert capsys.readouterr().err == "gearbench: interrupted\n"


def test_an_interruption_that_is_swallowed_leaves_no_trace(monkeypatch, capsys):
    """Cython prints what a function cannot raise, a trace for the user to read; other faults are printed as ever."""

    def swallows() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except BaseException as error:
            sys.excepthook(type(error), error, error.__traceback__)
        sys.excepthook(ValueError, ValueError("of something else"), None)
        raise KeyboardInterrupt

    before = sys.excepthook
    monkeypatch.setattr("gearbench.cli.app.app", swallows)
    with pytest.raises(SystemExit, match="130"):
        main()
    assert capsys.readouterr().err == "ValueError: of something else\ngearbench: interrupted\n"
    assert sys.excepthook is before


# -- at random moments -------------------------------------------------------------------------------------------------
COMMANDS = (
    ("simulate", SCENE, "-o", "out.nc"),
    ("robust", SCENE, "--samples", 256, "-o", "out.nc"),
    ("optimise", ROOT / "examples" / "optimise_small.toml", "-o", "out"),
    ("plan", SCENE),
    ("sweep", SCENE, "--torque", "1:8:0.01", "-o", "out.nc"),
    ("hunting", ROOT / "tests" / "data" / "waves.toml", "-o", "out.nc"),
    ("response", ROOT / "examples" / "shafts.toml", "--speed", "500:6000:20000", "-o", "out.nc"),
    ("explore", SCENE, "--port", 0),
)


#: Python's own words where Ctrl-C ends it before gearbench begins.
STARTING = ("Fatal Python error: init", "Could not import runpy module")


def interrupt_at(moment: float, number: signal.Signals, command: tuple, folder: Path) -> tuple[int, str]:
    folder.mkdir()
    process = start(sys.executable, "-m", "gearbench", *command, folder=folder)
    time.sleep(moment)
    process.send_signal(number)
    return end(process)


def hold(code: int, err: str, number: signal.Signals, folder: Path) -> bool:
    """Check the end of a program that a signal was sent to; whether it was still running."""
    hidden = [path.name for path in folder.rglob(".*") if path.name != ".lock"]
    assert hidden == []
    if code == 0:  # it had come to its end before
        assert err == ""
        return False
    # Python had not handed over to gearbench yet
    if code == -number or err.startswith(STARTING):
        assert "gearbench:" not in err
        return True
    assert code == 128 + number, err
    assert err.startswith("gearbench: interrupted"), err
    assert err.count("\n") == 1, err
    return True


def interrupt_often(count: int, longest: float, tmp_path: Path, seed: int) -> int:
    rng = random.Random(seed)
    interrupted = 0
    for i in range(count):
        number = signal.SIGTERM if i % 4 == 3 else signal.SIGINT
        folder, command = tmp_path / str(i), COMMANDS[rng.randrange(len(COMMANDS))]
        interrupted += hold(*interrupt_at(rng.uniform(0.02, longest), number, command, folder), number, folder)
    return interrupted


def test_interrupted_at_random_moments(tmp_path):
    assert interrupt_often(10, 1.0, tmp_path, seed=1) >= 3


@pytest.mark.slow
def test_three_hundred_interruptions_are_all_heard(tmp_path):
    assert interrupt_often(300, 2.0, tmp_path, seed=2) >= 100
