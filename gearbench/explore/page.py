"""Layout of the page of stored designs: fronts, parallel coordinates and filters above, the picked gear below.

``live`` puts it on a server, ``static`` into a file. The scripts of ``js`` connect its parts in the browser.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from bokeh.core.templates import get_env
from bokeh.document import Document
from bokeh.events import DocumentReady, DoubleTap, Pan, PanEnd, PanStart, Reset, SelectionGeometry, Tap
from bokeh.models import Button, ColumnDataSource, HoverTool
from bokeh.models.layouts import Column as Stack

from gearbench.errors import GearbenchError, InputError
from gearbench.explore import cloud, filters, parallel
from gearbench.explore.catalogue import ACROSS, SCATTER_ACROSS, SCATTER_UP, UP, Catalogue, fronts
from gearbench.explore.gear import GearPanel
from gearbench.explore.gear_data import Tables
from gearbench.explore.look import PALETTE, SIDE, colour, script, spaced, text_of

#: Maximum number of picked gears kept for comparison.
MOST_KEPT = 3


class Page:
    """Parts of the page, connected by scripts; the caller fills ``answer`` (``answer_data``) on a pick.

    Every figure is a separate Bokeh root, because Bokeh lays out a whole root again when an axis label gains a digit.

    Parameters
    ----------
    catalogue
        The designs.
    first
        Index of the design picked at the beginning.
    tables
        Tables of that design.
    """

    def __init__(self, catalogue: Catalogue, first: int, tables: Tables) -> None:
        self.catalogue = catalogue
        self.sources = cloud.sources(catalogue)
        self.sources["pick"] = ColumnDataSource(pick_data(catalogue, first), name="pick")
        self.pick = self.sources["pick"]
        self.answer = ColumnDataSource(answer_data(), name="answer")
        self.gear = GearPanel(tables, baseline=False)
        self._first = first
        self.export = Button(label="Save scene file", name="export", width=SIDE - 60)
        self.export.js_on_event("button_click", script("download", "export", scene=self.gear.now["scene"]))
        self._roots, self.refresh, self.follow, self._choose = self._designs()

    def show_answers(self) -> None:
        """Let the browser show every new ``answer``."""
        self.answer.js_on_change("data", script("answer", answer=self.answer, sources=self.gear.now))
        # Bokeh sends no model that only scripts use: tag a figure with it
        self.gear.figures["ste"].tags = [self.answer]

    def put(self, document: Document) -> None:
        """Add the page to a document."""
        document.template = get_env().from_string("{% extends base %}" + text_of("page.html"))
        offered = [column["title"] for column in choices(self.catalogue)]
        titles = [self.catalogue.column(name).title for name in (ACROSS, UP)]
        document.template_variables.update(
            name=self.catalogue.name(self._first), results=self._results(), figures=list(self.gear.figures),
            columns=offered, across=titles[0], up=titles[1],
        )  # fmt: skip
        controls = Stack(children=[self.gear.phase, self.export], width=SIDE, name="controls")
        for name, root in {**self._roots, "controls": controls, **self.gear.figures}.items():
            root.name = name
            document.add_root(root)
        document.title = "gearbench explore"
        compare = script("light", "compare", "picks", **self.gear.compare(("picked",), MOST_KEPT))
        at_start = (self.refresh, self.follow, *self.gear.ready, script("labels"), self._choose, compare)
        document.js_on_event(DocumentReady, *at_start)

    def _results(self) -> list[str]:
        """One line per result: its name, the number of its designs, and their tooth model."""
        counts = np.bincount(self.catalogue.result, minlength=len(self.catalogue.results))
        return [
            f"{result.label}: {spaced(count)} designs, {result.teeth}"
            for result, count in zip(self.catalogue.results, counts, strict=True)
        ]

    def _designs(self) -> tuple[dict[str, Any], Any, Any, Any]:
        """Make filters, cloud and parallel coordinates, connected by scripts in the browser.

        Returns the roots by name, and three scripts: they redraw everything, follow the pick, and choose the axes.
        """
        catalogue, lines = self.catalogue, parallel.sources(self.catalogue)
        by_column = filters.sliders(catalogue)
        clear = Button(label="Clear filters", width=SIDE - 60)
        figure = cloud.cloud(catalogue, self.sources)
        coordinates = parallel.parallel(catalogue, lines)
        axes = axes_of(catalogue, by_column)
        bar = cloud.colour_bar(figure)
        refresh = script(
            "filter", designs=self.sources["designs"], front=self.sources["front"],
            raster=self.sources["raster"], plot=figure, size=list(cloud.PIXELS), axes=axes,
            everything=lines["everything"], kept=lines["kept"], ranges=lines["ranges"],
            sliders=list(by_column.values()), order=order(catalogue), gap=parallel.GAP, height=parallel.HEIGHT,
            colours=[colour(i) for i in range(min(len(catalogue.results), len(PALETTE)))],
            boxes=cloud.BOXES, scatter=[key(catalogue, name) for name in (SCATTER_ACROSS, SCATTER_UP)],
        )  # fmt: skip
        follow = script(
            "pick",
            plot=figure,
            size=list(cloud.PIXELS),
            designs=self.sources["designs"],
            pick=self.pick,
            line=lines["line"],
            axes=axes,
        )
        brush = script("brush", plot=coordinates, axes=axes)
        choose = script(
            "axes", designs=self.sources["designs"], pick=self.pick, plot=figure, refresh=refresh, bar=bar,
            hover=figure.select_one(HoverTool), columns=choices(catalogue), palette=list(bar.color_mapper.palette),
            front_title=figure.title.text,
        )  # fmt: skip
        for slider in by_column.values():
            slider.js_on_change("value", refresh)
        for span in (figure.x_range, figure.y_range):
            span.js_on_change("start", refresh)
            span.js_on_change("end", refresh)
        area = script("area", designs=self.sources["designs"], refresh=refresh)
        for event in (SelectionGeometry, DoubleTap, Reset):
            figure.js_on_event(event, area)
        figure.js_on_event(Tap, follow)
        self.pick.js_on_change("data", follow)
        coordinates.js_on_event(PanStart, brush)
        coordinates.js_on_event(Pan, brush)
        coordinates.js_on_event(PanEnd, brush)
        coordinates.js_on_event(DoubleTap, brush)
        clear.js_on_event(
            "button_click",
            script("clear", sliders=list(by_column.values()), designs=self.sources["designs"], refresh=refresh),
        )
        side = {"filters": filters.panel(catalogue, by_column), "clear": clear}
        return {**side, "cloud": figure, "parallel": coordinates}, refresh, follow, choose


def answer_data(now: Tables | None = None, heading: str = "", *, message: str = "") -> dict[str, Any]:
    """Columns of an answer for ``js/answer.js``: tables of the gear, heading, and error message.

    Without tables or heading, the page keeps those that it shows.
    """
    return {"now": [now], "summary": [heading], "message": [message]}


def explained(answers: Iterator[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield ``answers``; an error ends them with an answer that holds its message."""
    try:
        yield from answers
    except (InputError, GearbenchError, ArithmeticError) as error:
        yield answer_data(message=str(error))
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        yield answer_data(message="this request of the page cannot be answered: reload the page")


