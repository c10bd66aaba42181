"""Figures of the keys of a pair, and of what changes from tooth to tooth; each drawn from geometry and effects."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.pitch_errors import PitchErrors
from gearbench.effects.waviness import Waviness
from gearbench.geometry.action import ContactLines
from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.thickness import over_balls, span
from gearbench.geometry.tooth_shapes import outline, turn
from gearbench.geometry.web import make_web
from gearbench.plotting import legend_below
from gearbench.schema import read

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gearbench.effects.base import GapEffect

BLUE, ORANGE, GREEN, DARK, PALE = "#0072B2", "#E69F00", "#009E73", "#333333", "#cfe0ee"
_DIMENSION = {"arrowstyle": "<|-|>", "lw": 1.0, "color": DARK, "shrinkA": 0, "shrinkB": 0}


def draw_pair(path: Path) -> None:
    """Write the figure of the keys of a pair."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 3, figsize=(12.0, 8.0), layout="constrained")
    for axis, panel in zip(axes.flat, (protuberance, tip_edge, faces, over_span, balls, web), strict=True):
        panel(axis)
        axis.set_aspect("equal")
        axis.axis("off")
    figure.savefig(path, dpi=100, bbox_inches="tight")
    plt.close(figure)


def gear(**keys: Any) -> Gear:
    """A spur gear of 4 mm module."""
    section = {"normal_module": 4.0, "pressure_angle": 20.0, "helix_angle": 0.0, "face_width": 30.0}
    rest = {"teeth": 20, "profile_shift": 0.0, "addendum": 1.0, "dedendum": 1.4, "fillet_radius": 0.3}
    return Gear(**{**section, **rest, **keys})


def protuberance(axis: Axes) -> None:
    """Fillet of a tool with protuberance: cut into the flank that is ground."""
    stock, ground = 0.35, gear(protuberance=0.25)
    half = ground.flank_points(60, 60)
    axis.fill(*np.concatenate([half, half[::-1] * [-1, 1]]).T, color=PALE)
    axis.plot(*half.T, color=BLUE, lw=1.8)
    radius = np.linspace(ground.root_radius + 1.0, ground.tip_radius, 80)
    left = ground.involute_half_angle(np.maximum(radius, ground.base_radius)) + stock / ground.base_radius
    cut = radius[:, None] * np.column_stack([np.sin(left), np.cos(left)])
    cut = cut[radius > ground.form_radius + 0.2]
    axis.plot(*cut.T, color=ORANGE, lw=1.5, ls="--")
    at = 0.6 * ground.tip_radius + 0.4 * ground.form_radius
    x = at * math.sin(float(ground.involute_half_angle(at)))
    axis.annotate("q", (x + 2.2, at), fontsize=12, va="center")
    axis.annotate("", (x + 0.4, at), (x + 2.0, at), arrowprops={"arrowstyle": "-|>", "color": DARK})
    axis.annotate("", (x, at), (x - 1.6, at), arrowprops={"arrowstyle": "-|>", "color": DARK})
    deep = half[np.argmin(np.abs(np.hypot(*half.T) - 0.5 * (ground.form_radius + ground.root_radius)))]
    axis.annotate("cut deeper than the flank\nby $pr_{P0} - q$", deep, (deep[0] + 1.5, deep[1] - 0.6), fontsize=10,
                  va="center", arrowprops={"arrowstyle": "->", "color": DARK})  # fmt: skip
    form = half[np.argmin(np.abs(np.hypot(*half.T) - ground.form_radius))]
    axis.plot(*form, "o", color=BLUE, ms=5)
    axis.annotate("form circle", (form[0] - 0.3, form[1]), fontsize=10, va="center", ha="right")
    axis.set(xlim=(-1.5, 11.0), ylim=(ground.root_radius - 1.0, ground.tip_radius + 0.6))
    axis.set_title("protuberance $pr_{P0}$, grinding_stock q:\nas cut (dashed), and ground", fontsize=11)


