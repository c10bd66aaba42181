"""The figures of conventions, keys of a pair and panels: ``python -m docs.draw``, from geometry and solutions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from docs.draw_flanks import draw
from docs.draw_pair import draw_pair, draw_turning
from docs.draw_panels import draw_panels
from gearbench.geometry.action import contact_lines
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.tooth_shapes import mesh

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FOLDER = Path(__file__).parent / "figures"
PHASE = 0.25
PINION, WHEEL, LINE, DARK = "#0072B2", "#E69F00", "#009E73", "#333333"

#: Few teeth and a large helix angle, so that everything can be seen.
PAIR = Pair(
    normal_module=4.0,
    helix_angle=15.0,
    face_width=40.0,
    centre_distance=82.8,
    pinion=Member(teeth=17),
    wheel=Member(teeth=23),
)


def main(folder: Path = FOLDER) -> None:
    """Draw the transverse section and the plane of action side by side."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11.5, 5.6), layout="constrained", width_ratios=(1.15, 1))
    transverse(left)
    plane_of_action(right)
    figure.savefig(folder / "axes.png", dpi=110)
    plt.close(figure)
    draw(folder / "micro_geometry.png")
    draw_pair(folder / "pair.png")
    draw_turning(folder / "turning.png")
    draw_panels(folder / "panels.png")


def transverse(axis: Axes) -> None:
    """Both gears in mesh, seen from y = 0 towards y = b."""
    teeth, pair = mesh(PAIR), PAIR
    pinion, wheel = teeth.at(PHASE)
    axis.fill(*pinion.T, facecolor=PINION, alpha=0.25, edgecolor=PINION)
    axis.fill(*wheel.T, facecolor=WHEEL, alpha=0.25, edgecolor=WHEEL)
    ends = teeth.on_path(np.array([0.0, pair.meshing.tangent_length]))
    axis.plot(*ends.T, color=DARK, lw=1)
    for point, name, shift in zip(ends, ("$T_1$", "$T_2$"), ((-3.5, -3.0), (1.0, 1.0)), strict=True):
        axis.plot(*point, "o", color=DARK, ms=4)
        axis.annotate(name, point + shift, fontsize=12)
    path = teeth.on_path(np.array([pair.meshing.path_start, pair.meshing.path_end]))
    axis.plot(*path.T, color=LINE, lw=4, solid_capstyle="butt", label="path of contact, $u_A$ to $u_E$")
    for point, name, shift in zip(path, ("$u_A$", "$u_E$"), ((-4.6, 0.4), (0.2, -3.6)), strict=True):
        axis.annotate(name, point + shift, color=LINE, fontsize=13)
    contacts = teeth.contacts(PHASE)
    axis.plot(*contacts.T, "o", color="white", mec=DARK, ms=7, label="contact, middle of the face")
    direction = ends[1] - ends[0]
    start = ends[0] + 0.02 * direction
    axis.annotate("", start + 0.16 * direction, start, arrowprops={"arrowstyle": "-|>", "lw": 1.8, "color": DARK})
    axis.annotate("u", start + 0.13 * direction + (1.2, -3.6), fontsize=13)
    _turning(axis, 0.0, pair.gears[0].root_radius - 6, "pinion drives", PINION, clockwise=True)
    _turning(axis, pair.centre_distance, pair.gears[1].root_radius - 6, "wheel is driven", WHEEL, clockwise=False)
    middle = teeth.on_path(np.array([pair.meshing.pitch_point]))[0]
    axis.set(xlim=(middle[0] - 34, middle[0] + 34), ylim=(middle[1] - 27, middle[1] + 27), aspect="equal")
    axis.set(xlabel="in the transverse plane [mm]", ylabel="along the line of centres, from the pinion's centre [mm]")
    axis.set_title("u counts along the path of contact, from T₁ to T₂", fontsize=12)
    axis.legend(loc="upper right", fontsize=10, framealpha=0.9)


def _turning(axis: Axes, centre: float, radius: float, text: str, colour: str, *, clockwise: bool) -> None:
    """Arrow of rotation inside a gear."""
    around = np.radians(np.linspace(118, 62, 40) if clockwise else np.linspace(-118, -62, 40))
    x, y = radius * np.cos(around), centre + radius * np.sin(around)
    axis.plot(x, y, color=colour, lw=2)
    axis.annotate("", (x[-1], y[-1]), (x[-4], y[-4]), arrowprops={"arrowstyle": "-|>", "lw": 2, "color": colour})
    below = -4.0 if clockwise else 2.0
    axis.annotate(text, (0, centre + math.copysign(radius, 1 if clockwise else -1) + below), color=colour, ha="center")


def plane_of_action(axis: Axes) -> None:
    """Contact lines on the base tangent plane."""
    pair = PAIR
    lines = contact_lines(pair, np.array([PHASE]), 200)
    corners = np.array(
        [[pair.meshing.path_start, 0], [pair.meshing.path_end, 0], [pair.meshing.path_end, pair.face_width]]
    )
    low, size = corners[0], (pair.meshing.path_end - pair.meshing.path_start, pair.face_width)
    from matplotlib.patches import Rectangle

    axis.add_patch(Rectangle((low[0], low[1]), *size, facecolor="#f2f2f2", edgecolor=DARK))
    for i, k in enumerate(lines.index):
        if lines.active[0, i]:
            u, y = lines.u[0, i], lines.y[0, i]
            axis.plot(u, y, color=LINE, lw=3)
            middle = len(u) // 2
            inside = u[middle] < pair.meshing.path_end - 1.5
            position = {"xytext": (10 if inside else -10, 0), "textcoords": "offset points", "va": "center"}
            side = "left" if inside else "right"
            axis.annotate(f"k = {k}", (u[middle], y[middle]), ha=side, fontsize=11, color=LINE, **position)
    at = 0.5 * pair.face_width
    start = pair.meshing.path_start + 0.12 * size[0]
    axis.annotate("", (start + 0.2 * size[0], 0.9 * at), (start, 0.9 * at), arrowprops={"arrowstyle": "-|>", "lw": 1.5})
    axis.annotate("lines move\nas τ grows", (start, 0.92 * at), fontsize=10, va="bottom")
    slope = pair.meshing.base_pitch * (PHASE - 1)
    first = pair.meshing.path_start + slope + pair.meshing.base_pitch * math.ceil(-slope / pair.meshing.base_pitch)
    if first + pair.meshing.base_pitch <= pair.meshing.path_end:
        arrow = {"arrowstyle": "<|-|>", "lw": 1.2, "color": DARK}
        axis.annotate(
            "", (first + pair.meshing.base_pitch, -2.2), (first, -2.2), arrowprops=arrow, annotation_clip=False
        )
        axis.annotate("$p_{bt}$", (first + pair.meshing.base_pitch / 2, -2.0), ha="center", va="bottom", fontsize=12)
    axis.set(xlim=(low[0] - 1.5, low[0] + size[0] + 1.5), ylim=(-5, pair.face_width + 3))
    axis.set_xticks(
        [pair.meshing.path_start, pair.meshing.pitch_point, pair.meshing.path_end], ["$u_A$", "pitch\npoint", "$u_E$"]
    )
    axis.set(xlabel="u along the path of contact [mm]", ylabel="y along the face width [mm]")
    axis.set_title(f"Contact lines of the pairs k at τ = {PHASE}", fontsize=12)


if __name__ == "__main__":
    main()
