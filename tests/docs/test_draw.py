"""Figures of the documentation that are drawn from geometry and effects: what they show is so."""

import math

import numpy as np
import pytest
from matplotlib import pyplot as plt
from numpy.testing import assert_allclose

from docs.draw_flanks import PAIR, SHAPES
from docs.draw_pair import over_span, over_turns, tip_edge, wave
from docs.draw_panels import relieved, solve_at, through_mesh
from gearbench.effects.registry import EFFECTS, effect_class


@pytest.fixture
def axis():
    yield plt.subplots()[1]
    plt.close("all")


def test_every_shape_of_a_flank_has_a_picture():
    """What adds gap, but random errors, and what changes from tooth to tooth, which has a figure of its own."""
    shapes = {name for name in EFFECTS if effect_class(name).summary.startswith("gap: ")}
    drawn = {name for name, _ in SHAPES.values()} | {"manufacturing_errors", "waviness"}
    drawn |= {"pitch_errors", "random_pitch"}
    assert drawn | {"off_line_contact"} == shapes


def test_run_out_and_wobble_are_the_waves_of_theory():
    z, b, cos = PAIR.gears[0].teeth, PAIR.face_width, math.cos(PAIR.meshing.beta_b)
    for keys, y, sign in (
        ({}, 0.0, 1),
        ({}, b, 1),
        ({"over_face": "tilting"}, 0.0, -1),
        ({"over_face": "tilting"}, b, 1),
    ):
        turns, gap = over_turns(PAIR, wave(order=1, amplitude=8.0, **keys), y, 2 * z)
        assert_allclose(gap, sign * 8.0 * cos * np.sin(2 * np.pi * turns), atol=1e-9)
        assert turns[-1] == pytest.approx(2.0)


def test_the_span_touches_the_flanks_where_it_is_drawn(axis):
    """Its measuring faces stand on points of the outline, with the normal of the flank along the tangent."""
    over_span(axis)
    outline = axis.patches[0].get_xy()
    points = [line.get_xydata()[0] for line in axis.lines if line.get_marker() == "o"]
    assert len(points) == 2
    a, b = outline[:-1], outline[1:]
    for point in points:
        # distance from the sides of the polygon
        side = b - a
        length = np.maximum((side**2).sum(axis=1), 1e-12)
        t = np.clip(((point - a) * side).sum(axis=1) / length, 0, 1)
        apart = np.hypot(*(a + t[:, None] * side - point).T)
        assert apart.min() < 0.01  # chords of 16 points a flank
        assert abs(side[apart.argmin()][0] / np.sqrt(length[apart.argmin()])) < 0.1


def test_tip_edges_end_at_the_tip_circle(axis):
    tip_edge(axis)
    for patch, x in zip(axis.patches, (0.0, 6.2, 12.4), strict=True):
        points = patch.get_xy() - [x, 0]
        assert np.hypot(*points.T).max() == pytest.approx(44.0, abs=0.01)
        right = points[: len(points) // 2]
        assert np.all(np.diff(right[:, 1]) > -0.03)  # from the root to the tip, but for the arc of the tip circle


def test_the_stiffness_rises_between_the_ends_of_the_ramp_drawn(axis):
    """From that of two pairs to that of three; half of it and more is there at the load transfer."""
    scene = relieved()
    transfer = through_mesh(axis, scene)
    first, whole = transfer.ends
    before, begun, at, last, after = solve_at(
        scene, np.array([first - 1e-4, first + 1e-4, transfer.x, whole, whole + 1e-3])
    )
    assert before < begun < at < last < after
    assert last - at < 0.5 * (after - before)
    assert after - last < 0.05 * (after - before)
