"""``gearbench simulate``."""

from __future__ import annotations

from gearbench.cli.options import AccuracyText, Json, Output, Plots, Quiet, Verbose, plot_folder, say, with_accuracy
from gearbench.cli.rexs import AnyFile, LoadCase, StageName, Torque, load_any


def simulate(
    scene: AnyFile,
    output: Output = None,
    plots: Plots = None,
    stage: StageName = None,
    torque: Torque = None,
    load_case: LoadCase = None,
    accuracy: AccuracyText = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Static transmission error and mesh stiffness of SCENE over a mesh cycle.

    Example: gearbench simulate examples/case1.toml -o case1.nc --plots plots

    A stage of a REXS file: gearbench simulate gearbox.rexs --stage 2 -o stage2.nc
    """
    from gearbench.cli import summary
    from gearbench.contact.off_line import advice
    from gearbench.errors import naming
    from gearbench.files import check_target
    from gearbench.results.netcdf import save
    from gearbench.simulation import simulate as run

    loaded, notes = load_any(scene, stage, torque, load_case)
    if output is not None:
        check_target(output)
    folder = plot_folder(plots)
    with naming(scene):
        dataset = run(with_accuracy(loaded, accuracy))
    if (missed := advice(loaded, dataset)) is not None:
        dataset.attrs["off_line_contact"] = missed
        notes = (*notes, missed)
    written = [save(dataset, output)] if output is not None else []
    if folder is not None:
        from gearbench.plotting import draw_simulation

        written += draw_simulation(dataset, folder)
    if json:
        summary.print_json(loaded, dataset, files=[str(path) for path in written], notes=list(notes))
        return
    if quiet:
        return
    rows = summary.result_rows(dataset)
    worst = max(float(dataset[f"{kind}_residual"].max()) for kind in ("equilibrium", "complementarity"))
    rows += [
        ("worst residual of the contact solution", f"{worst:.1e}", "1"),
        ("computing time", f"{1e3 * dataset.attrs['wall_time_s']:.1f}", "ms"),
    ]
    summary.print_table(summary.pair_line(loaded), rows)
    if "accuracy_settings" in dataset.attrs:
        say(summary.accuracy_line(dataset))
    for line in (
        *summary.warnings(dataset),
        *(f"note: {note}" for note in notes),
        *(f"wrote {path}" for path in written),
    ):
        say(line)
