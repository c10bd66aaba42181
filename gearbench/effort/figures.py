"""Work–precision diagrams: error against time, log–log, with the error bar of the reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearbench.lazy import Axes, xr
from gearbench.plotting import BLUE, GREEN, GREY, ORANGE, PURPLE, heading, new_figure, write_figure

#: Colour and marker of the settings, in the order of the dataset.
STYLES = tuple(zip((BLUE, ORANGE, GREEN, PURPLE, "#E69F00", "#56B4E9", GREY) * 2, "os^DvP*<>phdHX", strict=True))
#: Smaller errors, which are below rounding, are drawn at this value.
LEAST = 1e-14


def work_precision_diagram(dataset: xr.Dataset, axes: Axes, *, across: str = "processor_seconds") -> None:
    """Draw the largest error of the four numbers over ``across``, one curve per setting.

    The error bars are the uncertainty of the reference.
    """
    for (colour, marker), setting in zip(STYLES, dataset["knob"].values, strict=False):
        rows = dataset.isel(setting=dataset["setting_knob"].values == setting)
        worst = rows["error"].values.argmax(axis=1)
        picked = np.arange(len(worst)), worst
        error = np.maximum(rows["error"].values[picked], LEAST)
        bar = np.minimum(rows["error_bar"].values[picked], 0.9 * error), rows["error_bar"].values[picked]
        x = (1e3 if across.endswith("seconds") else 1) * rows[across].values
        style = {"color": colour, "marker": marker, "ms": 4.5, "lw": 1.3, "elinewidth": 0.7, "capsize": 2}
        axes.errorbar(x, error, bar, label=str(setting).replace("_", " "), **style)
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("processor time of a run [ms]" if across.endswith("seconds") else "largest memory [MB]")
    axes.grid(alpha=0.3)


def draw_cost(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """Write ``work_precision.png``: error over time, and over memory."""
    figure, ((left, right),) = new_figure(1, 2, (12, 5), sharey=True)
    work_precision_diagram(dataset, left)
    work_precision_diagram(dataset, right, across="megabytes")
    left.set_ylabel("largest relative error [–]")
    figure.suptitle(f"{heading(dataset)}\n{finding(dataset)}")
    right.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return [write_figure(figure, folder / "work_precision.png")]


def finding(dataset: xr.Dataset, error: float = 0.01) -> str:
    """Text that compares the times in which Gauss panels and uniform phases reach ``error``."""
    needed = {setting: cheapest(dataset, setting, error) for setting in ("gauss_points", "positions")}
    gauss, uniform = (f"{1e3 * t:.2g} ms" if t is not None else "no level" for t in needed.values())
    return f"{100 * error:g} % takes {gauss} with Gauss panels, {uniform} with uniform phases"


def cheapest(dataset: xr.Dataset, setting: str, error: float) -> float | None:
    """Processor time of the first level from which on the error stays within ``error`` [s]; None if there is none."""
    rows = dataset.isel(setting=dataset["setting_knob"].values == setting)
    above = np.flatnonzero(rows["error"].values.max(axis=1) > error)
    first = above[-1] + 1 if above.size else 0
    return float(rows["processor_seconds"].values[first]) if first < rows.sizes["setting"] else None
