"""Figures of hunting cycles: amplitudes over mesh orders with their sidebands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.names import GEARS
from gearbench.lazy import Axes, xr
from gearbench.plotting import BLUE, GREEN, GREY, ORANGE, PURPLE, heading, legend_below, new_figure, write_figure

#: Decades that a figure shows below the largest amplitude.
DECADES = 4
#: Amplitude relative to the mean below which nothing is shown.
ROUNDING = 1e-9


def curve_of(dataset: xr.Dataset) -> str:
    """Name of the transmission error in the Dataset of a hunting cycle: that of a pair or of a train."""
    return "transmission_error" if "transmission_error" in dataset else "train_transmission_error"


def orders_of_gears(dataset: xr.Dataset) -> dict[str, NDArray]:
    """Orders of the spectrum as orders of the rotation of a shaft, by its name; shafts of equal speed appear once."""
    if "member_order" not in dataset.coords:
        return {f"the {name}": dataset[f"{name}_order"].values for name in GEARS}
    orders: dict[str, NDArray] = {}
    for name, order in zip(dataset["member"].values.tolist(), dataset["member_order"].values, strict=True):
        if not any(np.allclose(order, known) for known in orders.values()):
            orders[name] = order
    return orders


def side_bands(dataset: xr.Dataset, axes: Axes, name: str | None = None) -> Axes:
    """Draw the amplitudes of a curve over mesh orders, coloured by origin: mesh, one shaft, or neither.

    The curve is the transmission error unless ``name`` is given, e.g. "passing_force".
    """
    name = name or curve_of(dataset)
    order, values = dataset["mesh_order"].values, dataset[f"{name}_order_amplitude"]
    amplitude = values.values
    # amplitudes that are tiny relative to the mean are rounding errors
    floor = max(10.0**-DECADES * np.nanmax(amplitude), ROUNDING * float(np.abs(dataset[name]).mean()))
    gears = orders_of_gears(dataset)
    colours = dict(zip(gears, (ORANGE, GREEN, PURPLE, *(f"C{n}" for n in range(4, 10))), strict=False))
    unassigned = np.ones(len(order), dtype=bool)
    for label, gear_order, colour in (
        ("mesh orders", order, BLUE),
        *((f"orders of {gear}", gear_order, colours.get(gear, GREY)) for gear, gear_order in gears.items()),
        ("of no single gear" if len(gears) > 2 else "both gears", None, GREY),
    ):
        is_whole = True if gear_order is None else np.isclose(gear_order, np.round(gear_order), rtol=0, atol=1e-6)
        belongs = unassigned & is_whole
        unassigned, is_shown = unassigned & ~belongs, belongs & (amplitude > floor)
        if is_shown.any():
            axes.vlines(
                order[is_shown], floor, amplitude[is_shown], color=colour, lw=2.0 if gear_order is order else 1.0
            )
            axes.plot([], [], color=colour, label=label)
    label = f"amplitude of {dataset[name].attrs['symbol'].removesuffix('_p')} [{dataset[name].attrs['units']}]"
    axes.set(xlabel="mesh order", ylabel=label, yscale="log", xlim=(0, order[-1] * 1.02))
    axes.set_ylim(floor, max(2 * np.nanmax(amplitude), 10 * floor))
    return axes


def draw_side_bands(dataset: xr.Dataset, folder: Path) -> Path:
    """Write the figure of the sidebands of a hunting cycle; for a planetary set also of the passing force."""
    passing = "passing_force" in dataset
    figure, rows = new_figure(1 + passing, 1, (9.0, 4.8 + 3.2 * passing))
    first = side_bands(dataset, rows[0][0])
    first.set_title(f"{heading(dataset)}: {dataset.sizes['cycle']} mesh cycles until the same teeth meet again")
    if passing:
        side_bands(dataset, rows[1][0], "passing_force").set_title(
            "force of the planets as they pass a place of the ring"
        )
    legend_below(figure, first, 4, *(row[0] for row in rows[1:]))
    return write_figure(figure, folder / "side_bands.png")
