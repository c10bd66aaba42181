"""``gearbench cost``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.options import SceneFile

if TYPE_CHECKING:
    import xarray as xr
    from rich.table import Table

Folder = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="DIR", help="Write cost.nc and plots into this folder.")
]
Repeats = Annotated[int, typer.Option(min=1, help="Timed runs of each setting; medians count.")]


def cost(scene: SceneFile, output: Folder = None, repeats: Repeats = 5) -> None:
    """What accuracy costs on SCENE: error and time of every level of every knob.

    Example: gearbench cost examples/sc.toml -o cost
    """
    from gearbench.cli.options import plot_folder
    from gearbench.cost.workprecision import work_precision
    from gearbench.results import save
    from gearbench.scene_file import load_scene

    loaded = load_scene(scene)
    folder = plot_folder(output)
    dataset = work_precision(loaded, repeats)

    from rich.console import Console

    from gearbench.cli.summary import pair_line

    # no narrower than the table, so that nothing of it is cut where the output is no terminal
    console = Console(soft_wrap=True, width=max(110, Console().width))
    console.print(_table(pair_line(loaded), dataset))
    console.print("error: the largest of mean STE, RMS STE, mean k, RMS k, relative; ±: of its reference")
    console.print("order: of each of the four, – where errors are not clear of their reference")
    console.print("time, memory: of a run with the other knobs as in the scene; medians")
    if folder is not None:
        from gearbench.cost.figures import draw_cost

        for path in [save(dataset, folder / "cost.nc"), *draw_cost(dataset, folder)]:
            print(f"wrote {path}")


def _table(title: str, dataset: xr.Dataset) -> Table:
    """One row a level, and after each knob the orders observed."""
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    for name in ("knob", "level", "error", "±", "time", "memory", "order observed"):
        table.add_column(name, justify="left" if name[0] in "ko" else "right", no_wrap=True)
    for knob in dataset["knob"].values:
        rows = dataset.isel(setting=dataset["setting_knob"].values == knob)
        order = ", ".join(f"{p:.1f}" if p == p else "–" for p in rows["observed_order"].sel(knob=knob).values)
        for i in range(rows.sizes["setting"]):
            row = rows.isel(setting=i)
            worst = int(row["error"].values.argmax())
            table.add_row(
                str(knob) if i == 0 else "",
                str(row["level"].values),
                f"{float(row['error'][worst]):.1e}",
                f"{float(row['error_bar'][worst]):.0e}",
                f"{1e3 * float(row['seconds']):.2f} ms",
                f"{float(row['megabytes']):.2f} MB",
                order if i == 0 else "",
            )
    return table
