"""Picture of the finite elements of a reference: their cross-section, drawn with matplotlib."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.lazy import Figure, xr
from gearbench.scene_file import parse_scene
from gearbench.validation.reference import finite_elements
from gearbench.validation.sets import members, meshes_of

if TYPE_CHECKING:
    from fem_reference.sector import Section

#: Colours of the loaded flank and of the held boundary.
LOADED, HELD = "#E69F00", "#0072B2"


def draw_section(section: Section, axes: Any) -> None:
    """Draw the quadrilaterals of a section [mm], with loaded flank and held boundary in colour."""
    from matplotlib.collections import LineCollection

    x, zero = np.linspace(0.0, 1.0, 9), np.zeros(9)
    sides = [(x, zero), (x, zero + 1), (zero, x), (zero + 1, x)]
    lines = np.array([[at(*side)[:2] for side in sides] for at in section.maps])  # (quadrilateral, side, R or θ, point)
    R, theta = lines[:, :, 0], lines[:, :, 1]
    points = np.stack([R * np.sin(theta), R * np.cos(theta)], axis=-1)
    held = np.all(section.held_radius * (1 + 1e-9) >= R, axis=-1)
    loaded = points[: len(section.grain.flank) - 1, 3]
    for chosen, colour, width in (
        (points.reshape(-1, 9, 2), "0.35", 0.6),
        (points[held], HELD, 2),
        (loaded, LOADED, 2),
    ):
        axes.add_collection(LineCollection(list(chosen), colors=colour, linewidths=width))
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set(xlabel="x [mm]", ylabel="y [mm]")


def mesh_figure(dataset: xr.Dataset) -> Figure:
    """Figure of the sections of the gears at the finest level, with loaded flank and held boundary in colour."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    from fem_reference.sector import Grain, Section

    meshes = meshes_of(parse_scene(tomllib.loads(dataset.attrs["reference_scene"])))
    gears = members(meshes)
    figure = Figure(figsize=(4.75 * len(gears), 4.8))
    for number, (name, mesh, index) in enumerate(gears):
        of_gear, reference = dataset.isel(gear=number), meshes[mesh]
        body = finite_elements(reference).body(reference.pair, index, reference.effects_by_name)
        section = Section(body=body, grain=Grain(degree=2))  # all levels have the same quadrilaterals
        axes = figure.add_subplot(1, len(gears), number + 1)
        draw_section(section, axes)
        axes.tick_params(axis="x", rotation=90)  # a sector may be narrower than the tick labels
        unknowns, error = int(of_gear["reference_unknowns"]), float(of_gear["reference_error"])
        axes.set_title(
            f"{name}: {len(section.maps)} quadrilaterals, {unknowns} unknowns,\nestimated error {100 * error:.2g} %",
            fontsize=10,
        )
    patches = [Patch(color=LOADED, label="loaded flank"), Patch(color=HELD, label="held")]
    figure.legend(handles=patches, loc="lower center", ncols=2, frameon=False)
    figure.subplots_adjust(left=0.08, right=0.98, top=0.88, bottom=0.18, wspace=0.2)
    return figure
