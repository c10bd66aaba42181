"""Figures of the gear shown: curves, orders, densities; pressure and teeth of a pair, gears and load shares of a train.

Both pages use them: the fronts (``page``) and the design bench (``bench.page``). The browser fills their sources.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bokeh.models import ColorBar, ColumnDataSource, LinearColorMapper, Slider, Span

from gearbench.explore.gear_data import Tables
from gearbench.explore.look import BEFORE, HEIGHT, INK, NOW, PALETTE, chart, fitted, fixed, script

#: Tables that the baseline has too.
COMPARED = (
    "ste", "stiffness", "ste_orders", "stiffness_orders", "ste_density", "stiffness_density", "sharing_density",
    "sharing", "revolution", "numbers",
)  # fmt: skip
#: Figures that also show the gears kept for comparison, with the x and y columns of their curves.
OVERLAID = {
    "ste": ("phase", "value"),
    "stiffness": ("phase", "value"),
    "ste_orders": ("order", "amplitude"),
    "stiffness_orders": ("order", "amplitude"),
    "torque": ("torque", "peak_to_peak"),
    "harris": ("xs", "ys"),
}
#: Figures whose curves can be shown without their mean.
CYCLES = ("ste", "stiffness")
#: Figure of a pair → its title and the labels of its axes; ``bench.page`` draws harris and torque.
WORDS = {
    "ste": ("Static transmission error", "mesh phase τ [mesh periods]", "δ [µm]"),
    "stiffness": ("Mesh stiffness", "mesh phase τ [mesh periods]", "k [N/µm]"),
    "ste_orders": ("Orders of δ", "mesh order [–]", "amplitude of δ [µm]"),
    "stiffness_orders": ("Orders of k", "mesh order [–]", "amplitude of k [N/µm]"),
    "ste_density": ("RMS δ over the error samples", "RMS δ [µm]", "density [1/µm]"),
    "stiffness_density": ("RMS k over the error samples", "RMS k [%]", "density [1/%]"),
    "harris": ("Harris map: STE minus its mean", "mesh phase τ [mesh periods]", "δ − mean [µm]"),
    "torque": ("STE over torque", "torque on the pinion [N·m]", "STE [µm]"),
}
#: The same for a train.
WORDS_OF_TRAIN = {
    "ste": ("Transmission error of the train", "mesh phase τ [mesh periods]", "Δ [µm]"),
    "stiffness": ("Stiffness of the train", "mesh phase τ [mesh periods]", "k [N/µm]"),
    "ste_orders": ("Orders of Δ", "mesh order [–]", "amplitude of Δ [µm]"),
    "stiffness_orders": ("Orders of k", "mesh order [–]", "amplitude of k [N/µm]"),
    "ste_density": ("RMS Δ over the error samples", "RMS Δ [µm]", "density [1/µm]"),
    "sharing_density": ("K_γ over the error samples", "K_γ [–]", "density [–]"),
    "harris": ("Harris map: Δ minus its mean", "mesh phase τ [mesh periods]", "Δ − mean [µm]"),
    "torque": ("Δ over torque", "torque on the first gear [N·m]", "Δ [µm]"),
    "sharing": ("Load shares", "mesh phase τ [mesh periods]", "share L [–]"),
    "revolution": ("Largest load shares", "carrier relative to the ring [revolutions]", "share L [–]"),
}


class GearPanel:
    """Figures of one gear and their sources; the browser fills the sources with new tables.

    ``now`` holds the sources of the gear shown, ``before`` those of the baseline, and ``kept`` those of the gears kept
    for comparison. The tables of the first gear decide which figures there are.

    Parameters
    ----------
    now
        Tables of the first gear.
    baseline
        Whether the first gear is the baseline, drawn together with the gears that follow.
    """

    def __init__(self, now: Tables, *, baseline: bool) -> None:
        self.now = {name: ColumnDataSource(table, name=f"now {name}") for name, table in now.items()}
        self.words = WORDS_OF_TRAIN if "sharing" in now else WORDS
        compared = [name for name in COMPARED if name in now]
        baseline_tables: Tables = now if baseline else {name: {key: [] for key in now[name]} for name in compared}
        self.before = {name: ColumnDataSource(baseline_tables[name], name=f"before {name}") for name in compared}
        empty = {"xs": [], "ys": [], "fluctuations": [], "colour": [], "label": []}
        self.kept = {name: ColumnDataSource(dict(empty), name=f"kept {name}") for name in OVERLAID if name in now}
        self.phase = Slider(start=0, end=1, value=0, step=0.01, title="mesh phase τ", width=250, name="phase")
        #: Scripts to run once the page is loaded.
        self.ready: list[Any] = []
        #: Figures by name, row after row.
        self.figures: dict[str, Any] = {name: self._curve(name) for name in CYCLES}
        self.figures |= {f"{name}_orders": self._bars(f"{name}_orders") for name in CYCLES}
        if "sharing" in now:
            self.figures |= {name: self._shares(name) for name in ("sharing", "revolution")}
            self.figures["gears"] = self._gears()
        else:
            self.figures |= {"pressure": self._pressure(now), "teeth": self._teeth(now)}
        self.figures |= {name: self._density(name) for name in now if name.endswith("_density")}

    def compare(self, heads: Sequence[str], most: int, variants: Sequence[dict[str, Any]] = ()) -> dict[str, Any]:
        """Arguments of ``js/compare.js``, which fills the table of numbers and draws the curves of the gears kept.

        A user keeps gears for comparison, at most ``most``; ``variants`` are kept from the beginning. ``heads`` are the
        headings of the columns before those of the gears kept: baseline and gear shown, or the gear shown alone.
        """
        return {
            "now": self.now, "before": self.before, "sources": self.kept, "heads": list(heads), "most": most,
            # the first two colours are those of STE and stiffness of the gear shown
            "variants": list(variants), "colours": [*PALETTE[2:], *PALETTE[:2]],
            "columns": {name: list(columns) for name, columns in OVERLAID.items()},
            "curves": [line.glyph for name in CYCLES for line in self.figures[name].renderers],
        }  # fmt: skip

    def overlay(self, plot: Any, name: str, dash: str = "solid") -> None:
        """Draw the curves of the gears kept for comparison, in their colours."""
        plot.multi_line("xs", "ys", source=self.kept[name], color="colour", line_width=1.6, line_dash=dash)

    def chart(self, name: str, **options: Any) -> Any:
        """Make the empty figure ``name`` with its title and labels."""
        return chart(*self.words[name], height=HEIGHT, **options)

    def _curve(self, name: str) -> Any:
        """Draw a quantity over the mesh phase."""
        plot = self.chart(name, x_range=fixed(0, 2))
        plot.line("phase", "value", source=self.before[name], color=BEFORE, line_dash="dashed", line_width=1.5)
        plot.line("phase", "value", source=self.now[name], color=_colour(name), line_width=2.2)
        self.overlay(plot, name)
        self._mark_phase(plot)
        self.ready.append(fitted(plot, across="sharing" in self.now))  # the cycle of a train may span many mesh periods
        return plot

    def _mark_phase(self, plot: Any) -> None:
        """Draw a line at the mesh phase of the slider."""
        mark = Span(location=0, dimension="height", line_color=INK, line_dash="dotted", line_alpha=0.6)
        self.phase.js_on_change("value", script("mark", mark=mark))
        plot.add_layout(mark)

    def _bars(self, name: str) -> Any:
        """Draw the amplitudes of the mesh orders 1 to 10."""
        plot = self.chart(name, x_range=fixed(0.3, 10.7))
        plot.vbar("order", top="amplitude", width=0.85, source=self.before[name], color="#CFCFCF")
        plot.vbar("order", top="amplitude", width=0.5, source=self.now[name], color=_colour(name))
        self.overlay(plot, name)
        plot.xaxis.ticker = list(range(1, 11))
        plot.xgrid.visible = False
        self.ready.append(fitted(plot, across=False, floor=0))
        return plot

    def _density(self, name: str) -> Any:
        """Draw the density of a response over the error samples."""
        plot = self.chart(name)
        plot.line("value", "density", source=self.before[name], color=BEFORE, line_dash="dashed", line_width=1.5)
        plot.varea("value", 0, "density", source=self.now[name], color=_colour(name), alpha=0.2)
        plot.line("value", "density", source=self.now[name], color=_colour(name), line_width=2.2)
        self.ready.append(fitted(plot, floor=0))
        return plot

    def _shares(self, name: str) -> Any:
        """Draw the load shares over the mesh cycle ("sharing") or over a revolution of the carrier ("revolution")."""
        over_cycle = name == "sharing"
        plot = self.chart(name, x_range=fixed(0, 2 if over_cycle else 1))
        # invisible points: the figure shows at least 0.98 to 1.02, so that rounding errors of equal shares stay small
        plot.scatter("x", "y", source=ColumnDataSource({"x": [0.0, 1.0], "y": [0.98, 1.02]}), alpha=0)
        plot.multi_line("xs", "ys", source=self.before[name], color="#CFCFCF", line_width=1.5)
        plot.multi_line("xs", "ys", source=self.now[name], color="colour", line_width=2)
        if over_cycle:
            self._mark_phase(plot)
        self.ready.append(fitted(plot, across=over_cycle))
        return plot

    def _gears(self) -> Any:
        """Draw the gears as they turn, with the load shares, in the colours of their curves.

        The diameter of the circle at a mesh is proportional to its load share.
        """
        # y points down, see geometry/train.py
        plot = chart(
            "Gears and load shares", "x [mm]", "y [mm]", height=2 * HEIGHT, x_range=fixed(-1, 1), y_range=fixed(1, -1)
        )
        drawn = ColumnDataSource({"xs": [], "ys": [], "alpha": []})
        marks, labels = (ColumnDataSource({key: [] for key in ("x", "y", "size", "share", "colour")}) for _ in range(2))
        plot.patches(
            "xs", "ys", source=drawn, fill_color=PALETTE[5], fill_alpha="alpha", line_color=INK, line_width=0.8
        )
        plot.text("x", "label_y", "name", source=self.now["gears"], text_align="center", text_font_size="12px")
        plot.scatter("x", "y", size="size", source=marks, color="colour", alpha=0.75, line_color="white")
        plot.text(
            "x", "y", "share", source=labels, y_offset=18, text_align="center", text_font_size="13px",
            text_font_style="bold", text_color="colour",
        )  # fmt: skip
        turn = script(
            "gears", phase=self.phase, drawn=drawn, marks=marks, labels=labels, plot=plot,
            now={name: self.now[name] for name in ("gears", "marks", "paths", "extent", "sharing")},
        )  # fmt: skip
        self.ready.append(turn)
        self.phase.js_on_change("value", turn)
        plot.js_on_change("inner_width", turn)
        for name in ("sharing", "gears"):
            self.now[name].js_on_change("data", turn)
        plot.grid.visible = False
        return plot

    def _pressure(self, now: Tables) -> Any:
        """Draw the map of the contact pressure."""
        image = {key: column[0] for key, column in now["pressure"].items()}
        plot = chart(
            "Contact pressure on the flank", "face width y [mm]", "path of contact u [mm]", height=HEIGHT,
            x_range=fixed(0, image["dw"]), y_range=fixed(image["y"], image["y"] + image["dh"]),
        )  # fmt: skip
        mapper = LinearColorMapper(palette="Cividis256", low=0, high=image["top"], nan_color="white")
        source = self.now["pressure"]
        plot.image("image", "x", "y", "dw", "dh", source=source, color_mapper=mapper)
        bar = ColorBar(color_mapper=mapper, title="p [MPa]", width=10, title_text_font_size="12px", padding=3)
        plot.add_layout(bar, "right")
        source.js_on_change("data", script("pressure", source=source, mapper=mapper, plot=plot))
        plot.grid.visible = False
        return plot

    def _teeth(self, now: Tables) -> Any:
        """Draw the teeth in mesh as they turn, with the path of contact and the points in contact."""
        motion = now["motion"]
        middle, half = motion["middle"][0], motion["half"][0]
        half_width = 1.5 * half
        plot = chart(
            "Teeth in mesh, middle of the face", "x [mm]", "y [mm]", height=HEIGHT,
            x_range=fixed(-half_width, half_width), y_range=fixed(middle - half, middle + half),
        )  # fmt: skip
        drawn = {name: ColumnDataSource({"x": [], "y": []}) for name in ("pinion", "wheel", "contacts")}
        for name, colour in (("pinion", PALETTE[5]), ("wheel", PALETTE[4])):
            plot.patch("x", "y", source=drawn[name], fill_color=colour, fill_alpha=0.45, line_color=INK, line_width=1.2)
        plot.line("x", "y", source=self.now["path"], color=NOW, line_dash="dashed")
        plot.scatter("x", "y", source=drawn["contacts"], size=8, color="#D55E00", line_color="white")
        turn = script(
            "teeth", phase=self.phase, shapes=[self.now["pinion"], self.now["wheel"]], motion=self.now["motion"],
            drawn=[drawn["pinion"], drawn["wheel"]], contacts=drawn["contacts"], plot=plot,
        )  # fmt: skip
        self.ready.append(turn)
        self.phase.js_on_change("value", turn)
        plot.js_on_change("inner_width", turn)
        self.now["motion"].js_on_change("data", turn)
        return plot


def _colour(name: str) -> str:
    return "#0072B2" if name.startswith("ste") else "#D55E00"


def small_legend(plot: Any) -> Any:
    """Move the legend to the right of the frame, in small type."""
    plot.add_layout(plot.legend[0], "right")
    plot.legend.label_text_font_size = "11px"
    plot.legend.spacing, plot.legend.padding, plot.legend.border_line_color = 0, 2, None
    plot.legend.glyph_width = 14
    return plot
