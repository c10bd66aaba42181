"""``gearbench cost``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gearbench.cli.options import SceneFile, plot_folder
from gearbench.cli.output import answer
from gearbench.cli.table import print_columns
from gearbench.lazy import xr

Folder = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="DIR", help="Write cost.nc and plots into this folder.")
]
Repeats = Annotated[int, typer.Option(min=1, help="Timed runs of each setting, for the median.")]


def cost(
    scene: SceneFile,
    output: Folder = None,
    repeats: Repeats = 5,
) -> None:
    """Measure error against time for every setting of SCENE.

    Example: gearbench cost examples/sc.toml -o cost
    """
    from gearbench.cli.summary import as_json, first_mesh, pair_line
    from gearbench.effort.workprecision import cost as run
    from gearbench.results.netcdf import save
    from gearbench.scene_file import read_scene

    loaded = read_scene(scene)
    folder = plot_folder(output)
    dataset = run(loaded, repeats)

    written: list[Path] = []
    if folder is not None:
        from gearbench.effort.figures import draw_cost

        written = [save(dataset, folder / "cost.nc"), *draw_cost(dataset, folder)]
    lines = (
        "error: largest relative error of mean and RMS of STE and k; ±: error of the reference",
        "order: convergence of each of the four; –: errors too close to that of the reference",
        "time, memory: median of runs with all other settings as in the scene",
    )
    lines += tuple(first_mesh(loaded))
    data = as_json(loaded, dataset, **_tables(dataset), files=written)
    answer(data, lines, lambda: _print_table(pair_line(loaded), dataset))


def _tables(dataset: xr.Dataset) -> dict[str, Any]:
    """Tables of the JSON object."""
    names = [str(name) for name in dataset["quantity"].values]
    rows = [
        {
            "knob": str(row["setting_knob"].item()),
            "level": str(row["level"].item()),
            "seconds": float(row["seconds"]),
            "megabytes": float(row["megabytes"]),
            **{key: dict(zip(names, row[key].values.tolist(), strict=True)) for key in ("error", "error_bar")},
        }
        for row in (dataset.isel(setting=i) for i in range(dataset.sizes["setting"]))
    ]
    orders = {
        str(orders["knob"].values): dict(zip(names, orders.values.tolist(), strict=True))
        for orders in dataset["observed_order"].transpose("knob", "quantity")
    }
    return {"observed_order": orders, "settings": rows}


def _print_table(title: str, dataset: xr.Dataset) -> None:
    """Print one row per level; the first row of a setting also has its observed orders."""
    names = ("setting", "level", "error", "±", "time", "memory", "order observed")
    table = []
    for setting in dataset["knob"].values:
        rows = dataset.isel(setting=dataset["setting_knob"].values == setting)
        order = ", ".join(f"{p:.1f}" if p == p else "–" for p in rows["observed_order"].sel(knob=setting).values)
        for i in range(rows.sizes["setting"]):
            row = rows.isel(setting=i)
            worst = int(row["error"].values.argmax())
            cells = (
                str(setting) if i == 0 else "",
                str(row["level"].values),
                f"{float(row['error'][worst]):.1e}",
                f"{float(row['error_bar'][worst]):.0e}",
                f"{1e3 * float(row['seconds']):.2f} ms",
                f"{float(row['megabytes']):.2f} MB",
                order if i == 0 else "",
            )
            table.append(cells)
    print_columns(title, names, table, left=(0, 1, len(names) - 1))
