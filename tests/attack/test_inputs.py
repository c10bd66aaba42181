"""Attacked inputs through the command line: each ends in a result, or in one line that says what is wrong."""

from __future__ import annotations

import contextlib
import io
import signal
import sys
import tomllib
import warnings
import zipfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
import tomli_w
import typer
import xarray as xr
from numpy.random import Generator

import gearbench.cli.app as application
from gearbench.cli import main
from gearbench.effects.registry import EFFECTS, effect_class
from gearbench.results.netcdf import save
from tests.attack import mutations
from tests.support.campaign import many
from tests.support.paths import DATA, EXAMPLES, STUDY
from tests.support.texts import HELICAL

#: Longest line of an error, and longest run [s of processor time].
LINE, SECONDS = 300, 30
RESOLUTION = "[resolution]\ngauss_points = 2\nsegments = 5\n"
PAIR = f'name = "attacked"{HELICAL}[effects.tip_relief]\namount = 10.0\nlength = 0.8\n{RESOLUTION}'
BENDING = '[effects.tooth_bending]\nbasis = "paper"\n'
ERRORS = '[effects.manufacturing_errors]\npreset = "garambois2017"\n'
#: Arguments of a command, and the file that it writes.
Attack = tuple[tuple[object, ...], str | None]
command = cache(lambda: typer.main.get_command(application.application()))


@cache
def scenes() -> tuple[str, ...]:
    """Pairs that are solved in milliseconds, one of them on its shafts."""
    shafts = (EXAMPLES / "shafts.toml").read_text(encoding="utf-8")
    fast = shafts.replace('model = "solid"\n[effects.gear_body]', 'basis = "paper"') + RESOLUTION
    return PAIR + BENDING, PAIR + ERRORS, PAIR + BENDING + ERRORS, fast


@cache
def further() -> tuple[str, ...]:
    """Examples of all effects, and of what else a scene may hold."""
    effects = [{"effects": {name: dict(effect_class(name).example)}} for name in EFFECTS]
    pair = [
        {"material": {"poisson_ratio": 0.3}},
        {"pinion": {"profile_shift": 0.2}},
        {"wheel": {"bore_diameter": 30.0}},
    ]
    return tuple(tomli_w.dumps(table) for table in (*effects, *({"pair": own} for own in pair)))


def scene(rng: Generator, folder: Path) -> Attack:
    given = scenes()[rng.integers(4)]
    if rng.random() < 0.3:
        # a table given twice is no TOML
        more = further()[rng.integers(len(further()))]
        given += more if more.splitlines()[0] not in given else ""
    (folder / "scene.toml").write_bytes(mutations.text(rng, given.encode()))
    commands = [("simulate", "scene.toml", "-o", "out.nc")] * 5
    commands += [("robust", "scene.toml", "--samples", 4, "-o", "out.nc")] * 2
    commands += [("sweep", "scene.toml", "--torque", "20:100:3", "-o", "out.nc"), ("plan", "scene.toml")]
    arguments = commands[rng.integers(len(commands))]
    return arguments, "out.nc" if "out.nc" in arguments else None


def study(rng: Generator, folder: Path) -> Attack:
    given = tomllib.loads(STUDY.read_text(encoding="utf-8"))
    del given["variables"]["effects"]["crowning"]
    # many samples or designs are long, but no hang: these tables are not attacked
    few = {"algorithm": {"population": 4, "generations": 1, "seed": 1}, "robustness": {"samples": 2}}
    rest = {name: table for name, table in given.items() if name not in few}
    rest["base"]["resolution"] = {"gauss_points": 2, "segments": 4}
    attacked = mutations.text(rng, tomli_w.dumps(rest).encode())
    (folder / "study.toml").write_bytes(attacked + b"\n" + tomli_w.dumps(few).encode())
    return ("optimise", "study.toml", "-o", "front"), "front"


def rexs(rng: Generator, folder: Path) -> Attack:
    """A REXS file, plain or packed."""
    gearbox, name = rng.random() < 0.5, "model.rexs"
    model = "sew_3_stage_cylindrical_gearbox_1.0.rexs" if gearbox else "stage_1.6.rexs"
    whole = mutations.text(rng, (DATA / model).read_bytes())
    if rng.random() < 0.4:
        name, buffer = "model.rexsz", io.BytesIO()
        packing = (zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2, zipfile.ZIP_STORED)[rng.integers(4)]
        with zipfile.ZipFile(buffer, "w", packing) as archive:
            archive.writestr("model.rexs", whole)
        whole = mutations.data(rng, buffer.getvalue()) if rng.random() < 0.8 else buffer.getvalue()
    (folder / name).write_bytes(whole)
    if rng.random() < 0.5:
        return ("rexs", name), None
    stage = ("1", "2", "id:37", "1")[rng.integers(4)] if gearbox else "1"
    return ("rexs", name, "--scene", stage, "out.toml", "--torque", "50"), "out.toml"


