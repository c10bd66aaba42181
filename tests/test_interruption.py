"""Ctrl-C and SIGTERM at any moment: never lost, one line, the exit code of the signal, nothing left behind."""

from __future__ import annotations

import random
import signal
import sys
import time

import pytest

from tests.support.campaign import many
from tests.support.paths import ROOT
from tests.support.programs import end, start

SCENE = ROOT / "examples" / "gear55_robust.toml"


SWALLOWED = """
import os, signal, sys, time
from contextlib import nullcontext
from gearbench.interruption import check, ending, raising

class Callback:
    def __del__(self):  # an exception raised in here is swallowed, as under the import of an extension module
        os.kill(os.getpid(), signal.{name})
        time.sleep(0.01)

with ending(), {context}():
    if "{where}" == "import":
        sys.path.insert(0, "{folder}")
        import module
    elif "{where}" == "text":
        eval("os.kill(os.getpid(), signal.{name})")  # as typer does with annotations
    else:
        Callback()
    check()
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
@pytest.mark.parametrize("where", ["import", "callback", "text"])
@pytest.mark.parametrize("context", ["nullcontext", "raising"])
def test_a_signal_is_not_lost_where_python_swallows_its_exception(tmp_path, name, code, where, context):
    (tmp_path / "module.py").write_text(MODULE.format(name=name))
    program = SWALLOWED.format(name=name, where=where, folder=tmp_path, context=context)
    code_of_it, err = end(start(sys.executable, "-c", program))
    assert code_of_it == code
    # where Python swallows the exception, it may say so
    assert err.endswith("gearbench: interrupted\n")
    assert context == "raising" or err == "gearbench: interrupted\n"


KEEPING = """
import os, signal, sys
from gearbench.interruption import INTERRUPTED, ending, raising

with ending():
    try:
        with raising():
            os.kill(os.getpid(), signal.{name})
    except KeyboardInterrupt:
        print("kept", file=sys.stderr)
        if {again}:
            os.kill(os.getpid(), signal.{name})
        sys.exit(INTERRUPTED)
"""


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
@pytest.mark.parametrize("again", [False, True])
def test_a_command_that_keeps_its_work_says_so_itself_unless_it_hears_a_second_signal(name, code, again):
    program = KEEPING.format(name=name, again=again)
    said = "kept\ngearbench: interrupted\n" if again else "kept\n"
    assert end(start(sys.executable, "-c", program)) == (code, said)


WRITING = """
import os, signal
from gearbench.files import replacing
from gearbench.interruption import ending

with ending(), replacing("file.txt") as part:
    part.write_text("half of")
    os.kill(os.getpid(), signal.SIGINT)
"""


def test_files_that_are_being_written_are_removed(tmp_path):
    assert end(start(sys.executable, "-c", WRITING, folder=tmp_path)) == (130, "gearbench: interrupted\n")
    assert list(tmp_path.iterdir()) == []


def test_handlers_are_those_of_before_afterwards(run):
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [*map(signal.getsignal, numbers)]
    assert run("--version")[0] == 0
    assert [*map(signal.getsignal, numbers)] == before


def test_an_interruption_that_is_raised_elsewhere_ends_a_command_alike(run, monkeypatch):
    def interrupted(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("gearbench.scene_file.read_scene", interrupted)
    assert run("simulate", SCENE) == (130, "", "gearbench: interrupted\n")


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


def hold(code: int, err: str, number: signal.Signals) -> bool:
    """Check the end of a program that a signal was sent to; whether it was still running."""
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


@pytest.mark.slow
def test_many_interruptions_are_all_heard(tmp_path):
    rng, interrupted, count = random.Random(2), 0, many(24)
    for i in range(count):
        number, folder = signal.SIGTERM if i % 4 == 3 else signal.SIGINT, tmp_path / str(i)
        folder.mkdir()
        process = start(sys.executable, "-m", "gearbench", *COMMANDS[rng.randrange(len(COMMANDS))], folder=folder)
        time.sleep(rng.uniform(0.02, 2.0))
        process.send_signal(number)
        interrupted += hold(*end(process), number)
        assert [path.name for path in folder.rglob(".*") if path.name != ".lock"] == []
    assert interrupted >= count // 3
