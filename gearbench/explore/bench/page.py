"""Layout of the design bench: controls on one side; numbers, curves, orders, pressure and teeth on the other.

``session`` puts it on a server or into a file; ``js/bench.js`` runs the controls in the browser.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from bokeh.core.templates import get_env
from bokeh.document import Document
from bokeh.events import DocumentReady
from bokeh.models import ColorBar, ColumnDataSource, LinearColorMapper

from gearbench.explore.bench.answers import NOT_SWEPT
from gearbench.explore.bench.form import Group, flat, form
from gearbench.explore.gear import GearPanel, small_legend
from gearbench.explore.gear_data import ORDERS, Tables
from gearbench.explore.look import INK, PALETTE, fitted, fixed, script, text_of
from gearbench.explore.page import answer_data
from gearbench.scene import Scene

#: Maximum number of variants kept for comparison, one per colour.
MOST_VARIANTS = 6


class BenchPage:
    """Parts of the page, connected by scripts in the browser.

    A script writes the scene that the user wants solved to ``question``; the caller writes its results to ``answer``.

    Parameters
    ----------
    scene
        Scene shown first, which is also the baseline.
    first_tables
        Its plot data.
    variants
        Initial variants, see ``session.variants``.
    """

    def __init__(self, scene: Scene, first_tables: Tables, variants: Sequence[dict[str, Any]] = ()) -> None:
        self.scene, self.variants = scene, list(variants)
        self.question = ColumnDataSource({"scene": [json.dumps(scene.to_mapping())], "number": [0]}, name="question")
        self.answer = ColumnDataSource(answer_data(), name="answer")
        self.gear = GearPanel({**NOT_SWEPT, "warnings": {"text": []}, **first_tables}, baseline=True)
        self.figures = {**self.gear.figures, "harris": self._harris(), "torque": self._torque()}

    def put(self, document: Document, *, live: bool = True) -> None:
        """Add the page to a document; a page that is not ``live`` has no controls."""
        groups = form(self.scene)
        document.template = get_env().from_string("{% extends base %}" + text_of("bench/page.html"))
        document.template_variables.update(
            name=self.scene.name or "scene", figures=self._shown(), groups=groups, live=live, text_of=text_of
        )
        for name, figure in self.figures.items():
            figure.name = name
            document.add_root(figure)
        document.title = f"gearbench: {self.scene.name or 'scene'}"
        show = script("answer", answer=self.answer, sources=self.gear.now)
        self.answer.js_on_change("data", show)
        # Bokeh sends no models that only scripts use: tag a figure with them
        self.figures["ste"].tags = [self.question, self.answer]
        document.js_on_event(DocumentReady, self._begin(groups, live), *self.gear.ready)

    def _begin(self, groups: tuple[Group, ...], live: bool) -> Any:
        """Make the script that runs controls, variants and numbers."""
        added = {group.path: dict(group.example) for group in flat(groups) if group.optional}
        shown = ("baseline", "now") if live else (self.scene.name or "scene",)
        return script(
            "light", "compare", "download", "bench",
            question=self.question, phase=self.gear.phase, examples=json.dumps(added),
            plots=[self.figures[name] for name in self._shown()],
            **self.gear.compare(shown, MOST_VARIANTS, self.variants),
        )  # fmt: skip

    def _shown(self) -> list[str]:
        """Names of the figures in display order; the densities over the errors come last."""
        order = [
            "gears", "sharing", "ste", "stiffness", "ste_orders", "stiffness_orders", "harris", "torque", "revolution",
            "pressure", "teeth",
        ]  # fmt: skip
        last = [name for name in self.figures if name.endswith("_density")]
        return [*(name for name in order if name in self.figures), *last]

    def _harris(self) -> Any:
        """Draw the Harris map: transmission error over the mesh phase, one curve per torque."""
        plot = self.gear.chart("harris", x_range=fixed(0, 2))
        source = self.gear.now["harris"]
        mapper = LinearColorMapper(palette="Viridis256", low=0, high=1)
        plot.multi_line("xs", "ys", source=source, color={"field": "torque", "transform": mapper}, line_width=1.6)
        self.gear.overlay(plot, "harris", "dotted")
        bar = ColorBar(color_mapper=mapper, title="T [N·m]", width=10, title_text_font_size="12px", padding=3)
        plot.add_layout(bar, "right")
        colours = script("torques", source=source, mapper=mapper)
        source.js_on_change("data", colours)
        self.gear.ready += [colours, fitted(plot, across=False)]
        return plot

    def _torque(self) -> Any:
        """Draw peak-to-peak value and orders of the transmission error over torque."""
        plot = self.gear.chart("torque")
        source = self.gear.now["torque"]
        plot.line("torque", "peak_to_peak", source=source, color=INK, line_width=2.2, legend_label="peak-to-peak")
        self.gear.overlay(plot, "torque", "dashed")
        for n, colour in zip(ORDERS, PALETTE, strict=False):
            plot.line("torque", f"order {n}", source=source, color=colour, line_width=1.8, legend_label=f"order {n}")
            plot.scatter("torque", f"order {n}", source=source, color=colour, size=5)
        self.gear.ready.append(fitted(plot, floor=0))
        return small_legend(plot)
