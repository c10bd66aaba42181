"""``gearbench simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.options import AccuracyText, Output, Plots, plot_folder, saved, to_file, with_accuracy
from gearbench.cli.output import answer
from gearbench.cli.rexs import AnyFile, LoadCase, StageName, Torque, load_any
from gearbench.lazy import xr

if TYPE_CHECKING:
    from gearbench.scene import Scene

Also = Annotated[
    list[str] | None,
    typer.Option("--also", metavar="NAME", help="Additional output, e.g. flank_pressure; repeatable."),
]
Report = Annotated[
    Path | None, to_file("FILE.html", "Write a report with drawing, data, curves, maps and warnings.", "--report")
]
Scale = Annotated[
    float | None,
    typer.Option("--scale", metavar="MPA", min=1e-3, help="Upper end of the colour scale of load maps [MPa]."),
]

#: Additional outputs in the summary; the root stress only for gears that a rack can cut.
SHOWN, ROOT_STRESS = ("flank_pressure_max", "face_load_factor"), "root_stress"


def simulate(
    scene: AnyFile,
    output: Output = None,
    plots: Plots = None,
    stage: StageName = None,
    torque: Torque = None,
    load_case: LoadCase = None,
    accuracy: AccuracyText = None,
    also: Also = None,
    scale: Scale = None,
    report: Report = None,
) -> None:
    """Static transmission error and mesh stiffness of SCENE over a mesh cycle.

    Example: gearbench simulate examples/case1.toml -o case1.nc --plots plots

    A stage of a REXS file: gearbench simulate gearbox.rexs --stage 2 -o stage2.nc
    """
    from gearbench.cli import summary
    from gearbench.geometry.blank import RACK
    from gearbench.results.origin import single_mesh
    from gearbench.results.outputs import DEFAULT_OUTPUTS
    from gearbench.simulation import simulate as run

    loaded, notes = load_any(scene, stage, torque, load_case)
    notes = (*notes, *_notes(loaded))
    if report is not None:
        loaded = loaded.single_load.one_pair
    folder = plot_folder(plots)
    by_rack = all(gear.blank == RACK for mesh in loaded.meshes.values() for gear in mesh.pair.gears)
    shown = (*SHOWN, ROOT_STRESS) if by_rack else SHOWN
    asked = tuple(dict.fromkeys((*DEFAULT_OUTPUTS, *(also or ()), *shown)))
    dataset = run(with_accuracy(loaded, accuracy), outputs=asked)
    each = {name: single_mesh(dataset, name) for name in loaded.meshes}
    cautions = summary.cautions(loaded, dataset)
    written = saved(dataset, output)
    if folder is not None:
        written += _draw(loaded, dataset, folder, scale)
    if report is not None:
        from gearbench.pair_report import write_pair_report

        tables = {"geometry": summary.geometry_rows(loaded), "over the mesh cycle": summary.result_rows(dataset)}
        written.append(write_pair_report(dataset, report, summary.pair_line(loaded), tables, cautions))
    more: dict[str, object] = {"files": written, "notes": [*cautions, *notes]}
    if loaded.train is not None:
        more["meshes"] = {name: summary.scalars(of_mesh) for name, of_mesh in each.items()}
    lines = [*summary.accuracy_line(dataset), *summary.warnings(dataset)]
    lines += [*(f"warning: {each}" for each in cautions), *(f"note: {note}" for note in notes)]
    answer(summary.as_json(loaded, dataset, **more), lines, lambda: _print(loaded, dataset))


def _draw(scene: Scene, dataset: xr.Dataset, folder: Path, scale: float | None) -> list[Path]:
    """Write the figures of a result; return their paths."""
    from gearbench.results.origin import single_mesh

    if scene.loads:
        from gearbench.sweeps.figures import draw_sweep

        return draw_sweep(dataset, folder)
    if scene.coupled:
        from gearbench.trains.figures import draw_train

        return draw_train(dataset, folder)
    from gearbench.plotting import draw_simulation

    written = []
    for name in scene.meshes:
        there = folder if scene.train is None else folder / name.replace(" ", "_")
        there.mkdir(exist_ok=True)
        written += draw_simulation(single_mesh(dataset, name), there, scale=scale)
    return written


def _notes(scene: Scene) -> list[str]:
    """Notes on the conventions and models behind the numbers."""
    lines = []
    if any(getattr(effect, "positive", "") == "missing" for effect in scene.effects):
        lines.append('topography: positive deviations are missing material; for excess: positive = "excess"')
    if scene.has_shafts:
        lines.append("transmission error and mesh stiffness include the deflections of shafts and bearings")
    short = scene.planetary
    if short is not None and short.keys.positions is None and short.spacing_error > 1e-9:
        teeth = f"teeth fit at {short.steps} angles, not a multiple of {short.keys.planets}"
        lines.append(f"planets are up to {short.spacing_error:.3g}° away from even spacing: {teeth}")
    return lines


def _print(scene: Scene, dataset: xr.Dataset) -> None:
    """Print geometry and results."""
    from gearbench.cli import summary

    for one in summary.kinds(scene).values():
        summary.print_geometry(one)
    if scene.loads or scene.train is not None:
        summary.print_points(scene, dataset)
    rows = summary.result_rows(dataset)
    worst = max(float(dataset[f"{kind}_residual"].max()) for kind in ("equilibrium", "complementarity"))
    rows += [
        ("worst residual of the contact solution", f"{worst:.1e}", "1"),
        ("computing time", *summary.duration(dataset.attrs["wall_time_s"]).split()),
    ]
    summary.print_table("over the loads" if scene.loads else "over the mesh cycle", rows)
