"""The command line among other programs: help, completion, colours, progress, JSON, quiet and verbose."""

from __future__ import annotations

import json
import logging
import os
import pty
import re
import select
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from gearbench.cli.app import COMMANDS
from gearbench.cli.output import print_mapping
from tests.support.paths import EXAMPLES, ROOT

GEARBOX = ROOT / "tests" / "data" / "sew_3_stage_cylindrical_gearbox_1.0.rexs"

STUDY = """
objectives = ["mesh_stiffness_rms_mean"]
[base]
load.torque = 10.0
effects = { hertz = {} }
resolution.gauss_points = 2
[base.pair]
normal_module = 2.0
face_width = 8.0
centre_distance = 38.0
pinion.teeth = 17
wheel.teeth = 17
[variables.pair]
helix_angle = { min = 15.0, max = 20.0 }
[algorithm]
population = 4
generations = 2
[robustness]
samples = 0
"""


@pytest.fixture
def study(tmp_path):
    """A study that takes no time."""
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    return tmp_path / "study.toml"


def on_a_terminal(*arguments: object, **env: str) -> str:
    """What the command line writes where both its streams are a terminal."""
    ours, theirs = pty.openpty()
    environment = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "TERM", "FORCE_COLOR", "CI")}
    command = [sys.executable, "-m", "gearbench", *map(str, arguments)]
    environment |= {"TERM": "xterm-256color", **env}
    with subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, cwd=ROOT, env=environment) as process:
        os.close(theirs)
        text = b""
        while select.select([ours], [], [], 120)[0]:
            try:
                part = os.read(ours, 65536)
            except OSError:  # the other end is closed
                break
            if not part:
                break
            text += part
    os.close(ours)
    assert process.returncode == 0, text
    return text.decode()


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_an_example_that_fits_the_command_and_options_of_every_command(run, monkeypatch, name):
    monkeypatch.setenv("COLUMNS", "300")
    code, out, _ = run(name, "--help")
    assert code == 0
    example = re.search(r"Example: (gearbench [^\n]*)", out)
    assert example is not None
    words = shlex.split(example[1].split(", then ")[0].strip())
    assert words[1] == name
    rest = out.split("Example:")[1].split("\n", 1)[1]
    for word in words[2:]:
        if word.startswith("-"):
            assert re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", rest), word
        if word.startswith("examples/"):
            assert (ROOT / word).exists()
    for option in ("--quiet", "-q", "--verbose", "-v", "--json"):
        assert re.search(rf"(?<![\w-]){option}(?![\w-])", out), option


def test_words_in_brackets_are_shown(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    assert "[planetary]" in run("response", "--help")[1]
    assert "[N·m]" in run("simulate", "--help")[1]


def test_no_escape_sequences_in_a_pipe():
    environment = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR")}
    command = [sys.executable, "-m", "gearbench", "simulate", str(EXAMPLES / "sc.toml")]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert "mesh stiffness" in done.stdout
    assert "\x1b" not in done.stdout + done.stderr


@pytest.mark.slow
def test_progress_on_a_terminal_only(study, tmp_path, run):
    line = re.compile(r"generation \d+/2, \d+ evaluated, .* left")
    assert line.search(on_a_terminal("optimise", study, "-o", tmp_path / "shown", COLUMNS="160"))
    for unwanted in ("--quiet", "--json"):
        text = on_a_terminal("optimise", study, "-o", tmp_path / unwanted.strip("-"), unwanted)
        assert not line.search(text)
        # a package of pymoo's resets the terminal as the program ends
        assert "\x1b" not in text.removesuffix("\x1b[0m")
    assert run("optimise", study, "-o", tmp_path / "pipe")[2] == ""


def strict(text: str) -> dict:
    """One JSON object as the standard has it: no NaN, nothing before or behind it."""
    return json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


@pytest.mark.slow
def test_json_summaries(run, study, tmp_path):
    front = tmp_path / "front"
    calls = {
        "simulate": (EXAMPLES / "sc.toml", "-o", tmp_path / "sc.nc"),
        "robust": (EXAMPLES / "gear55_robust.toml", "--samples", 2, "-o", tmp_path / "robust.nc"),
        "plan": (EXAMPLES / "sc.toml",),
        "optimise": (study, "-o", front),
        "select": (front, "--csv", tmp_path / "left.csv"),
        "explore": (front, "--export", tmp_path / "page.html"),
        "rexs": (GEARBOX, "--scene", "2", tmp_path / "stage2.toml"),
        "doctor": (),
    }
    for name, arguments in calls.items():
        code, out, _ = run(name, *arguments, "--json")
        assert code == 0, name
        for path in strict(out).get("files", ()):
            assert Path(path).exists(), name
    assert strict(run("rexs", GEARBOX, "--json")[1])["stages"][1]["teeth"] == "13/76"
    assert strict(run("simulate", EXAMPLES / "sc.toml", "--json", "-o", tmp_path / "o.nc")[1])["files"]


def test_numbers_that_are_not_finite_are_null(capsys):
    print_mapping({"a": float("nan"), "b": [float("inf"), 1.0], "c": {"d": -float("inf"), "e": "µm"}})
    assert strict(capsys.readouterr().out) == {"a": None, "b": [None, 1.0], "c": {"d": None, "e": "µm"}}


def test_quiet_prints_nothing(run, study, tmp_path):
    for arguments in (
        ("simulate", EXAMPLES / "sc.toml"),
        ("robust", EXAMPLES / "gear55_robust.toml", "--samples", 8),
        ("optimise", study, "-o", tmp_path / "front"),
        ("select", tmp_path / "front"),
        ("rexs", GEARBOX, "--scene", "2", tmp_path / "stage2.toml"),
    ):
        assert run(*arguments, "--quiet") == (0, "", "")
    assert run("plan", EXAMPLES / "sc.toml", "-q") == (0, "", "")
    assert run("doctor", "-q")[1:] == ("", "")


def test_verbose_tells_on_the_error_stream_and_leaves_no_trace(run):
    code, out, err = run("simulate", EXAMPLES / "sc.toml", "-v", "--json")
    assert code == 0
    assert "mesh_stiffness_mean" in strict(out)
    assert re.search(r"^ *\d+ ms  read .*sc\.toml: tooth_bending, hertz$", err, flags=re.MULTILINE)
    assert "Newton steps" in err
    assert not logging.getLogger("gearbench").handlers
    assert run("simulate", EXAMPLES / "sc.toml")[2] == ""


def test_a_failure_tells_where_it_happened_if_asked(run, tmp_path, monkeypatch):
    import gearbench.results.netcdf

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(gearbench.results.netcdf, "save", full)
    plain = run("simulate", EXAMPLES / "sc.toml", "-o", tmp_path / "o.nc")
    told = run("simulate", EXAMPLES / "sc.toml", "-o", tmp_path / "o.nc", "-v")
    assert plain[0] == told[0] == 1
    assert "Traceback" not in plain[2]
    assert "Traceback" in told[2]
