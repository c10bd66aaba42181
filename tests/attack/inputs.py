"""Attacked inputs by kind and seed: files in a folder, and the command that reads them."""

from __future__ import annotations

import io
import tomllib
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.random import Generator

from gearbench.effects.registry import EFFECTS, effect_class
from tests.attack import hostile, netcdf
from tests.support.paths import DATA, ROOT
from tests.support.texts import HELICAL

#: A pair that is solved in milliseconds.
PAIR = f"""name = "attacked"{HELICAL}[effects.tip_relief]
amount = 10.0
length = 0.8
[resolution]
gauss_points = 2
segments = 5
"""
BENDING = '[effects.tooth_bending]\nbasis = "paper"\n'
ERRORS = '[effects.manufacturing_errors]\npreset = "garambois2017"\n'


@dataclass(frozen=True, kw_only=True)
class Attack:
    """A command line, and the files that it may write."""

    arguments: tuple[object, ...]
    targets: tuple[str, ...] = ()


@cache
def scene_tables() -> tuple[dict[str, Any], ...]:
    texts = [PAIR + BENDING, PAIR + ERRORS, PAIR + BENDING + ERRORS]
    shafts = (ROOT / "examples" / "shafts.toml").read_text(encoding="utf-8")
    fast = (
        shafts.replace('model = "solid"\n[effects.gear_body]', 'basis = "paper"')
        + "[resolution]\ngauss_points = 2\nsegments = 5\n"
    )
    return tuple(tomllib.loads(text) for text in (*texts, fast))


@cache
def known_tables() -> Mapping[str, Any]:
    """An example of each effect, and of what else a scene may hold."""
    found: dict[str, Any] = {f"effects.{name}": dict(effect_class(name).example) for name in EFFECTS}
    found["pair.material"] = {"youngs_modulus": 210.0, "poisson_ratio": 0.3}
    found["pair.pinion.profile_shift"] = 0.2
    found["pair.wheel.bore_diameter"] = 30.0
    found["resolution.positions"] = 16
    return found


def text_of(rng: Generator, given: Mapping[str, Any], known: Mapping[str, Any]) -> bytes:
    """TOML of changed tables, its bytes changed now and then."""
    try:
        whole = tomli_w.dumps(hostile.tables(rng, given, known)).encode("utf-8", "surrogatepass")
    except (TypeError, ValueError):  # what TOML cannot say
        whole = tomli_w.dumps(given).encode()
    return hostile.data(rng, whole) if rng.random() < 0.15 else whole


def scene(rng: Generator, folder: Path) -> Attack:
    """A mutated scene."""
    given = scene_tables()[rng.integers(4)]
    (folder / "scene.toml").write_bytes(text_of(rng, given, known_tables()))
    kind = rng.random()
    if kind < 0.65:
        return Attack(arguments=("simulate", "scene.toml", "-o", "out.nc"), targets=("out.nc",))
    if kind < 0.85:
        return Attack(arguments=("robust", "scene.toml", "--samples", 4, "-o", "out.nc"), targets=("out.nc",))
    if kind < 0.9:
        return Attack(arguments=("sweep", "scene.toml", "--torque", "20:100:3", "-o", "out.nc"), targets=("out.nc",))
    if kind < 0.95:
        return Attack(arguments=("simulate", "scene.toml", "--json"))
    return Attack(arguments=("plan", "scene.toml"))


@cache
def study_tables() -> dict[str, Any]:
    given = tomllib.loads((ROOT / "examples" / "optimise_small.toml").read_text(encoding="utf-8"))
    given["algorithm"] = {"population": 4, "generations": 1, "seed": 1}
    given["robustness"] = {"samples": 2}
    given["base"]["resolution"] = {"gauss_points": 2, "segments": 4}
    del given["variables"]["effects"]["crowning"]
    return given