@cache
def grids(folder: Path) -> tuple[bytes, bytes]:
    """A topography that suits the pair, as CSV and as netCDF."""
    radius, face = np.linspace(24, 28.6, 6), np.linspace(-10, 10, 5)
    deviation = np.add.outer((radius - 26) ** 2, 0.02 * face**2)
    rows = [["radius", *map(str, face)], *([str(r), *map(str, row)] for r, row in zip(radius, deviation, strict=True))]
    coords = {"radius": ("radius", radius, {"units": "mm"}), "face_position": ("face_position", face, {"units": "mm"})}
    dataset = xr.Dataset({"deviation": (("radius", "face_position"), deviation, {"units": "µm"})}, coords)
    return "\n".join(map(",".join, rows)).encode(), save(dataset, folder / "grid.nc").read_bytes()


def topography(rng: Generator, folder: Path) -> Attack:
    """A scene with a grid of a flank."""
    table, whole = grids(folder.parent)
    name = "grid.csv" if rng.random() < 0.4 else "grid.nc"
    (folder / name).write_bytes(mutations.text(rng, table) if name == "grid.csv" else mutations.netcdf(rng, whole))
    (folder / "scene.toml").write_text(f'{PAIR}[effects.topography]\npinion = "{name}"\n', encoding="utf-8")
    return ("simulate", "scene.toml", "-o", "out.nc"), "out.nc"


KINDS: dict[str, Callable[[Generator, Path], Attack]] = {
    each.__name__: each for each in (scene, study, rexs, topography)
}


# -- one attack --------------------------------------------------------------------------------------------------------
class Hang(BaseException):
    """A command that takes too long."""


@contextlib.contextmanager
def limited() -> Iterator[None]:
    """End what takes too much processor time."""

    def ring(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def shoot(arguments: tuple[object, ...], monkeypatch: pytest.MonkeyPatch) -> tuple[int, str, str]:
    """Exit code, output and error stream of a command in this process; what else it raises or warns of is a fault."""
    out, err = io.StringIO(), io.StringIO()
    monkeypatch.setattr(sys, "argv", ["gearbench", *map(str, arguments)])
    # made anew for each call, the commands would cost as much time as the inputs
    monkeypatch.setattr(application, "application", mock.Mock(return_value=command()))
    with (
        limited(),
        warnings.catch_warnings(action="error"),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as end,
    ):
        main()
    return int(end.value.code or 0), out.getvalue(), err.getvalue()


def finite(path: Path) -> bool:
    """Whether a result holds numbers at all mesh phases that count: those whose weight is not zero."""
    with xr.open_dataset(path, engine="h5netcdf") as found:
        counts = found["phase_weight"] > 0 if "phase_weight" in found else True
        # unknown of few samples, or of responses that do not scatter
        unknown = ("_standard_error", "_first_order", "_total", "_tightened", "_noise_floor")
        known = [values for name, values in found.data_vars.items() if not str(name).endswith(unknown)]
        return all(bool(np.isfinite(v.where(counts, 0.0)).all()) for v in known if v.dtype.kind == "f")


def attack(kind: str, seed: int, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One attacked input in a folder of its own, and all that must hold of its end."""
    folder.mkdir()
    monkeypatch.chdir(folder)
    arguments, target = KINDS[kind](np.random.default_rng([seed, *kind.encode()]), folder)
    before = {path.name for path in folder.iterdir()}
    code, out, err = shoot(arguments, monkeypatch)
    new = {path.name for path in folder.iterdir()} - before
    if code == 0:
        # results may be uncertain, and say so
        assert all(line.startswith("noise floor of ") for line in err.splitlines()), err
        # further stages of a gearbox have files beside that of the one asked for
        assert {name for name in new if "_stage_" not in name} == ({target} if target else set())
        assert target is None or not target.endswith(".nc") or finite(folder / target)
    else:
        assert (code in (1, 2), new, out) == (True, set(), ""), (code, new, out)
        assert err.startswith("gearbench: "), err
        assert err.endswith("\n"), err
        assert err[:-1].isprintable(), err
        assert len(err) <= LINE, err


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "seeds", [range(8), pytest.param(range(1000, 1000 + many(150)), marks=pytest.mark.slow)], ids=len
)
def test_attacked_inputs_end_in_a_result_or_in_one_line(kind, seeds, tmp_path, monkeypatch):
    for seed in seeds:
        with pytest.MonkeyPatch.context() as patch:
            try:
                attack(kind, seed, tmp_path / str(seed), patch)
            except BaseException as fault:
                fault.add_note(f"{kind}, seed {seed}")
                raise
