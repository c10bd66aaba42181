"""``gearbench robust``."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from gearbench.cli.options import AccuracyText, Output, Plots, SceneFile, Threads, plot_folder, saved, with_accuracy
from gearbench.cli.output import answer, progress_line
from gearbench.lazy import xr

Samples = Annotated[
    int | None, typer.Option(min=2, help="Number of error samples; by default 1000, or as --accuracy needs.")
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the samples.")]
SamplerName = Annotated[Literal["sobol", "random", "latin_hypercube"], typer.Option(help="Sampling method.")]

More = Annotated[list[str] | None, typer.Option("--response", metavar="NAME", help="Additional metric; repeatable.")]


def robust(
    scene: SceneFile,
    output: Output = None,
    samples: Samples = None,
    seed: Seed = 0,
    sampler: SamplerName = "sobol",
    threads: Threads = None,
    accuracy: AccuracyText = None,
    response: More = None,
    plots: Plots = None,
) -> None:
    """Scatter of SCENE under random manufacturing errors: RMS values, their statistics, and which error matters.

    Example: gearbench robust examples/gear55_robust.toml --samples 1000 -o robust.nc --plots plots
    """
    from gearbench.cli import summary
    from gearbench.robustness.montecarlo import SAMPLES
    from gearbench.robustness.run import robust as run
    from gearbench.robustness.tightening import tighten_first
    from gearbench.scene_file import read_scene

    loaded = with_accuracy(read_scene(scene), accuracy)
    folder = plot_folder(plots)
    count = samples or (None if loaded.resolution.accuracy is not None else SAMPLES)
    with progress_line() as tell:
        more: dict[str, Any] = {"sampler": sampler, "threads": threads, "responses": response or ()}
        advance = lambda done: tell(f"{done} of {count or 'some'} samples")  # noqa: E731
        dataset = run(loaded, samples=samples, seed=seed, progress=advance, **more)
    written = saved(dataset, output)
    done = dataset.sizes["sample"]
    if folder is not None and done > 1:
        from gearbench.plotting import draw_robust

        for part, target in _by_load(dataset, folder) if loaded.loads else [(dataset, folder)]:
            written += draw_robust(part, target)
    more = {"complete": bool(dataset.attrs["complete"]), "tighten_first": tighten_first(dataset)}
    lines = [*summary.accuracy_line(dataset), *filter(None, [more["tighten_first"]]), *summary.warnings(dataset)]
    lines += summary.first_mesh(loaded)

    def show() -> None:
        if loaded.loads:
            summary.print_points(loaded, dataset)
        summary.print_table(f"{summary.pair_line(loaded)}, {done} samples", summary.result_rows(dataset))

    answer(summary.as_json(loaded, dataset, samples=done, files=written, **more), lines, show)
    if not dataset.attrs["complete"]:
        print(f"gearbench: interrupted after {done} of {count or 'more'} samples; they are kept", file=sys.stderr)
        raise typer.Exit(130)


def _by_load(dataset: xr.Dataset, folder: Path) -> Iterator[tuple[xr.Dataset, Path]]:
    """Yield the Dataset of every load, and the folder of its plots."""
    for torque in dataset["torque"].values:
        load_folder = folder / f"{torque:g}_Nm"
        load_folder.mkdir(exist_ok=True)
        yield dataset.sel(torque=torque), load_folder
