"""One-page report of a gear pair as HTML for A4: drawing, data, curves, mesh orders, load maps, warnings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

import numpy as np

from gearbench.errors import plain
from gearbench.files import replacing
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.geometry.tooth_shapes import mesh
from gearbench.html import head, picture, table
from gearbench.lazy import Axes, Figure, xr
from gearbench.plotting import BLUE, ORANGE, load_map, new_figure, order_spectrum, over_two_periods
from gearbench.results.origin import scene_of

#: Rows of a table: quantity, values and unit.
Rows = Sequence[Sequence[str]]


def write_pair_report(
    dataset: xr.Dataset, path: Path, subtitle: str, tables: Mapping[str, Rows], warnings: Sequence[str] = ()
) -> Path:
    """Write the page of a simulated pair.

    Parameters
    ----------
    dataset
        Dataset of ``simulate`` with its default outputs, for one load.
    path
        HTML file to write.
    subtitle
        Line with pair and torque.
    tables
        Heading of a table → its rows, which may have different numbers of values.
    warnings
        Warnings about the result, one per line.
    """
    scene = scene_of(dataset)
    attrs = dataset.attrs
    text = Template(files("gearbench").joinpath("pair_report.html").read_text(encoding="utf-8")).substitute(
        head=head(plain(scene.name or "gear pair")),
        title=escape(plain(scene.name or "gear pair")),
        subtitle=escape(plain(subtitle)),
        warnings="".join(f"<li>{escape(plain(line))}</li>" for line in warnings),
        tables="\n".join(f"<section><h2>{escape(name)}</h2>{_rows(rows)}</section>" for name, rows in tables.items()),
        drawing=picture(_drawing(scene.pair), "Teeth in mesh, transverse section at the middle of the face", 150),
        curves=picture(_curves(dataset), "Two mesh periods", 150),
        orders=picture(_orders(dataset), "Mesh orders", 150),
        maps=picture(_maps(dataset), "Contact pressure over the mesh cycle", 150),
        origin=escape(f"gearbench, {attrs['created']}, scene {attrs['scene_sha256'][:12]}, support {attrs['support']}"),
        scene=escape(attrs["scene"]),
    )
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")
    return path


def _rows(rows: Rows) -> str:
    width = max(len(row) for row in rows)
    cells = [[row[0], *row[1:-1], *[""] * (width - len(row)), row[-1]] for row in rows]
    names = ["", *GEARS, ""] if width == 4 else []
    return table(names, [[escape(cell) for cell in row] for row in cells])


def _drawing(pair: Pair) -> Figure:
    figure, ((axes,),) = new_figure(1, 1, (4.6, 2.9))
    draw_teeth(axes, pair)
    return figure


def draw_teeth(axes: Axes, pair: Pair, phase: float = 0.0) -> Axes:
    """Draw the teeth of both gears at a mesh phase, with the path of contact and the contact points."""
    drawn = mesh(pair)
    for outline, colour in zip(drawn.at(phase), ("#56B4E9", "#E69F00"), strict=True):
        axes.fill(*outline.T, facecolor=colour, alpha=0.45, edgecolor="0.15", lw=1.0)
    axes.plot(*drawn.on_path(np.array(drawn.path)).T, color=BLUE, ls="--", lw=1.2)
    axes.plot(*drawn.contacts(phase).T, "o", color=ORANGE, mec="white", ms=6)
    middle = float(drawn.on_path(np.array([pair.meshing.pitch_point]))[0, 1])
    half = 1.15 * max(gear.tooth_height for gear in pair.gears) + 0.15 * drawn.pitch
    axes.set(xlim=(-1.35 * half, 1.35 * half), ylim=(middle - half, middle + half), xlabel="x [mm]", ylabel="y [mm]")
    axes.set_aspect("equal")
    return axes


def _curves(dataset: xr.Dataset) -> Figure:
    figure, ((upper,), (lower,)) = new_figure(2, 1, (4.6, 3.6), sharex=True)
    over_two_periods(dataset, "transmission_error", upper).set(xlabel="")
    over_two_periods(dataset, "mesh_stiffness", lower, ORANGE)
    upper.set_title("static transmission error", fontsize=10)
    lower.set_title("mesh stiffness", fontsize=10)
    return figure


def _orders(dataset: xr.Dataset) -> Figure:
    figure, ((left, right),) = new_figure(1, 2, (10.0, 2.4))
    for axes, name in ((left, "transmission_error"), (right, "mesh_stiffness")):
        order_spectrum(dataset, name, axes)
    return figure


def _maps(dataset: xr.Dataset) -> Figure:
    figure, (both,) = new_figure(1, 2, (10.5, 3.6))
    for index, axes in enumerate(both):
        load_map(dataset, index, axes).set_title(GEARS[index], fontsize=10)
    return figure