def study(rng: Generator, folder: Path) -> Attack:
    """A mutated study."""
    known = {f"base.{name}": table for name, table in known_tables().items()}
    known["variables.extra"] = {"paths": ["pair.helix_angle", "load.torque"], "min": 1.0, "max": 2.0}
    known["constraints.root_stress"] = {"max": 400.0}
    (folder / "study.toml").write_bytes(_short(text_of(rng, study_tables(), known)))
    return Attack(arguments=("optimise", "study.toml", "-o", "front"), targets=("front",))


def _short(study: bytes) -> bytes:
    """A study with two generations of few designs and samples where it would have more: they are long, but no hang."""
    long, few = False, {"algorithm": {"generations": 2, "population": 4}, "robustness": {"samples": 2}}
    try:
        tables = tomllib.loads(study.decode())
        for name, most in few.items():
            given = tables.setdefault(name, {})
            for key, count in most.items():
                if count < given.get(key, 200) <= 1_000_000:
                    given[key], long = count, True
        return tomli_w.dumps(tables).encode() if long else study
    except Exception:  # it is no study
        pass
    return study


@cache
def models() -> tuple[bytes, ...]:
    names = ("sew_3_stage_cylindrical_gearbox_1.0.rexs", "stage_1.6.rexs")
    return tuple((DATA / name).read_bytes() for name in names)


def rexs(rng: Generator, folder: Path) -> Attack:
    """A mutated REXS file, plain or packed."""
    number = int(rng.integers(2))
    whole = hostile.xml(rng, models()[number]) if rng.random() < 0.7 else hostile.data(rng, models()[number])
    name = "model.rexs"
    if rng.random() < 0.4:
        name, buffer = "model.rexsz", io.BytesIO()
        packing = (zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2, zipfile.ZIP_STORED)[rng.integers(4)]
        with zipfile.ZipFile(buffer, "w", packing) as archive:
            archive.writestr("model.rexs", whole)
        whole = hostile.data(rng, buffer.getvalue()) if rng.random() < 0.8 else buffer.getvalue()
    (folder / name).write_bytes(whole)
    stage = ("1", "2", "id:37", "1")[rng.integers(4)] if number == 0 else "1"
    if rng.random() < 0.5:
        return Attack(arguments=("rexs", name))
    arguments = ("rexs", name, "--scene", stage, "out.toml", "--torque", "50")
    return Attack(arguments=arguments, targets=("out.toml",))


@cache
def grids() -> tuple[bytes, bytes]:
    """A topography that suits the pair, as CSV and as netCDF."""
    import xarray as xr

    radius, face = np.linspace(24, 28.6, 6), np.linspace(-10, 10, 5)
    deviation = np.add.outer((radius - 26) ** 2, 0.02 * face**2)
    rows = [["radius", *map(str, face)], *([str(r), *map(str, row)] for r, row in zip(radius, deviation, strict=True))]
    csv = "\n".join(map(",".join, rows)).encode()
    coords = {"radius": ("radius", radius, {"units": "mm"}), "face_position": ("face_position", face, {"units": "mm"})}
    data = {"deviation": (("radius", "face_position"), deviation, {"units": "µm"})}
    return csv, netcdf.written(xr.Dataset(data, coords))


def topography(rng: Generator, folder: Path) -> Attack:
    """A scene with a mutated grid of a flank."""
    csv, whole = grids()
    if rng.random() < 0.4:
        name, found = "grid.csv", hostile.csv(rng, csv)
    else:
        name, found = "grid.nc", netcdf.damaged(rng, whole)
    (folder / name).write_bytes(found)
    text = f'{PAIR}[effects.topography]\npinion = "{name}"\n'
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return Attack(arguments=("simulate", "scene.toml", "-o", "out.nc"), targets=("out.nc",))


KINDS: dict[str, Callable[[Generator, Path], Attack]] = {
    "scene": scene, "study": study, "rexs": rexs, "topography": topography,
}  # fmt: skip
