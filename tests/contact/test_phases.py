"""Mesh phases: quadrature over the cycle and the order with which its figures converge."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.phases import gauss_phases, uniform_phases
from gearbench.contact.solver import solve
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.hertz import Hertz
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.pair import Member, Pair
from gearbench.results.cycle import fluctuation_rms, mean, relative_rms
from gearbench.scene import Load, Resolution, Scene

SPUR = Pair(normal_module=3.0, face_width=24.0, centre_distance=90.0, pinion=Member(teeth=24), wheel=Member(teeth=36))
HELICAL = replace(SPUR, helix_angle=18.0, centre_distance=94.6)
places = st.lists(st.floats(-3.0, 5.0), min_size=1, max_size=8)


def scene(pair: Pair, **resolution: int) -> Scene:
    effects = (ToothBending(), Hertz())
    return Scene(pair=pair, load=Load(torque=200.0), effects=effects, resolution=Resolution(segments=8, **resolution))


def figures(scene: Scene, phase: NDArray, weight: NDArray) -> NDArray:
    """Mean and RMS of k, mean and RMS of δ."""
    s = solve(assemble(scene, scene_lines(scene, phase)))
    k, d = s.stiffness, s.approach
    return np.array([mean(k, weight), relative_rms(k, weight), mean(d, weight), fluctuation_rms(d, weight)])


@given(places, st.integers(1, 12))
def test_gauss_phases_are_in_the_cycle_and_weights_sum_to_one(transitions, points):
    phase, weight = gauss_phases(transitions, points)
    assert np.all((phase >= 0) & (phase < 1))
    assert np.all(np.diff(phase) > 0)
    assert np.all(weight > 0)
    assert weight.sum() == pytest.approx(1, abs=1e-14)


@given(places, st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_gauss_phases_integrate_polynomials_between_jumps(transitions, points, seed):
    """Degree 2n − 1 on every panel, with jumps between them; a cycle begins with one."""
    edges = np.unique([0.0, *(np.asarray(transitions) % 1.0)])
    edges = edges[np.append(True, np.diff(edges) > 1e-6)]
    edges = edges[:-1] if edges.size > 1 and 1 - edges[-1] < 1e-6 else edges
    phase, weight = gauss_phases(edges, points)
    c = np.random.default_rng(seed).normal(size=(edges.size, 2 * points))
    panel = np.searchsorted(edges, phase, side="right") - 1
    x = phase - edges[panel]
    value = np.sum(c[panel] * x[:, None] ** np.arange(2 * points), axis=1)
    width = np.append(edges[1:], 1.0) - edges
    powers = np.arange(1, 2 * points + 1)
    exact = np.sum(c * width[:, None] ** powers / powers)
    assert_allclose(value @ weight, exact, rtol=0, atol=1e-13 * (1 + np.abs(c).sum()))


@pytest.mark.parametrize("shift", [0.0, 1e-16, -1e-16, 1e-12])
def test_panels_of_no_length_are_left_out(shift):
    phase, weight = gauss_phases([0.25, 0.25 + shift, 0.75, 1.75 + shift], 4)
    assert phase.size == 12
    assert_allclose(weight.sum(), 1, rtol=1e-15)


def test_panels_end_where_a_relief_begins():
    u_kink = np.sqrt((SPUR.gears[0].tip_radius - 1.0) ** 2 - SPUR.gears[0].base_radius ** 2)
    at = (u_kink - SPUR.meshing.path_start) / SPUR.meshing.base_pitch % 1
    relieved = replace(scene(SPUR, gauss_points=1), effects=(Hertz(), TipRelief(amount=5.0, length=1.0, gear="pinion")))
    plain, more = mesh_phases(scene(SPUR, gauss_points=1))[0], mesh_phases(relieved)[0]
    assert more.size == plain.size + 1
    below, above = more[more < at].max(), more[more > at].min()
    edges = [*SPUR.meshing.transition_phases, 1.0]
    low, high = max(e for e in edges if e < at), min(e for e in edges if e > at)
    assert_allclose([below, above], [(low + at) / 2, (at + high) / 2], rtol=1e-12)


# -- orders of convergence, as declared in the docstrings -------------------------------------------------------------
def slope(steps: NDArray, errors: list[float]) -> float:
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


@pytest.mark.parametrize(("pair", "order"), [(SPUR, 1), (HELICAL, 2)], ids=["spur", "helical"])
def test_order_of_uniform_positions(pair, order):
    """First order where k jumps (spur), second where it only has kinks (helical).

    Where the jumps lie between the positions changes with their number, so that the error scatters: the order is that
    of its envelope, the largest error among some numbers in each octave.
    """
    exact = figures(scene(pair), *mesh_phases(scene(pair, gauss_points=30)))
    octaves = 2 ** np.arange(3, 9)
    rng = np.random.default_rng(5)
    errors = []
    for n in octaves:
        some = rng.choice(np.arange(n, 2 * n), size=8, replace=False)
        found = [figures(scene(pair), *uniform_phases(int(N))) for N in some]
        errors.append(np.abs(np.array(found) / exact - 1).max())
    assert slope(octaves, errors) == pytest.approx(-order, abs=0.2)


@pytest.mark.parametrize("points", [1, 2, 3])
def test_order_of_gauss_points_on_panels(points):
    """Panels of the spur pair cut into m equal ones each: order 2n."""
    s = scene(SPUR)
    exact = figures(s, *mesh_phases(scene(SPUR, gauss_points=20)))
    edges = np.append(SPUR.meshing.transition_phases, 1.0 + SPUR.meshing.transition_phases[0])
    cuts = {1: np.array([8, 16, 32]), 2: np.array([6, 12, 24]), 3: np.array([4, 6, 9])}[points]
    errors = []
    for m in cuts:
        fine = np.concatenate([np.linspace(a, b, m + 1)[:-1] for a, b in pairwise(edges)])
        errors.append(np.abs(figures(s, *gauss_phases(fine, points)) / exact - 1).max())
    assert slope(cuts, errors) == pytest.approx(-2 * points, abs=0.2)


@pytest.mark.parametrize(
    ("pair", "decay", "default"), [(SPUR, 1.3, 1e-9), (HELICAL, 0.4, 1e-3)], ids=["spur", "helical"]
)
def test_gauss_points_converge_exponentially(pair, decay, default):
    """Each further point gains digits: at least ``decay`` of them up to 8, where the default stands."""
    exact = figures(scene(pair), *mesh_phases(scene(pair, gauss_points=30)))
    points = np.arange(2, 9)
    errors = [
        np.abs(figures(scene(pair), *mesh_phases(scene(pair, gauss_points=int(n)))) / exact - 1).max() for n in points
    ]
    assert -np.polyfit(points, np.log10(errors), 1)[0] >= decay
    assert errors[-1] <= default
    assert mesh_phases(scene(pair))[0].size == mesh_phases(scene(pair, gauss_points=8))[0].size


def test_kinks_of_a_relief_restore_the_convergence():
    s = replace(scene(SPUR), effects=(ToothBending(), Hertz(), TipRelief(amount=3.0, length=1.0)))
    exact = figures(s, *mesh_phases(replace(s, resolution=Resolution(gauss_points=30, segments=8))))
    with_kinks = figures(s, *mesh_phases(s))
    without = figures(s, *gauss_phases(SPUR.meshing.transition_phases, 8))
    assert np.abs(with_kinks / exact - 1).max() < 1e-10 < 1e-5 < np.abs(without / exact - 1).max()
