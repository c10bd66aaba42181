"""The meshing of two gears whose signs also fit an internal wheel, against the textbook's formulas for both."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.geometry.meshing import Meshing, profile_shift_sum
from gearbench.geometry.section import TransverseSection


@dataclass(frozen=True, kw_only=True)
class Sized(TransverseSection):
    """A gear with given circles; those of an internal gear are negative."""

    tip_radius: float
    root_radius: float
    form_radius: float

    @property
    def tip_form_radius(self) -> float:
        """The involute reaches the tip circle."""
        return self.tip_radius


ANGLES = {"normal_module": 2.0, "pressure_angle": 20.0, "helix_angle": 15.0}
R = 1 / math.cos(math.radians(15.0))  # r = R z for a module of 2 mm
PINION = Sized(teeth=20, tip_radius=20 * R + 2, root_radius=20 * R - 2.5, form_radius=19.377, **ANGLES)
RING = Sized(teeth=-60, tip_radius=-60 * R + 2, root_radius=-60 * R - 2.5, form_radius=-60 * R - 2.2, **ANGLES)
INTERNAL = Meshing(gears=(PINION, RING), centre_distance=-40.1 * R, face_width=20.0)  # pyright: ignore


def textbook() -> dict[str, float]:
    """An internal pair with positive sizes: a = r_w2 − r_w1, both flanks curved the same way."""
    alpha_t = math.atan(math.tan(math.radians(20)) / math.cos(math.radians(15)))
    r_b1, r_b2, a = 20 * R * math.cos(alpha_t), 60 * R * math.cos(alpha_t), 40.1 * R
    alpha_wt = math.acos((r_b2 - r_b1) / a)
    between = a * math.sin(alpha_wt)  # from T2 to T1: ρ₂ = ρ₁ + T2T1
    start = math.sqrt((60 * R - 2) ** 2 - r_b2**2) - between
    end = math.sqrt((20 * R + 2) ** 2 - r_b1**2)
    pitch = 2 * math.pi * r_b1 / 20
    return {"r_b2": r_b2, "between": between, "start": start, "end": end, "pitch": pitch, "alpha_wt": alpha_wt}


def test_path_of_contact_of_an_internal_pair():
    book = textbook()
    assert INTERNAL.alpha_wt == pytest.approx(book["alpha_wt"], rel=1e-13)
    assert INTERNAL.tangent_length == pytest.approx(-book["between"], rel=1e-12)
    assert INTERNAL.path_start == pytest.approx(book["start"], rel=1e-12)
    assert INTERNAL.path_end == pytest.approx(book["end"], rel=1e-12)
    assert INTERNAL.transverse_contact_ratio == pytest.approx((book["end"] - book["start"]) / book["pitch"], rel=1e-12)
    assert book["start"] < INTERNAL.pitch_point < book["end"]
    assert INTERNAL.has_interference == (False, False)


def test_fillets_bound_the_path_of_an_internal_pair():
    shallow = replace(RING, form_radius=-60 * R - 0.5)
    reached = Meshing(gears=(PINION, shallow), centre_distance=-40.1 * R, face_width=20.0)  # pyright: ignore
    book = textbook()
    expected = math.sqrt((60 * R + 0.5) ** 2 - book["r_b2"] ** 2) - book["between"]
    assert reached.path_end == pytest.approx(expected, rel=1e-12)
    assert reached.has_interference == (False, True)


def test_radii_curvature_and_clearance_of_an_internal_pair():
    book = textbook()
    u = np.linspace(book["start"], book["end"], 5)
    assert_allclose(INTERNAL.radii(u)[1], -np.hypot(book["r_b2"], u + book["between"]), rtol=1e-13)
    relative = 1 / (1 / u - 1 / (u + book["between"])) / math.cos(INTERNAL.beta_b)
    assert_allclose(INTERNAL.curvature_radius(u), relative, rtol=1e-12)
    (low1, high1), (low2, high2) = INTERNAL.active_radii
    assert_allclose((high1, high2), (20 * R + 2, -60 * R + 2), rtol=1e-12)  # both tips work
    assert 0 < low1 < high1
    assert low2 < high2 < 0
    for index, radii in enumerate(INTERNAL.active_radii):
        ends = [INTERNAL.path_coordinate(index, r) for r in radii]
        assert sorted(ends) == pytest.approx([book["start"], book["end"]], rel=1e-12)
    at_pinion_tip, at_ring_tip = INTERNAL.tip_clearances
    assert at_pinion_tip == pytest.approx(60 * R + 2.5 - 40.1 * R - (20 * R + 2), rel=1e-12)
    assert at_ring_tip == pytest.approx(60 * R - 2 - 40.1 * R - (20 * R - 2.5), rel=1e-12)


@pytest.mark.parametrize("end", [0, 1])
def test_sliding_of_an_internal_pair_is_the_difference_of_the_rolling_velocities(end):
    book = textbook()
    rho1 = (book["start"], book["end"])[end]
    v1, v2 = rho1, (rho1 + book["between"]) * 20 / 60  # ω₁ = 1, both gears turn the same way
    zeta = [gear[end] for gear in INTERNAL.specific_sliding]
    assert zeta == pytest.approx([(v1 - v2) / v1, (v2 - v1) / v2], rel=1e-12)


def test_profile_shifts_of_an_internal_pair_differ_by_what_the_distance_asks_for():
    """At the reference distance the sum is 0; above it r_w2 − r_w1 grows, inv α_wt with it, and x₂ + x₁ < 0."""
    assert profile_shift_sum((PINION, RING), -40 * R) == pytest.approx(0.0, abs=1e-12)
    alpha_t, alpha_wt = PINION.alpha_t, textbook()["alpha_wt"]
    inv = [math.tan(x) - x for x in (alpha_wt, alpha_t)]
    expected = -40 * (inv[0] - inv[1]) / (2 * math.tan(math.radians(20)))
    assert profile_shift_sum((PINION, RING), -40.1 * R) == pytest.approx(expected, rel=1e-9)
    assert expected < 0


def test_earlier_name_of_an_index_says_what_it_is_now():
    with pytest.deprecated_call(match="0 the pinion"):
        from gearbench.geometry.role import Role
    assert (Role.PINION, Role.WHEEL) == (0, 1)
