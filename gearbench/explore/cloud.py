"""Plot of all designs and the fronts over two quantities that the user chooses.

The first choice is the RMS of the transmission error over the RMS of the mesh stiffness.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from bokeh.models import ColorBar, ColumnDataSource, HoverTool, Legend, LegendItem, LinearColorMapper
from numpy.typing import NDArray

from gearbench.explore.catalogue import ACROSS, SCATTER_ACROSS, SCATTER_UP, UP, Catalogue, fronts
from gearbench.explore.columns import Column
from gearbench.explore.look import INK, PICK, chart, colour, fixed, spaced

#: Bokeh sources by name. In "designs", the columns of the catalogue have the keys c0, c1, …
Sources = dict[str, ColumnDataSource]
#: Maximum number of ±σ boxes drawn: more would hide their neighbours on the front.
BOXES = 24
#: Pixels of the image of all designs, vertically and horizontally.
PIXELS = (404, 560)


def sources(catalogue: Catalogue) -> Sources:
    """Sources of the designs, of their image and of the fronts; 4-byte numbers are precise enough to draw."""
    x, y = catalogue.column(ACROSS).values, catalogue.column(UP).values
    data = {"x": x, "y": y, "result": catalogue.result, "number": catalogue.number}
    for i, column in enumerate(catalogue.columns):
        data[f"c{i}"] = column.values
    single_precision: dict[str, Any] = {
        k: v.astype("int32" if v.dtype.kind == "i" else "float32") for k, v in data.items()
    }
    blank = np.zeros(PIXELS, dtype="uint32")
    return {
        "designs": ColumnDataSource(single_precision, name="designs"),
        "raster": ColumnDataSource({"image": [blank], "x": [0], "y": [0], "dw": [1], "dh": [1]}, name="raster"),
        "front": ColumnDataSource(front_data(catalogue, fronts(catalogue)), name="front"),
    }


def front_data(catalogue: Catalogue, designs: NDArray) -> dict[str, Any]:
    """Columns of the fronts: values, σ, width and height of the ±σ boxes (0 if not drawn), results, numbers, colours.

    ``designs`` are the indices of the designs on the fronts in the catalogue, (design,). A result is given by its index
    in ``Catalogue.results``.
    """
    box_step = max(1, math.ceil(len(designs) / BOXES))
    drawn, labelled = (np.arange(len(designs)) % step == 0 for step in (box_step, 3 * box_step))
    x, y, sx, sy = (catalogue.column(n).values[designs] for n in (ACROSS, UP, SCATTER_ACROSS, SCATTER_UP))
    return {
        "x": x,
        "y": y,
        "sx": sx,
        "sy": sy,
        "w": np.where(drawn, 2 * np.nan_to_num(sx), 0.0),
        "h": np.where(drawn, 2 * np.nan_to_num(sy), 0.0),
        "result": catalogue.result[designs],
        "number": catalogue.number[designs],
        "design": designs,
        "label": np.where(labelled, catalogue.number[designs].astype(str), ""),
        "colour": np.array([colour(i) for i in catalogue.result[designs]], dtype=object),
    }


def cloud(catalogue: Catalogue, data: Sources) -> Any:
    """Make the figure: all designs as one image, which ``js/filter.js`` paints; fronts and boxes as glyphs.

    ``data`` holds the ``sources``, and "pick", the picked design (``page.pick_data``).
    """
    across, up = catalogue.column(ACROSS), catalogue.column(UP)
    title = f"Fronts with ±σ boxes, {spaced(len(catalogue))} designs"
    title += f"; {spaced(catalogue.left_out)} more lack an objective and are not shown" if catalogue.left_out else ""
    tools: dict[str, Any] = {"tools": "pan,wheel_zoom,box_zoom,box_select,lasso_select,reset,save"}
    ranges: dict[str, Any] = {"x_range": fixed(*_extent(across, data, "x")), "y_range": fixed(*_extent(up, data, "y"))}
    plot = chart(title, across.title, up.title, height=490, active_scroll="wheel_zoom", **tools, **ranges)
    plot.name = "cloud"
    plot.image_rgba("image", "x", "y", "dw", "dh", source=data["raster"], level="underlay")
    plot.rect(
        "x", "y", "w", "h", source=data["front"], fill_color="colour", fill_alpha=0.06, line_color="colour",
        line_alpha=0.7,
    )  # fmt: skip
    front = plot.scatter("x", "y", source=data["front"], size=8, color="colour", line_color="white", marker="circle")
    plot.text(
        "x", "y", text="label", source=data["front"], text_font_size="11px", x_offset=5, y_offset=-3, text_color=INK
    )
    plot.scatter("x", "y", source=data["pick"], size=17, marker="circle", fill_alpha=0, line_color=PICK, line_width=2.5)
    tips = [("design", "@number"), (across.label, f"@x{{0.000}} {across.unit}"), (up.label, f"@y{{0.000}} {up.unit}")]
    scatter = [("σ of both", f"@sx{{0.000}} {across.unit}, @sy{{0.000}} {up.unit}")]
    plot.add_tools(HoverTool(renderers=[front], tooltips=[*tips, *scatter]))
    # the legend has separate glyphs, because a filter may empty a front
    no_points = ColumnDataSource({"x": [np.nan], "y": [np.nan]})
    entries = [
        LegendItem(label=result.label, renderers=[plot.scatter("x", "y", source=no_points, size=8, color=colour(i))])
        for i, result in enumerate(catalogue.results)
    ]
    plot.add_layout(Legend(items=entries, label_text_font_size="12px", background_fill_alpha=0.8), "center")
    return plot


def colour_bar(plot: Any) -> ColorBar:
    """Add a colour bar for a third quantity; it is hidden until the user chooses one."""
    mapper = LinearColorMapper(palette="Viridis256", low=0, high=1)
    bar = ColorBar(color_mapper=mapper, width=10, title_text_font_size="12px", padding=3, visible=False)
    plot.add_layout(bar, "right")
    return bar


def _extent(column: Column, data: Sources, axis: str) -> tuple[float, float]:
    """Range of an axis, "x" or "y", that shows all designs and the boxes of the fronts with a margin."""
    front = {key: np.asarray(values) for key, values in data["front"].data.items()}
    half = front["w" if axis == "x" else "h"] / 2
    low, high = min(column.range[0], *(front[axis] - half)), max(column.range[1], *(front[axis] + half))
    margin = 0.03 * (high - low) or 0.1 * abs(high) or 1.0
    return low - margin, high + margin
