"""Look of the page: its JavaScript and HTML files, colours, sizes, and empty figures in the common style.

The JavaScript is in the folder ``js``, one file per task.
"""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from bokeh.models import CustomJS, Range1d
from bokeh.plotting import figure


def script(*names: str, **args: Any) -> CustomJS:
    """Join the scripts ``js/<name>.js`` into one callback; ``args`` are the models and values they use."""
    return CustomJS(args=args, code="\n".join(text_of(f"js/{name}.js") for name in names))


def text_of(name: str) -> str:
    """Read a file of the page."""
    return files("gearbench.explore").joinpath(*name.split("/")).read_text("utf-8")


#: Okabe–Ito colours, safe for colour-blind readers: one per result, repeated after the last.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
#: Colours of the gear shown, of the baseline, of lines and texts, and of the picked design.
NOW, BEFORE, INK, PICK = "#0072B2", "#8A8A8A", "#222222", "#000000"
#: Width of the column of controls, and height of a figure [pixels].
SIDE, HEIGHT = 290, 250


def colour(result: int) -> str:
    """Colour of a result, by its index."""
    return PALETTE[result % len(PALETTE)]


def spaced(count: int) -> str:
    """Write a count with spaces between thousands."""
    return f"{count:,}".replace(",", " ")


def chart(title: str, x: str, y: str, *, height: int, tools: str = "", **options: Any) -> Any:
    """Make an empty figure in the common style, as wide as its frame."""
    plot: Any = figure(
        title=title,
        x_axis_label=x,
        y_axis_label=y,
        height=height,
        tools=tools,
        toolbar_location="above" if tools else None,
        sizing_mode="stretch_width",
        **options,
    )
    plot.title.text_font_size = "14px"
    plot.title.text_color = INK
    for axis in plot.axis:
        axis.axis_label_text_font_size = "13px"
        axis.axis_label_text_font_style = "normal"
        axis.major_label_text_font_size = "12px"
    plot.grid.grid_line_alpha = 0.5
    if plot.toolbar:
        plot.toolbar.logo = None
    return plot


def fixed(start: float, end: float) -> Range1d:
    """Axis range that does not follow the data."""
    return Range1d(start=start, end=end)


def fitted(plot: Any, *, across: bool = True, floor: float | None = None) -> Any:
    """Fit the ranges of ``plot`` to its glyphs whenever their data change; returns the script for it.

    The page must also run the script once when it is loaded.

    This replaces Bokeh's automatic ranges, which warn if there is nothing to show yet, report every change to the
    server, and lay out the figure twice. Without ``across``, the horizontal range stays; ``floor`` is the lower end of
    the vertical range.
    """
    plot.y_range = fixed(0, 1)
    if across:
        plot.x_range = fixed(0, 1)
    fit = script("fit", plot=plot, across=across, floor=floor)
    for renderer in plot.renderers:
        renderer.data_source.js_on_change("data", fit)
        for name in ("y", "ys"):  # another column may be chosen
            if name in renderer.glyph.properties():
                renderer.glyph.js_on_change(name, fit)
    return fit
