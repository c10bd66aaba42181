"""``gearbench hunting``."""

from __future__ import annotations

from typing import Annotated

import typer

from gearbench.cli.options import Output, Plots, SceneFile, Threads, plot_folder, saved
from gearbench.cli.output import answer
from gearbench.lazy import xr

Orders = Annotated[float, typer.Option("--orders", metavar="N", min=0.01, max=100.0, help="Highest mesh order.")]
#: Number of lines in the table of the largest amplitudes.
SHOWN = 12
#: Amplitude relative to the largest at and below which an order is rounding: it cancels, or nothing excites it.
NEGLIGIBLE = 1e-9


def hunting(
    scene: SceneFile,
    output: Output = None,
    orders: Orders = 3.0,
    threads: Threads = None,
    plots: Plots = None,
) -> None:
    """Sidebands of pitch errors, run-out and waviness of SCENE, over all mesh cycles until the same teeth meet again.

    Example: gearbench hunting SCENE -o hunting.nc --plots plots
    """
    from gearbench.cli import summary
    from gearbench.hunting.figures import draw_side_bands
    from gearbench.hunting.run import hunting_cycle
    from gearbench.scene_file import read_scene
    from gearbench.threads import default_threads

    loaded = read_scene(scene)
    folder = plot_folder(plots)
    dataset = hunting_cycle(loaded, orders=orders, threads=threads or default_threads())
    written = saved(dataset, output)
    written += [] if folder is None else [draw_side_bands(dataset, folder)]
    cycles, largest_orders = dataset.sizes["cycle"], _largest(dataset)
    largest = [{"mesh_order": order, "amplitude": value} for order, value, _ in largest_orders]
    rows = [
        (f"order {n:.5g} of the mesh, {', '.join(gear_orders)}", f"{value:.4g}", "µm")
        for n, value, gear_orders in largest_orders
    ]
    answer(
        summary.as_json(loaded, dataset, cycles=cycles, largest=largest, files=written),
        summary.warnings(dataset),
        lambda: summary.print_table(f"{summary.pair_line(loaded)}, {cycles} mesh cycles", rows),
    )


def _largest(dataset: xr.Dataset) -> list[tuple[float, float, list[str]]]:
    """Largest amplitudes, sorted by frequency: mesh order, amplitude [µm], and orders of both gears as text."""
    import numpy as np

    from gearbench.hunting.figures import curve_of, orders_of_gears

    order, value = (dataset[name].values for name in ("mesh_order", f"{curve_of(dataset)}_order_amplitude"))
    largest, gears = np.argsort(-value, kind="stable")[:SHOWN], orders_of_gears(dataset)
    largest = np.sort(largest[value[largest] > NEGLIGIBLE * value.max()])
    gear_orders = [[f"{orders[i]:.5g} of {name}" for name, orders in gears.items()] for i in largest]
    return list(zip(order[largest].tolist(), value[largest].tolist(), gear_orders, strict=True))
