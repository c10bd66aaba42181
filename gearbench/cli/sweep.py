"""``gearbench sweep``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.options import (
    Json,
    Memory,
    Output,
    Plots,
    Quiet,
    SceneFile,
    Threads,
    Verbose,
    plot_folder,
    say,
    shows_progress,
)

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.scene import Scene

Torques = Annotated[
    str | None,
    typer.Option("--torque", metavar="RANGE", help="Torques on the pinion [N·m]: FIRST:LAST:STEP or A,B,C."),
]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=RANGE", help="Another key of the scene; give it again for more."),
]
Samples = Annotated[int, typer.Option(min=0, help="Error samples at every point; 0: the scene as it is.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the samples.")]


def sweep(
    scene: SceneFile,
    torque: Torques = None,
    set_: Sets = None,
    output: Output = None,
    samples: Samples = 0,
    seed: Seed = 0,
    threads: Threads = None,
    plots: Plots = None,
    memory: Memory = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """SCENE over ranges of its keys, the torque above all: transmission error, stiffness, orders at every point.

    Example: gearbench sweep examples/case2.toml --torque 20:300:20 -o case2_loads.nc --plots plots

    Two keys: gearbench sweep SCENE --torque 50,100 --set effects.crowning.amount=0:8:2 -o grid.nc
    """
    from gearbench.errors import naming
    from gearbench.files import check_target
    from gearbench.results.netcdf import save
    from gearbench.scene_file import load_scene
    from gearbench.sweeps.ranges import parse_range, parse_setting
    from gearbench.sweeps.run import sweep as run

    loaded = load_scene(scene)
    ranges = {} if torque is None else {"torque": parse_range("torque", torque)}
    ranges |= dict(map(parse_setting, set_ or ()))
    if output is not None:
        check_target(output)
    folder = plot_folder(plots)
    with _progress(shown=shows_progress(quiet=quiet, json=json)) as advance, naming(scene):
        dataset = run(loaded, ranges, samples=samples, seed=seed, threads=threads, progress=advance)
    written = [save(dataset, output)] if output is not None else []
    if folder is not None and "torque" in dataset.dims and not samples:
        from gearbench.sweeps.figures import draw_sweep

        written += draw_sweep(dataset, folder)
    if json:
        from gearbench.cli.summary import print_mapping

        sizes = {path: dataset.sizes[name] for path, name in zip(dataset.attrs["swept"], ranges, strict=True)}
        files = [str(path) for path in written]
        head = {"scene_sha256": loaded.digest, "wall_time_s": dataset.attrs["wall_time_s"]}
        print_mapping({**head, "points": sizes, "complete": bool(dataset.attrs["complete"]), "files": files})
    elif not quiet:
        from gearbench.cli.summary import warnings

        _print(loaded, dataset, list(ranges))
        for line in (*warnings(dataset), *(f"wrote {path}" for path in written)):
            say(line)
    if not dataset.attrs["complete"]:
        print("gearbench: interrupted; what is done is kept, the rest is NaN", file=sys.stderr)
        raise typer.Exit(130)


def _print(scene: Scene, dataset: xr.Dataset, names: list[str]) -> None:
    """One line a point: peak-to-peak and RMS values."""
    from rich.table import Table

    from gearbench.cli.summary import console, pair_line

    shown = [f"{name}_{suffix}" for name in ("transmission_error_rms", "mesh_stiffness_rms") for suffix in ("mean", "")]
    shown = ["transmission_error_mean", "transmission_error_peak_to_peak", *shown, "mesh_stiffness_mean"]
    shown = [name.removesuffix("_") for name in shown]
    shown = [name for name in shown if name in dataset and set(dataset[name].dims) == set(names)]
    table = Table(title=pair_line(scene), title_justify="left", title_style="bold", box=None, pad_edge=False)
    for name in (*names, *shown):
        unit = dataset[name].attrs["units"].replace("1", "–")
        table.add_column(f"{dataset[name].attrs.get('symbol', name)}\n{unit}", justify="right")
    rows = dataset[[*shown]].to_dataframe().reset_index()
    for row in rows[[*names, *shown]].itertuples(index=False):
        table.add_row(*(f"{value:.5g}" for value in row))
    console().print(table)


@contextmanager
def _progress(*, shown: bool) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on a terminal."""
    if not shown:
        yield lambda done, of: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("points", total=None)
        yield lambda done, of: bar.update(task, completed=done, total=of)
