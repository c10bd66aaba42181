"""``gearbench simulate``."""

from __future__ import annotations

from gearbench.cli.options import Json, Output, Plots, Quiet, SceneFile, plot_folder


def simulate(
    scene: SceneFile, output: Output = None, plots: Plots = None, quiet: Quiet = False, json: Json = False
) -> None:
    """Static transmission error and mesh stiffness of SCENE over a mesh cycle.

    Example: gearbench simulate examples/case1.toml -o case1.nc --plots plots
    """
    from gearbench.cli import summary
    from gearbench.results import check_target, save
    from gearbench.scene_file import load_scene
    from gearbench.simulation import simulate as run

    loaded = load_scene(scene)
    if output is not None:
        check_target(output)
    folder = plot_folder(plots)
    dataset = run(loaded)
    written = [save(dataset, output)] if output is not None else []
    if folder is not None:
        from gearbench.plotting import draw_simulation

        written += draw_simulation(dataset, folder)
    if json:
        summary.print_json(loaded, dataset, files=[str(path) for path in written])
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
    for path in written:
        print(f"wrote {path}")
