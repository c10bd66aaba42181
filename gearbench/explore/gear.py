"""Figures of the picked gear: curves, spectra, contact pressure on the flank, densities, teeth in mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bokeh.models import ColorBar, ColumnDataSource, LinearColorMapper, Slider, Span

from gearbench.explore.gear_data import Tables
from gearbench.explore.look import BEFORE, HEIGHT, INK, NOW, PALETTE, chart, fitted, fixed, script

#: Tables of the baseline that are shown together with those of a changed gear.
COMPARED = ("ste", "stiffness", "ste_orders", "stiffness_orders", "ste_density", "stiffness_density", "numbers")
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


class GearPanel:
    """Figures of one gear and their sources; the browser fills the sources with new tables.

    Parameters
    ----------
    now
        Initial tables.
    baseline
        Whether this first gear stays on show beside the later ones.
    """

    def __init__(self, now: Tables, *, baseline: bool) -> None:
        self.now = {name: ColumnDataSource(table, name=f"now {name}") for name, table in now.items()}
        first: Tables = now if baseline else {name: {key: [] for key in now[name]} for name in COMPARED}
        self.before = {name: ColumnDataSource(first[name], name=f"before {name}") for name in COMPARED}
        empty = {"xs": [], "ys": [], "fluctuations": [], "colour": [], "label": []}
        self.kept = {name: ColumnDataSource(dict(empty), name=f"kept {name}") for name in OVERLAID if name in now}
        self.phase = Slider(start=0, end=1, value=0, step=0.01, title="mesh phase τ", width=250, name="phase")
        #: Scripts to run once the page is loaded.
        self.ready: list[Any] = []
        self.ste = self._curve("ste", "Static transmission error", "δ [µm]", "#0072B2")
        self.stiffness = self._curve("stiffness", "Mesh stiffness", "k [N/µm]", "#D55E00")
        self.ste_orders = self._bars("ste", "Orders of δ", "amplitude of δ [µm]", "#0072B2")
        self.stiffness_orders = self._bars("stiffness", "Orders of k", "amplitude of k [N/µm]", "#D55E00")
        self.ste_density = self._density("ste", "RMS δ over the errors", "RMS δ [µm]", "1/µm", "#0072B2")
        self.stiffness_density = self._density("stiffness", "RMS k over the errors", "RMS k [%]", "1/%", "#D55E00")
        self.pressure = self._pressure(now)
        self.teeth = self._teeth(now)

    @property
    def figures(self) -> dict[str, Any]:
        """Figures by name, row after row."""
        upper = {"ste": self.ste, "stiffness": self.stiffness}
        upper |= {"ste_orders": self.ste_orders, "stiffness_orders": self.stiffness_orders}
        lower = {"pressure": self.pressure, "teeth": self.teeth}
        return upper | lower | {"ste_density": self.ste_density, "stiffness_density": self.stiffness_density}

    def compare(self, heads: Sequence[str], most: int, beside: Sequence[dict[str, Any]] = ()) -> dict[str, Any]:
        """Arguments of ``js/compare.js``, which fills the table of numbers and draws the curves of gears kept.

        ``heads`` names the columns of the table: baseline and now, or now alone. At most ``most`` gears are kept;
        ``beside`` holds those kept from the beginning.
        """
        return {
            "now": self.now, "before": self.before, "sources": self.kept, "heads": list(heads), "most": most,
            "beside": list(beside), "colours": [*PALETTE[2:], *PALETTE[:2]],
            "columns": {name: list(columns) for name, columns in OVERLAID.items()},
            "curves": [line.glyph for name in CYCLES for line in self.figures[name].renderers],
        }  # fmt: skip

    def overlay(self, plot: Any, name: str, dash: str = "solid") -> None:
        """Draw the curves of the gears kept for comparison, in their colours."""
        plot.multi_line("xs", "ys", source=self.kept[name], color="colour", line_width=1.6, line_dash=dash)

    def _curve(self, name: str, title: str, label: str, colour: str) -> Any:
        plot = chart(title, "mesh phase τ [mesh periods]", label, height=HEIGHT, x_range=fixed(0, 2))
        plot.line("phase", "value", source=self.before[name], color=BEFORE, line_dash="dashed", line_width=1.5)
        plot.line("phase", "value", source=self.now[name], color=colour, line_width=2.2)
        self.overlay(plot, name)
        mark = Span(location=0, dimension="height", line_color=INK, line_dash="dotted", line_alpha=0.6)
        self.phase.js_link("value", mark, "location")
        plot.add_layout(mark)
        self.ready.append(fitted(plot, across=False))
        return plot

    def _bars(self, name: str, title: str, label: str, colour: str) -> Any:
        plot = chart(title, "mesh order [–]", label, height=HEIGHT, x_range=fixed(0.3, 10.7))
        key = f"{name}_orders"
        plot.vbar("order", top="amplitude", width=0.85, source=self.before[key], color="#CFCFCF")
        plot.vbar("order", top="amplitude", width=0.5, source=self.now[key], color=colour)
        self.overlay(plot, key)
        plot.xaxis.ticker = list(range(1, 11))
        plot.xgrid.visible = False
        self.ready.append(fitted(plot, across=False, floor=0))
        return plot

    def _density(self, name: str, title: str, label: str, unit: str, colour: str) -> Any:
        plot = chart(title, label, f"density [{unit}]", height=HEIGHT)
        key = f"{name}_density"
        plot.line("value", "density", source=self.before[key], color=BEFORE, line_dash="dashed", line_width=1.5)
        plot.varea("value", 0, "density", source=self.now[key], color=colour, alpha=0.2)
        plot.line("value", "density", source=self.now[key], color=colour, line_width=2.2)
        self.ready.append(fitted(plot, floor=0))
        return plot

    def _pressure(self, now: Tables) -> Any:
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
        source.js_on_change("data", script("load", source=source, mapper=mapper, plot=plot))
        plot.grid.visible = False
        return plot

    def _teeth(self, now: Tables) -> Any:
        motion = now["motion"]
        middle, half = motion["middle"][0], motion["half"][0]
        wide = 1.5 * half
        plot = chart(
            "Teeth in mesh, middle of the face", "x [mm]", "y [mm]", height=HEIGHT,
            x_range=fixed(-wide, wide), y_range=fixed(middle - half, middle + half),
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