def tip_edge(axis: Axes) -> None:
    """Rounded, chamfered and sharp tip, side by side."""
    apart = 6.2
    for i, (key, name, size) in enumerate((("tip_rounding", "ρ", 0.9), ("tip_chamfer", "h", 0.4), ("", "", 0.0))):
        one = gear(**({key: size} if key else {}))
        radius = np.linspace(one.form_radius, one.tip_form_radius, 60)
        half = radius[:, None] * np.column_stack([np.sin(psi := one.half_angle(radius)), np.cos(psi)])
        half = np.concatenate([half, _edge(one, half[-1])])
        angle = np.linspace(math.atan2(*half[-1]), 0.0, 20)
        half = np.concatenate([half, one.tip_radius * np.column_stack([np.sin(angle), np.cos(angle)])])
        whole = np.concatenate([half, half[::-1] * [-1, 1]]) + np.array([i * apart, 0.0])
        axis.fill(*whole.T, color=PALE)
        axis.plot(*whole.T, color=BLUE, lw=1.8)
        begin = whole[59]
        axis.plot(*begin, "o", color=BLUE, ms=5)
        axis.annotate(key or "neither", (i * apart, one.tip_radius - 2.2), ha="center", fontsize=9)
        if name:
            axis.annotate(name, begin + np.array([0.15, 0.2]), fontsize=12)
    high = gear().tip_radius
    axis.set(xlim=(-2.6, 2 * apart + 2.6), ylim=(high - 3.0, high + 0.4))
    axis.set_title("tip_rounding, tip_chamfer [mm]:\nthe involute ends at the dot", fontsize=11)


def _edge(one: Gear, last: NDArray) -> NDArray:
    """From the last point of the involute to the tip circle, (point, 2)."""
    tangent = _flank_direction(one, one.tip_form_radius)
    if one.tip_rounding:
        outward = np.array([tangent[1], -tangent[0]])
        centre = last - one.tip_rounding * outward
        start, end = math.atan2(*outward[::-1]), math.atan2(*centre[::-1])
        angle = np.linspace(start, end, 30)
        return centre + one.tip_rounding * np.column_stack([np.cos(angle), np.sin(angle)])
    if one.tip_chamfer:
        inward = turn(tangent[None], -math.pi / 4)[0]
        length = np.linspace(0.0, 10 * one.tip_chamfer, 1000)
        points = last + length[:, None] * inward
        return points[np.hypot(*points.T) <= one.tip_radius]
    return last[None]


def _flank_direction(one: Gear, radius: float) -> NDArray:
    """Direction of the right flank towards the tip, (2,)."""
    two = np.array([radius - 1e-4, radius])
    psi = one.half_angle(two)
    step = np.diff(two[:, None] * np.column_stack([np.sin(psi), np.cos(psi)]), axis=0)[0]
    return step / np.hypot(*step)


def faces(axis: Axes) -> None:
    """Faces of their own, one beside the other."""
    keys = {"normal_module": 2.0, "face_width": 20.0, "centre_distance": 60.0}
    pinion, wheel = Member(teeth=24, face_width=24.0, axial_offset=1.0), Member(teeth=36, axial_offset=-2.5)
    one = Pair(**keys, pinion=pinion, wheel=wheel)
    for (low, high), bottom, height, name in zip(one.faces.ends, (0.0, 9.0), (7.0, 11.0), ("b_1", "b_2"), strict=True):
        axis.fill_between([low, high], bottom, bottom + height, facecolor=PALE, edgecolor=BLUE, lw=1.8)
        axis.plot([(low + high) / 2] * 2, [bottom - 0.6, bottom + height + 0.6], color=DARK, lw=0.9, ls="-.")
        axis.annotate("", (high, bottom + height / 2), (low, bottom + height / 2), arrowprops=_DIMENSION)
        axis.annotate(f"${name}$", (low + 2.0, bottom + height / 2 + 0.3), fontsize=12)
    low, high = one.faces.common
    axis.fill_between([low, high], 7.0, 9.0, color=GREEN, alpha=0.35)
    axis.annotate("y = 0 … b", ((low + high) / 2, 8.0), ha="center", va="center", fontsize=10)
    axis.plot([0, 0], [-4.5, 21.5], color=ORANGE, lw=1.2)
    axis.annotate("middle of\nthe pair's face", (0, -6.6), ha="center", fontsize=9, color=ORANGE)
    for (start, end), at in zip(one.faces.ends, (-1.6, 21.2), strict=True):
        middle = (start + end) / 2
        axis.annotate("", (middle, at), (0, at), arrowprops={"arrowstyle": "-|>", "color": DARK, "lw": 1.6})
    axis.annotate("axial_offset, pinion", (1.6, -1.6), va="center", fontsize=9)
    axis.annotate("axial_offset, wheel", (-3.0, 21.2), va="center", ha="right", fontsize=9)
    axis.set(xlim=(-16, 16), ylim=(-7.5, 23))
    axis.set_title("face_width, axial_offset of each gear:\nteeth touch where both have them", fontsize=11)


