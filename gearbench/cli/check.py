"""``gearbench check``."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.options import Json, Quiet, Verbose, say

if TYPE_CHECKING:
    import xarray as xr

Files = Annotated[
    list[Path], typer.Argument(metavar="FILE...", help="Files, or folders of optimisations.", show_default=False)
]


def check(files: Files, quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Tell what each FILE is and whether it is intact: results by their digest, inputs by reading them.

    Exit code 2 if a file is damaged or unknown.

    Example: gearbench check front case1.nc gearbox.rexs
    """
    from gearbench.cli.summary import print_mapping
    from gearbench.errors import InputError, plain

    rows, faults = [], []
    for file in files:
        try:
            rows.append({"file": str(file), "whole": True, "is": describe(file)})
        except InputError as error:
            faults.append(str(error))
            rows.append({"file": str(file), "whole": False, "is": str(error)})
    if json:
        print_mapping({"files": rows})
    elif not quiet:
        for row in rows:
            if row["whole"]:
                say(plain(f"{row['file']}: whole, {row['is']}"))
    for fault in faults:
        print(f"gearbench: {fault}", file=sys.stderr)
    if faults:
        raise typer.Exit(2)


def describe(path: Path) -> str:
    """Describe kind and contents of a file.

    Raises
    ------
    InputError
        If the file is damaged, or gearbench does not read files of its kind.
    """
    from gearbench.errors import InputError, naming
    from gearbench.exchange import is_rexs
    from gearbench.files import is_sealed, read_bytes
    from gearbench.netcdf_bytes import is_netcdf
    from gearbench.results.netcdf import DIGEST

    if path.is_dir():
        return _folder(path)
    data = read_bytes(path)
    if is_netcdf(data):
        return _result(path) if is_sealed(data) or DIGEST.encode() in data else _grid(path, data)
    if is_rexs(path):
        return _rexs(path)
    readers: dict[str, Callable[[], str]] = {".toml": lambda: _tables(path), ".csv": lambda: _grid(path, data)}
    if (reader := readers.get(path.suffix.lower())) is None:
        raise InputError("", str(path), "is nothing that gearbench reads: TOML, REXS, netCDF or CSV")
    with naming(path):
        return reader()


def _folder(path: Path) -> str:
    """Describe the folder of an optimisation after checking all of its files."""
    from gearbench.errors import InputError
    from gearbench.optimisation.store import FRONT, STUDY
    from gearbench.optimisation.study_file import read_study

    if not (path / STUDY).exists():
        raise InputError("", str(path), f"holds no optimisation: there is no {STUDY}")
    study = read_study(path / STUDY)
    generations = sorted(path.glob("generation_*.nc"))
    for file in generations:
        _result(file)
    state = _result(path / FRONT) if (path / FRONT).exists() else "not finished"
    return f"optimisation of {study.name or 'a study'}, {len(generations)} generations, {state}"


def _result(path: Path) -> str:
    from gearbench.errors import InputError
    from gearbench.results.netcdf import open_result

    dataset = open_result(path)
    try:
        kind = _kind(dataset)
    except InputError as error:
        raise InputError("", str(path), error.allowed) from None
    made = ", ".join(str(dataset.attrs[key]) for key in ("created", "versions") if key in dataset.attrs)
    return f"{kind} ({made})" if made else kind


def _kind(dataset: xr.Dataset) -> str:
    """Describe the kind of a Dataset, from its attributes and dimensions."""
    from gearbench.optimisation.designs import Designs

    count = dict(dataset.sizes)
    if "study" in dataset.attrs and "on_front" in dataset:
        return f"result of {Designs(dataset).study.name or 'a study'}: {count['design']} designs"
    if "study" in dataset.attrs:
        return f"generation of {count.get('design', 0)} designs"
    for dimension, kind in (
        ("speed", "response over {} speeds"),
        ("sample", "robustness over {} samples"),
        ("setting", "cost of {} settings"),
        ("scene", "validation of {} scenes"),
        ("position", "mesh cycle of {} phases"),
    ):
        if dimension in count:
            return kind.format(count[dimension])
    return f"Dataset over {', '.join(map(str, count)) or 'nothing'}"


def _grid(path: Path, data: bytes) -> str:
    from gearbench.effects.flank_grid import read_grid
    from gearbench.errors import InputError

    try:
        grid = read_grid("", str(path), data)
    except InputError as error:
        none = "" if path.suffix.lower() == ".csv" else "carries no digest, so it is no whole result; as a flank: "
        raise InputError("", str(path), f"{none}{error.value}: {error.allowed}") from None
    return f"flank of {grid.deviation.shape[0]} by {grid.deviation.shape[1]} points over {grid.along}"


def _rexs(path: Path) -> str:
    from gearbench.exchange.rexs import stages
    from gearbench.exchange.rexs_document import read_document

    document = read_document(path)
    return f"REXS {document.version}, {len(document.components)} components, {len(stages(document))} stages"


def _tables(path: Path) -> str:
    from gearbench.cli.summary import pair_line
    from gearbench.optimisation.study_file import read_study
    from gearbench.scene_file import read_scene
    from gearbench.schema import read_toml

    if "objectives" in read_toml(path):
        study = read_study(path)
        return f"study {study.name}: {len(study.variables)} variables, {len(study.objectives)} objectives"
    return pair_line(read_scene(path))
