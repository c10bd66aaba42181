"""The page: fronts, parallel coordinates and filters above, the picked gear below."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.events import DocumentReady, DoubleTap, Pan, PanEnd, PanStart, Reset, SelectionGeometry, Tap
from bokeh.models import Button, ColumnDataSource, Div
from bokeh.models.layouts import Column as Stack
from bokeh.models.layouts import Row

from gearbench.explore import cloud, filters, parallel
from gearbench.explore.catalogue import ACROSS, SCATTER_ACROSS, SCATTER_UP, UP, Catalogue, fronts
from gearbench.explore.gear import GearPanel
from gearbench.explore.gear_data import Tables
from gearbench.explore.look import PALETTE, SIDE, colour
from gearbench.explore.scripts import script


class Page:
    """The parts of the page, wired; what answers a pick is added by the caller.

    Parameters
    ----------
    catalogue
        The designs.
    first
        The design picked at the beginning.
    now, before
        Its tables, with the page's settings and as stored.
    """

    def __init__(self, catalogue: Catalogue, first: int, now: Tables, before: Tables) -> None:
        self.catalogue = catalogue
        self.sources = cloud.sources(catalogue)
        self.sources["pick"] = ColumnDataSource(pick_data(catalogue, first), name="pick")
        self.pick = self.sources["pick"]
        self.gear = GearPanel(now, before)
        self.summary = Div(text="", width=SIDE - 10, name="summary")
        self.message = Div(text="", width=SIDE - 10, name="message", styles={"color": "#B00020"})
        self.export = Button(label="Save scene file", name="export", width=SIDE - 60)
        self.export.js_on_event("button_click", script("export", scene=self.gear.now["scene"]))
        self._above, self.refresh, self.follow = self._designs()

    def layout(self, controls: list[Any]) -> Stack:
        """All parts; ``controls`` stand beside the picked gear."""
        gear = self.gear
        beside: list[Any] = [self.summary, *controls, gear.phase, self.export, self.message]
        side = Stack(children=beside, width=SIDE)
        upper: list[Any] = [gear.ste, gear.stiffness, gear.ste_orders, gear.stiffness_orders]
        lower: list[Any] = [gear.load, gear.teeth, gear.ste_density, gear.stiffness_density]
        figures = Stack(children=[Row(children=upper), Row(children=lower)])
        return Stack(children=[self._above, Row(children=[side, figures])], name="page")

    def put(self, document: Document, controls: list[Any]) -> None:
        """Make this the page of a document."""
        document.add_root(self.layout(controls))
        document.title = "gearbench explore"
        document.js_on_event(DocumentReady, self.refresh, self.follow, self.gear.turn)

    def _designs(self) -> tuple[Row, Any, Any]:
        """Filters, cloud and parallel coordinates, wired in the browser."""
        catalogue, lines = self.catalogue, parallel.sources(self.catalogue)
        by_column = filters.sliders(catalogue)
        stack, clear, count = filters.panel(catalogue, by_column, 490)
        many = cloud.cloud(catalogue, self.sources)
        coordinates = parallel.parallel(catalogue, lines)
        axes = axes_of(catalogue, by_column)
        refresh = script(
            "filter", designs=self.sources["designs"], front=self.sources["front"],
            raster=self.sources["raster"], plot=many, size=list(cloud.PIXELS), axes=axes,
            everything=lines["everything"], kept=lines["kept"], ranges=lines["ranges"], kept_count=count,
            sliders=list(by_column.values()), order=order(catalogue), gap=parallel.GAP, up=parallel.UP,
            colours=[colour(i) for i in range(min(len(catalogue.results), len(PALETTE)))],
            boxes=cloud.BOXES, scatter=[key(catalogue, name) for name in (SCATTER_ACROSS, SCATTER_UP)],
        )  # fmt: skip
        follow = script(
            "pick",
            plot=many,
            size=list(cloud.PIXELS),
            designs=self.sources["designs"],
            pick=self.pick,
            line=lines["line"],
            axes=axes,
        )
        brush = script("brush", plot=coordinates, axes=axes)
        for slider in by_column.values():
            slider.js_on_change("value", refresh)
        for span in (many.x_range, many.y_range):
            span.js_on_change("start", refresh)
            span.js_on_change("end", refresh)
        area = script("area", designs=self.sources["designs"], refresh=refresh)
        for event in (SelectionGeometry, DoubleTap, Reset):
            many.js_on_event(event, area)
        many.js_on_event(Tap, follow)
        self.pick.js_on_change("data", follow)
        coordinates.js_on_event(PanStart, brush)
        coordinates.js_on_event(Pan, brush)
        coordinates.js_on_event(PanEnd, brush)
        coordinates.js_on_event(DoubleTap, brush)
        clear.js_on_event(
            "button_click",
            script("clear", sliders=list(by_column.values()), designs=self.sources["designs"], refresh=refresh),
        )
        return Row(children=[stack, many, coordinates]), refresh, follow


def axes_of(catalogue: Catalogue, by_column: dict[int, Any]) -> list[dict[str, Any]]:
    """Axes of the parallel coordinates for the scripts: key of the column, range, slider."""
    shown = {id(column) for column in parallel.axes(catalogue)}
    return [
        {"key": f"c{i}", "low": column.range[0], "high": column.range[1], "slider": by_column.get(i)}
        for i, column in enumerate(catalogue.columns)
        if id(column) in shown
    ]


def key(catalogue: Catalogue, name: str) -> str:
    """Key of a column in the source of the designs."""
    return next(f"c{i}" for i, column in enumerate(catalogue.columns) if column.name == name)


def order(catalogue: Catalogue) -> np.ndarray:
    """Designs by result, then across, then up: one sweep finds the fronts of whatever is kept."""
    x, y = catalogue.column(ACROSS).values, catalogue.column(UP).values
    return np.lexsort((y, x, catalogue.study)).astype("int32")


def pick_data(catalogue: Catalogue, design: int) -> dict[str, Any]:
    """Columns of the pick."""
    x, y = (float(catalogue.column(name).values[design]) for name in (ACROSS, UP))
    return {"design": [design], "x": [x], "y": [y]}


def knee(catalogue: Catalogue) -> int:
    """The design on a front that is nearest the best of both objectives, each from its least to its greatest value."""
    places = fronts(catalogue)
    score = np.zeros(len(places))
    for name in (ACROSS, UP):
        values = catalogue.column(name).values[places]
        score += (values - values.min()) / (np.ptp(values) or 1.0)
    return int(places[np.argmin(score)])