def over_span(axis: Axes) -> None:
    """W_k over three teeth, a tangent of the base circle."""
    one, k = gear(dedendum=1.25, fillet_radius=0.38), 3
    axis.fill(*outline(one, 2).T, facecolor=PALE, edgecolor=BLUE, lw=1.2)
    half = span(one, one.profile_shift, k) / 2
    angle = np.linspace(-0.55, 0.55, 60)
    axis.plot(*(one.base_radius * np.array([np.sin(angle), np.cos(angle)])), color=GREEN, lw=1.0, ls="--")
    r_b = one.base_radius
    for side in (-1, 1):
        axis.plot([side * half] * 2, [r_b - 4.0, r_b + 9.5], color=ORANGE, lw=2.5)
        axis.plot(side * half, r_b, "o", color=DARK, ms=4)
    axis.plot([-half, half], [r_b, r_b], color=DARK, lw=0.8, ls=":")
    axis.annotate("", (half, r_b + 8.5), (-half, r_b + 8.5), arrowprops=_DIMENSION)
    axis.annotate("$W_3$", (0, r_b + 9.0), ha="center", fontsize=12)
    axis.annotate("base circle", (-22.0, r_b - 6.0), fontsize=9, color=GREEN)
    axis.set(xlim=(-26, 26), ylim=(r_b - 12, r_b + 12))
    axis.set_title("thickness.span over span_teeth:\n$W_k$ is a tangent of the base circle (G13)", fontsize=11)


