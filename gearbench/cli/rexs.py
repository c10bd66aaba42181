"""``gearbench rexs``, and scenes from TOML or REXS files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.cli.output import answer
from gearbench.cli.table import print_columns
from gearbench.errors import InputError

if TYPE_CHECKING:
    from gearbench.exchange.rexs import Stage
    from gearbench.exchange.rexs_document import RexsDocument
    from gearbench.scene import Scene

AnyFile = Annotated[
    Path, typer.Argument(metavar="SCENE", help="Scene file (TOML), or a REXS file.", show_default=False)
]
RexsFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="REXS file (.rexs, .rexsj, .rexsz).", show_default=False)
]
StageName = Annotated[
    str | None, typer.Option("--stage", metavar="N", help="Stage of a REXS file: number in the list, or id.")
]
Torque = Annotated[
    float | None,
    typer.Option(metavar="T", help="Torque on the pinion or driving gear [N·m], instead of that in the file."),
]
LoadCase = Annotated[int | None, typer.Option(metavar="N", help="Load case of a REXS file; by default the first.")]
SceneOut = Annotated[
    tuple[str, Path] | None,
    typer.Option("--scene", metavar="N OUT.toml", help="Write stage N, on its shafts and bearings, as a scene file."),
]
Written = Annotated[
    tuple[Path, Path] | None,
    typer.Option("--write", metavar="RESULT.nc OUT.rexs", help="Write a copy of FILE with the results of --stage N."),
]

To = Annotated[
    Path | None,
    typer.Option("--to", metavar="OUT.rexs", help="Write the pair or planetary set of scene file FILE as REXS."),
]


def load_any(
    path: Path, stage: str | None = None, torque: float | None = None, load_case: int | None = None
) -> tuple[Scene, tuple[str, ...]]:
    """Read the scene of a TOML file or of a stage of a REXS file, and notes on assumed values.

    Raises
    ------
    InputError
        If there is no such scene, or an option for REXS files is given with a TOML file.
    """
    from gearbench.exchange import is_rexs

    if is_rexs(path):
        from gearbench.exchange.rexs import find_stage, scene_of, stage_scene
        from gearbench.exchange.rexs_document import read_document

        document = read_document(path)
        chosen = find_stage(document, stage)
        stage_data = stage_scene(document, chosen, torque=torque, load_case=load_case)
        by_id = (f"{stage} is the id of stage {chosen.number}",) if stage not in (None, str(chosen.number)) else ()
        return scene_of(document, stage_data), (*by_id, *stage_data.notes)
    from gearbench.scene_file import read_scene

    for name, value in (("stage", stage), ("load-case", load_case)):
        if value is not None:
            raise InputError(f"--{name}", value, "is for REXS files only", str(path))
    loaded = read_scene(path)
    return (loaded if torque is None else with_torque(loaded, torque)), ()


def with_torque(scene: Scene, torque: float) -> Scene:
    """Return ``scene`` with the torque of the command line."""
    from gearbench.scene import Load
    from gearbench.schema import changed, make

    try:
        return changed(scene, load=make(Load, torque=torque))
    except InputError as error:
        raise InputError("--torque", torque, error.allowed) from None


def rexs(
    file: RexsFile,
    scene: SceneOut = None,
    stage: StageName = None,
    write: Written = None,
    to: To = None,
    torque: Torque = None,
    load_case: LoadCase = None,
) -> None:
    """List the stages of a REXS FILE, write one as a scene file, or write results back into a copy.

    Example: gearbench rexs gearbox.rexs, then gearbench simulate gearbox.rexs --stage 2 -o stage2.nc
    """
    from gearbench.exchange.rexs_document import read_document

    if to is not None:
        from gearbench.exchange.rexs_write import write_rexs
        from gearbench.scene_file import read_scene

        written, notes = write_rexs(read_scene(file), to)
        _answer(file, [written], notes)
        return
    document = read_document(file)
    notes = ()
    files: list[Path] = []
    if scene is not None:
        files, notes = _write_scene(document, *scene, torque, load_case)
    if write is not None:
        from gearbench.exchange.rexs import find_stage
        from gearbench.exchange.rexs_results import write_results
        from gearbench.results.netcdf import open_result

        files.append(write_results(document, find_stage(document, stage), open_result(write[0]), write[1]))
    if not files:
        _list(document, torque, load_case)
    else:
        _answer(document.path, files, notes)


def _answer(file: Path, files: list[Path], notes: tuple[str, ...]) -> None:
    """Print the files written from ``file``, and notes."""
    answer({"file": file, "notes": notes, "files": files}, [f"note: {note}" for note in notes])


def _write_scene(
    document: RexsDocument, stage: str, target: Path, torque: float | None, load_case: int | None
) -> tuple[list[Path], tuple[str, ...]]:
    """Write the scene of a stage, with shafts and further stages if they can be read; return the files, and notes."""
    from gearbench.exchange.rexs import find_stage, scene_of, stage_scene
    from gearbench.exchange.rexs_system import system_scene
    from gearbench.files import check_target, write_text

    check_target(target)
    try:
        scene, notes = system_scene(document, stage, torque=torque, load_case=load_case)
    except InputError as error:
        stage_data = stage_scene(document, find_stage(document, stage), torque=torque, load_case=load_case)
        scene = scene_of(document, stage_data)
        notes = (*stage_data.notes, f"without shafts and bearings: {error.key} = {error.value}: {error.allowed}")
    files = {target: scene}
    if (system := scene.system) is not None:
        paths = [target.with_name(f"{target.stem}_{mesh.name.replace(' ', '_')}.toml") for mesh in system.meshes]
        meshes = tuple(replace(mesh, scene=path.name) for mesh, path in zip(system.meshes, paths, strict=True))
        files = {target: replace(scene, system=replace(system, meshes=meshes))}
        files |= dict(zip(paths, scene.further, strict=True))
    remarks = "".join(f"# {note}\n" for note in notes)
    for path, written in files.items():
        head = remarks if path == target else ""
        write_text(path, f"# from {document.path.name}, REXS {document.version}\n{head}{written.to_toml()}")
    return list(files), notes


def _list(document: RexsDocument, torque: float | None, load_case: int | None) -> None:
    from gearbench.exchange.rexs import stages

    rows = [_row(document, stage, torque, load_case) for stage in stages(document)]
    cells = [[_shown(row.get(name)) for name in _COLUMNS] for row in rows]
    title = f"{document.path.name}, REXS {document.version}"
    answer(
        {"file": document.path, "version": document.version, "stages": rows},
        [f"stage {row['stage']}: {note}" for row in rows for note in row["notes"]],
        lambda: print_columns(title, [*_COLUMNS.values()], cells, left=(2,)),
    )


#: Column of the list of stages → its heading.
_COLUMNS = {
    "stage": "stage",
    "id": "id",
    "name": "name",
    "teeth": "z",
    "module": "m_n mm",
    "helix": "β °",
    "face_width": "b mm",
    "distance": "a′ mm",
    "torque": "T N·m",
    "ε_α": "ε_α",
    "ε_β": "ε_β",
}


def _shown(value: object) -> str:
    return "–" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def _row(document: RexsDocument, stage: Stage, torque: float | None, load_case: int | None) -> dict[str, Any]:
    """Row of a stage in the list; its notes say why the stage cannot be simulated."""
    from gearbench.exchange.rexs import pair_of, stage_scene

    row = {"stage": stage.number, "id": stage.component.id, "name": stage.component.name, "notes": []}
    try:
        stage_data = stage_scene(document, stage, torque=torque, load_case=load_case)
        pair = pair_of(document, stage_data)
    except InputError as error:
        return row | {"notes": [str(error)]}
    table = stage_data.tables.get("planetary") or stage_data.tables["pair"]
    gears = [table[name] for name in ("pinion", "wheel", "sun", "planet", "ring") if name in table]
    return row | {
        "teeth": "/".join(str(gear["teeth"]) for gear in gears),
        "module": pair.normal_module,
        "helix": pair.helix_angle,
        "face_width": pair.meshing.face_width,
        "distance": pair.centre_distance,
        "torque": stage_data.tables.get("load", {}).get("torque"),
        "ε_α": pair.meshing.transverse_contact_ratio,
        "ε_β": pair.meshing.overlap_ratio,
        "notes": list(stage_data.notes),
    }
