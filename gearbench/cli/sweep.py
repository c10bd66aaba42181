"""``gearbench sweep``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.options import Output, Plots, SceneFile, Threads, plot_folder, saved
from gearbench.cli.output import answer, progress_line
from gearbench.errors import naming
from gearbench.lazy import xr

if TYPE_CHECKING:
    from gearbench.scene import Scene

Torques = Annotated[
    str | None,
    typer.Option(
        "--torque", metavar="RANGE", help="Torques on the pinion [N·m]: FIRST:LAST:STEP (without 0), or A,B,C."
    ),
]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=RANGE", help="Another key of the scene; repeatable."),
]
Samples = Annotated[int, typer.Option(min=0, help="Error samples at every point; 0: the scene itself.")]
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
) -> None:
    """Transmission error, stiffness and mesh orders of SCENE over ranges of the torque and other keys.

    Example: gearbench sweep examples/case2.toml --torque 20:300:20 -o case2_loads.nc --plots plots

    Two keys: gearbench sweep SCENE --torque 50,100 --set effects.crowning.amount=0:8:2 -o grid.nc

    Completed points are saved to OUT.nc from time to time.
    """
    from gearbench.cli.summary import warnings
    from gearbench.scene_file import read_scene
    from gearbench.sweeps.ranges import parse_range, parse_setting
    from gearbench.sweeps.run import sweep as run

    loaded = read_scene(scene)
    ranges = {} if torque is None else {"torque": parse_range("torque", torque)}
    ranges |= dict(map(parse_setting, set_ or ()))
    folder = plot_folder(plots)
    with progress_line() as tell, naming(scene), _keeping(output) as keep:
        options = {"samples": samples, "seed": seed, "threads": threads, "keep": keep}
        dataset = run(loaded, ranges, progress=lambda done, of: tell(f"{done} of {of} points"), **options)
    written = saved(dataset, output)
    if folder is not None and "torque" in dataset.dims and not samples:
        from gearbench.sweeps.figures import draw_sweep

        written += draw_sweep(dataset, folder)
    # the swept keys are the first dimensions, in their order
    sizes = dict(zip(dataset.attrs["swept"], dataset["transmission_error_mean"].shape, strict=False))
    head = {"scene_sha256": loaded.digest, "wall_time_s": dataset.attrs["wall_time_s"], "points": sizes}
    data = {**head, "complete": bool(dataset.attrs["complete"]), "files": written}
    answer(data, warnings(dataset), lambda: _print(loaded, dataset))
    if not dataset.attrs["complete"]:
        print("gearbench: interrupted; completed points are saved, the others are NaN", file=sys.stderr)
        raise typer.Exit(130)


def _print(scene: Scene, dataset: xr.Dataset) -> None:
    """Print one line per point, and the values over several loads."""
    from gearbench.cli.summary import print_points, print_table, result_rows

    print_points(scene, dataset)
    if rows := result_rows(dataset):
        print_table("over the loads", rows)


@contextmanager
def _keeping(output: Path | None) -> Iterator[Callable[[xr.Dataset], object] | None]:
    """Context with a function that saves completed points in ``output``; if the sweep fails, a message says so."""
    from gearbench.results.netcdf import save

    kept: list[Path] = []
    try:
        yield None if output is None else lambda dataset: kept.append(save(dataset, output))
    except Exception:
        if kept:
            print(f"gearbench: {output} holds the points done before the fault; the others are NaN", file=sys.stderr)
        raise