def balls(axis: Axes) -> None:
    """M_dK over two balls, opposite each other."""
    one, diameter = gear(teeth=12, profile_shift=0.3, dedendum=1.25, fillet_radius=0.38), 7.0
    teeth = outline(one, one.teeth // 2)[: -3 * one.teeth]  # without the inner edge of the strip of body
    axis.fill(*turn(teeth, math.pi / one.teeth).T, facecolor=PALE, edgecolor=BLUE, lw=1.0)
    size = over_balls(one, one.profile_shift, diameter)
    from matplotlib.patches import Circle

    for side in (-1, 1):
        axis.add_patch(Circle((0, side * (size - diameter) / 2), diameter / 2, color=ORANGE, alpha=0.8))
        axis.plot([0, 36], [side * size / 2] * 2, color=DARK, lw=0.7)
    axis.annotate("", (34, size / 2), (34, -size / 2), arrowprops=_DIMENSION)
    axis.annotate("$M_{dK}$", (35.5, 0), fontsize=12, va="center")
    axis.annotate("$D_M$", (0, (size - diameter) / 2), fontsize=10, ha="center", va="center")
    axis.set(xlim=(-33, 46), ylim=(-38, 38))
    axis.set_title("thickness.over_balls, over_pins of measuring_diameter:\n$M_{dK}$, $M_{dR}$ (G14)", fontsize=11)


def web(axis: Axes) -> None:
    """Axial section of a body of rim, web and hub, upper half."""
    one, b = gear(teeth=60, face_width=36.0), 36.0
    made = make_web(one, 50.0, rim_thickness=9.0, thickness=8.0, offset=5.0, hub=90.0)
    for low, high, left, right in (
        (made.rim_radius, one.root_radius, 0.0, b),
        (made.hub_radius, made.rim_radius, made.start, made.stop),
        (25.0, made.hub_radius, 0.0, b),
    ):
        axis.fill_between([left, right], low, high, facecolor=PALE, edgecolor=BLUE, lw=1.5)
    axis.fill_between([0, b], one.root_radius, one.tip_radius, facecolor="white", edgecolor=BLUE, lw=1.0, hatch="///")
    axis.plot([-6, b + 6], [0, 0], color=DARK, lw=0.9, ls="-.")
    axis.plot([b / 2] * 2, [18, one.tip_radius + 5], color=ORANGE, lw=1.0, ls="-.")
    middle = (made.start + made.stop) / 2
    axis.plot([middle] * 2, [made.hub_radius - 4, made.rim_radius + 3], color=DARK, lw=0.9, ls="-.")
    axis.annotate("", (made.stop, 70), (made.start, 70), arrowprops=_DIMENSION)
    axis.annotate("web_thickness", (made.stop + 1, 70), fontsize=9, va="center")
    axis.annotate("", (middle, 58), (b / 2, 58), arrowprops={"arrowstyle": "-|>", "color": DARK, "lw": 1.4})
    axis.annotate("web_offset", (b / 2 - 1.5, 58), fontsize=9, ha="right", va="center")
    axis.annotate("", (-3, one.root_radius), (-3, made.rim_radius), arrowprops=_DIMENSION)
    axis.annotate("rim_thickness", (-4, (one.root_radius + made.rim_radius) / 2), fontsize=9, ha="right", va="center")
    for radius, text, at in ((made.hub_radius, "hub_diameter / 2", -6), (25.0, "bore_diameter / 2", b + 4)):
        axis.annotate("", (at, radius), (at, 0), arrowprops=_DIMENSION)
        side = "right" if at < 0 else "left"
        axis.annotate(text, (at + math.copysign(1.5, at), radius / 2), fontsize=9, ha=side, va="center")
    axis.annotate("y = 0", (0, one.tip_radius + 1.5), fontsize=9, ha="center")
    axis.annotate("y = b", (b, one.tip_radius + 1.5), fontsize=9, ha="center")
    axis.set(xlim=(-42, b + 45), ylim=(-4, one.tip_radius + 8))
    axis.set_title("rim_thickness, web_thickness, web_offset,\nhub_diameter, bore_diameter", fontsize=11)


def draw_turning(path: Path) -> None:
    """Write the figure of gaps over two revolutions of the pinion: run-out, wobble, a ghost order, pitch errors."""
    import matplotlib.pyplot as plt

    z = 24
    pair = Pair(
        normal_module=3.0, face_width=24.0, centre_distance=90.0, pinion=Member(teeth=z), wheel=Member(teeth=36)
    )
    steps = np.cumsum(np.random.default_rng(3).normal(0.0, 2.5, z))
    panels: list[tuple[str, GapEffect]] = [
        ("run-out: order 1, even over the face", wave(order=1, amplitude=8.0)),
        ("wobble: order 1, tilting over the face", wave(order=1, amplitude=8.0, over_face="tilting")),
        ("ghost order: order 7", wave(order=7, amplitude=3.0, phase=40.0)),
        ("pitch_errors: each tooth by its own amount", PitchErrors(pinion=tuple(steps - steps.mean()))),
    ]
    figure, axes = plt.subplots(2, 2, figsize=(11.0, 5.6), layout="constrained", sharex=True)
    for axis, (title, effect) in zip(axes.flat, panels, strict=True):
        for share, name, colour in ((0.0, "y = 0", BLUE), (1.0, "y = b", ORANGE)):
            turns, gap = over_turns(pair, effect, share * pair.face_width, 2 * z)
            axis.plot(turns, gap, color=colour, lw=1.6, label=name, ls="-" if share == 0 else "--")
        axis.axhline(0.0, color=DARK, lw=0.6)
        axis.axvline(1.0, color=DARK, lw=0.6, ls=":")
        axis.set_title(title, fontsize=11)
        axis.set_ylabel("gap e [µm]")
        axis.set_xlim(0, 2)
    for axis in axes[1]:
        axis.set_xlabel("revolutions of the pinion")
    legend_below(figure, axes[0, 1], 2)
    figure.savefig(path, dpi=100, bbox_inches="tight")
    plt.close(figure)


def wave(**keys: Any) -> Waviness:
    """One wave of the pinion."""
    return read(Waviness, {"pinion": [keys]})


def over_turns(pair: Pair, effect: GapEffect, y: float, cycles: int) -> tuple[NDArray, NDArray]:
    """Revolutions of the pinion and the gap [µm] of the pair k = 0 of every mesh cycle at y, middle of the path."""
    phase = np.linspace(0.0, 1.0, 41)
    u = 0.5 * (pair.meshing.path_start + pair.meshing.path_end)
    whole = np.ones((len(phase), 1, 1))
    lines = ContactLines(
        pair=pair, mesh_phase=phase, index=np.zeros(1, int), u=u * whole, y=y * whole, length=whole
    )  # fmt: skip
    found = effect.turning(lines, np.arange(cycles))
    assert found is not None
    gap = 1e3 * np.einsum("nm,pm->np", found.amounts, found.modes[:, 0, 0, :])
    return ((np.arange(cycles)[:, None] + phase) / pair.gears[0].teeth).ravel(), gap.ravel()
