"""Parallel coordinates of the design variables, drawn as an image because there are many thousand lines."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, CustomJSTransform, FixedTicker

from gearbench.explore.catalogue import Catalogue
from gearbench.explore.columns import Column
from gearbench.explore.look import PALETTE, PICK, chart, fixed

#: Pixels of the image between two axes, and in height.
GAP, HEIGHT = 44, 140
#: Title of the figure.
HINT = "Drag along an axis to keep a range, double-click it to clear"


def axes(catalogue: Catalogue) -> dict[int, Column]:
    """Index → column of each quantity with an axis: the variables, or the statistics if there are no variables."""
    return catalogue.of_kind("variable") or catalogue.of_kind("statistic")


def sources(catalogue: Catalogue) -> dict[str, ColumnDataSource]:
    """Sources: images of all designs and of the kept ones, line of the picked design, kept ranges on the axes."""
    count = max(len(axes(catalogue)), 2)
    blank = np.zeros((HEIGHT, GAP * (count - 1)), dtype="uint32")
    position = {"x": [0], "y": [0], "dw": [count - 1], "dh": [1]}
    return {
        "everything": ColumnDataSource({"image": [blank], **position}),
        "kept": ColumnDataSource({"image": [blank.copy()], **position}, name="parallel_image"),
        "line": ColumnDataSource({"x": [], "y": []}, name="parallel_line"),
        "ranges": ColumnDataSource({"x": [], "bottom": [], "top": []}),
    }


def parallel(catalogue: Catalogue, data: dict[str, ColumnDataSource]) -> Any:
    """Make the figure; ``data`` holds the ``sources``, whose images ``js/filter.js`` paints."""
    shown = list(axes(catalogue).values())
    count = max(len(shown), 2)
    plot = chart(HINT, "", "", height=490, x_range=fixed(-0.45, count - 0.55), y_range=fixed(-0.11, 1.11))
    plot.name = "parallel"
    plot.image_rgba("image", "x", "y", "dw", "dh", source=data["everything"])
    plot.image_rgba("image", "x", "y", "dw", "dh", source=data["kept"])
    positions = list(range(len(shown)))
    plot.segment(positions, [0] * len(shown), positions, [1] * len(shown), color="#444444", line_width=1.5)
    plot.quad(
        left=moved("x", -0.07),
        right=moved("x", 0.07),
        bottom="bottom",
        top="top",
        source=data["ranges"],
        fill_color=PALETTE[4],
        fill_alpha=0.45,
        line_color=PALETTE[1],
        level="overlay",
    )
    # the overlay level is a separate canvas, so that a pick does not redraw the image
    plot.line("x", "y", source=data["line"], color=PICK, line_width=2.5, level="overlay")
    for end, (height, baseline) in enumerate(((0.0, "top"), (1.0, "bottom"))):
        texts = [end_label(column, end) for column in shown]
        plot.text(
            positions, [height] * len(shown), text=texts,
            text_align="center", text_baseline=baseline, text_font_size="12px",
            y_offset=4 if end == 0 else -4,
        )  # fmt: skip
    plot.xaxis.ticker = FixedTicker(ticks=positions)
    plot.xaxis.major_label_overrides = {i: two_lines(column.title) for i, column in enumerate(shown)}
    plot.yaxis.visible = False
    plot.grid.visible = False
    return plot


def moved(name: str, offset: float) -> Any:
    """Reference to the column ``name`` whose values are shifted by ``offset``."""
    code = f"return xs.map((x) => x + ({offset}))"
    return {"field": name, "transform": CustomJSTransform(func=f"return x + ({offset})", v_func=code)}


def end_label(column: Column, end: int) -> str:
    """Label at the lower (0) or upper (1) end of an axis."""
    value = column.range[end]
    return column.categories[int(value)] if column.categories else f"{value:.4g}"


def two_lines(title: str) -> str:
    """Break a long title at the space nearest its middle."""
    spaces = [i for i, letter in enumerate(title) if letter == " "]
    if len(title) < 10 or not spaces:
        return title
    middle = min(spaces, key=lambda i: abs(i - len(title) / 2))
    return f"{title[:middle]}\n{title[middle + 1 :]}"
