"""All designs and the fronts: across the RMS of the stiffness, up the RMS of the transmission error."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from bokeh.models import CDSView, ColumnDataSource, HoverTool, IndexFilter, Legend, LegendItem, TapTool
from bokeh.transform import linear_cmap
from numpy.typing import NDArray

from gearbench.explore.catalogue import ACROSS, SCATTER_ACROSS, SCATTER_UP, UP, Catalogue, fronts
from gearbench.explore.look import PALETTE, PICK, chart, colour

#: Keys of columns in the sources: c0, c1, …
Sources = dict[str, ColumnDataSource]
#: Boxes drawn at most: those of neighbours on a front hide each other.
BOXES = 24


def sources(catalogue: Catalogue) -> Sources:
    """Data of the designs and of the fronts; 4-byte numbers, because they are drawn only."""
    x, y = catalogue.column(ACROSS).values, catalogue.column(UP).values
    data = {"x": x, "y": y, "study": catalogue.study, "place": catalogue.place}
    for i, column in enumerate(catalogue.columns):
        data[f"c{i}"] = column.values
    short: dict[str, Any] = {k: v.astype("int32" if v.dtype.kind == "i" else "float32") for k, v in data.items()}
    return {
        "designs": ColumnDataSource(short, name="designs"),
        "front": ColumnDataSource(front_data(catalogue, fronts(catalogue)), name="front"),
    }


def front_data(catalogue: Catalogue, places: NDArray) -> dict[str, Any]:
    """Columns of the front: values, σ, width and height of the 2σ boxes (0 where none is drawn), results, places."""
    drawn = np.arange(len(places)) % max(1, math.ceil(len(places) / BOXES)) == 0
    x, y, sx, sy = (catalogue.column(n).values[places] for n in (ACROSS, UP, SCATTER_ACROSS, SCATTER_UP))
    return {
        "x": x,
        "y": y,
        "sx": sx,
        "sy": sy,
        "w": np.where(drawn, 2 * np.nan_to_num(sx), 0.0),
        "h": np.where(drawn, 2 * np.nan_to_num(sy), 0.0),
        "study": catalogue.study[places],
        "place": catalogue.place[places],
        "design": places,
        "colour": np.array([colour(i) for i in catalogue.study[places]], dtype=object),
    }


def cloud(catalogue: Catalogue, data: Sources, keep: IndexFilter) -> Any:
    """The figure; its view of the designs is ``keep``."""
    across, up = catalogue.column(ACROSS), catalogue.column(UP)
    tools = "pan,wheel_zoom,box_zoom,box_select,lasso_select,reset,save"
    plot = chart("", across.title, up.title, width=640, height=490, tools=tools, active_scroll="wheel_zoom")
    plot.title.text = f"Fronts with 2σ boxes; {len(catalogue):,} designs".replace(",", " ")
    plot.name = "cloud"
    studies = len(catalogue.results)
    palette = [colour(i) for i in range(studies)]
    fill = linear_cmap("study", palette, -0.5, studies - 0.5) if studies > 1 else PALETTE[0]
    plot.scatter(
        "x", "y", source=data["designs"], size=3, marker="square", color="#C4C4C4", alpha=0.35, level="underlay",
        selection_color="#C4C4C4", nonselection_color="#C4C4C4", nonselection_alpha=0.35, selection_alpha=0.35,
    )  # fmt: skip
    points = plot.scatter(
        "x", "y", source=data["designs"], view=CDSView(filter=keep), size=4, color=fill, alpha=0.6, line_color=None,
        nonselection_alpha=0.25, nonselection_line_color=None, selection_line_color=None, name="kept",
    )  # fmt: skip
    plot.rect(
        "x", "y", "w", "h", source=data["front"], fill_color="colour", fill_alpha=0.06, line_color="colour",
        line_alpha=0.7,
    )  # fmt: skip
    front = plot.scatter(
        "x", "y", source=data["front"], size=8, color="colour", line_color="white", marker="circle", name="front"
    )
    plot.scatter("x", "y", source=data["pick"], size=17, marker="circle", fill_alpha=0, line_color=PICK, line_width=2.5)
    plot.add_tools(TapTool(renderers=[points]))
    tips = [("design", "@place"), (across.label, f"@x{{0.000}} {across.unit}"), (up.label, f"@y{{0.000}} {up.unit}")]
    scatter = [("σ across, up", f"@sx{{0.000}} {across.unit}, @sy{{0.000}} {up.unit}")]
    plot.add_tools(HoverTool(renderers=[front], tooltips=[*tips, *scatter]))
    named = [
        LegendItem(label=result.label, renderers=[front], index=int(np.argmax(data["front"].data["study"] == i)))
        for i, result in enumerate(catalogue.results)
    ]
    plot.add_layout(Legend(items=named, label_text_font_size="12px", background_fill_alpha=0.8), "center")
    return plot
