"""Gu & Velex 2015, closed-form k(τ) of helical gears, against the same stiffness integrated over our contact lines."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.phases import gauss_phases
from gearbench.effects.hertz import Hertz
from gearbench.geometry.action import contact_lines
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load, Resolution, Scene
from gearbench.simulation import simulate
from tests.support.gu_velex_2015 import relative_stiffness


def pair(helix_angle: float, face_width: float) -> Pair:
    member = Member(teeth=30)
    distance = float(2.0 * 30 / np.cos(np.radians(helix_angle))) * (1 + 1e-12)
    return Pair(
        normal_module=2.0, helix_angle=helix_angle, face_width=face_width, centre_distance=distance,
        pinion=member, wheel=member,
    )  # fmt: skip


PAIRS = {"spur": pair(0.0, 20.0), "narrow": pair(10.0, 15.0), "wide": pair(25.0, 40.0)}


@pytest.mark.parametrize("p", PAIRS.values(), ids=PAIRS.keys())
def test_the_formula_is_a_parabolic_stiffness_integrated_over_the_contact_lines(p):
    """Harmonics n = 1 … 8 of Σ ∫ k′(u) dy with k′ = 1.15 − 0.45 (2s − 1)², mean 1."""
    phase, weight = gauss_phases(p.meshing.transition_phases, 24)
    lines = contact_lines(p, phase, 400)
    s = (lines.u - p.meshing.path_start) / (p.meshing.path_end - p.meshing.path_start)
    stiffness = np.sum((1.15 - 0.45 * (2 * s - 1) ** 2) * lines.length, axis=(1, 2))
    mean = weight @ stiffness
    n = np.arange(1, 9)
    ours = np.exp(-2j * np.pi * np.outer(n, phase)) @ (weight * stiffness) / mean

    a, b = p.meshing.transverse_contact_ratio, p.meshing.overlap_ratio
    exact = 2 * 0.45 / np.pi**2  # 0.0912, printed 0.09
    xi = (0.7 + exact / (n * a) ** 2) * np.sinc(n * a) - exact * np.cos(np.pi * n * a) / (n * a) ** 2
    # their phase counts from the first contact of the pair, at y = b, ours from that at y = 0: τ + ε_β
    expected = xi * np.sinc(n * b) * np.exp(-1j * np.pi * n * (a - b))
    # midpoint rule with 400 segments: 1e-6
    assert_allclose(ours, expected, atol=3e-6)
    printed = relative_stiffness(phase + b, a, b)
    series = 1 + 2 * np.real(np.exp(2j * np.pi * np.outer(phase, n)) @ ours)
    tail = relative_stiffness(phase + b, a, b) - relative_stiffness(phase + b, a, b, terms=8)
    # 0.09 instead of 0.0912 moves each harmonic by less than 0.0012 (1 + 1)/(n ε_α)²
    assert_allclose(printed - tail, series, atol=0.0048 / a**2 * np.sum(1 / n**2))


@pytest.mark.parametrize("overlap", [1, 2])
def test_integer_overlap_ratio_means_no_fluctuation_at_all(overlap):
    trial = pair(20.0, 20.0)
    face_width = 20.0 * overlap / trial.meshing.overlap_ratio
    p = pair(20.0, face_width)
    assert p.meshing.overlap_ratio == pytest.approx(overlap, rel=1e-12)
    assert_allclose(
        relative_stiffness(np.linspace(0, 1, 50), p.meshing.transverse_contact_ratio, overlap), 1.0, atol=1e-12
    )
    scene = Scene(
        pair=p, load=Load(torque=100.0), effects=(Hertz(law="yang_sun"),), resolution=Resolution(positions=97)
    )
    k = simulate(scene, outputs=("mesh_stiffness",))["mesh_stiffness"].values
    assert np.ptp(k) / k.mean() < 1e-9