def axes_of(catalogue: Catalogue, by_column: dict[int, Any]) -> list[dict[str, Any]]:
    """Axes of the parallel coordinates, for the scripts: key of the column, its range, and its slider or None."""
    return [
        {"key": f"c{i}", "low": column.range[0], "high": column.range[1], "slider": by_column.get(i)}
        for i, column in parallel.axes(catalogue).items()
    ]


def choices(catalogue: Catalogue) -> list[dict[str, Any]]:
    """Quantities for axes and colour of the cloud: key, title, key of its σ or None, whether less is better."""
    quantities = []
    for i, column in enumerate(catalogue.columns):
        if not column.categories and column.range[0] < column.range[1]:
            deviation = f"{column.name.removesuffix('_mean')}_std" if column.name.endswith("_mean") else ""
            scatter = key(catalogue, deviation) if any(c.name == deviation for c in catalogue.columns) else None
            less_is_better = column.kind == "statistic"  # as for the objectives; variables have no direction
            quantities.append({"key": f"c{i}", "title": column.title, "scatter": scatter, "less": less_is_better})
    return quantities


def key(catalogue: Catalogue, name: str) -> str:
    """Key of a column in the source of the designs, e.g. c0."""
    return next(f"c{i}" for i, column in enumerate(catalogue.columns) if column.name == name)


def order(catalogue: Catalogue) -> np.ndarray:
    """Indices of the designs sorted by result, then ``ACROSS``, then ``UP``, (design,).

    In this order a script finds each front in one pass.
    """
    x, y = catalogue.column(ACROSS).values, catalogue.column(UP).values
    return np.lexsort((y, x, catalogue.result)).astype("int32")


def pick_data(catalogue: Catalogue, design: int) -> dict[str, Any]:
    """Columns of the source of the picked design."""
    x, y = (float(catalogue.column(name).values[design]) for name in (ACROSS, UP))
    return {"design": [design], "x": [x], "y": [y]}


def knee(catalogue: Catalogue) -> int:
    """Index of the design on the fronts with the least sum of both objectives, scaled by their ranges on the fronts."""
    designs = fronts(catalogue)
    score = np.zeros(len(designs))
    for name in (ACROSS, UP):
        values = catalogue.column(name).values[designs]
        score += (values - values.min()) / (np.ptp(values) or 1.0)
    return int(designs[np.argmin(score)])
