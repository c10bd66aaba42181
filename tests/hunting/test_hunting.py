"""Hunting cycles: every mesh cycle as if simulated for itself, and the sidebands that follow from teeth and waves."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import hunting_cycle, simulate
from gearbench.effects.waviness import Wave, Waviness
from gearbench.errors import InputError
from gearbench.scene_file import parse_scene

RNG = np.random.default_rng(7)
PITCH = {"pinion": RNG.normal(0, 2.0, 7).round(2).tolist(), "wheel": RNG.normal(0, 2.0, 11).round(2).tolist()}


def scene(effects, helix=0.0, law="weber_banaschek", **resolution):
    distance = 9 * 4 / math.cos(math.radians(helix)) + 0.3
    return parse_scene({
        "pair": {
            "normal_module": 4.0, "pressure_angle": 25.0, "helix_angle": helix, "face_width": 30.0,
            "centre_distance": distance,
            "pinion": {"teeth": 7, "profile_shift": 0.3}, "wheel": {"teeth": 11},
        },
        "load": {"torque": 200.0},
        "resolution": resolution or {"gauss_points": 6},
        "effects": {"tooth_bending": {"order": [4, 4]}, "hertz": {"law": law}, **effects},
    })  # fmt: skip


def brute_force(made, cycles):
    """Each mesh cycle simulated for itself."""
    found = []
    for n in cycles:
        later = tuple(
            replace(e, pinion_tooth=n % 7, wheel_tooth=n % 11) if e.name == "pitch_errors"
            else Waviness(**{
                gear: tuple(
                    Wave(order=w.order, amplitude=w.amplitude, over_face=w.over_face,
                         phase=(w.phase + 360.0 * w.order * n / z) % 360.0)
                    for w in getattr(e, gear)
                )
                for gear, z in (("pinion", 7), ("wheel", 11))
            }) if e.name == "waviness"
            else e
            for e in made.effects
        )  # fmt: skip
        found.append(simulate(replace(made, effects=later)))
    return found


@pytest.mark.parametrize("helix", [0.0, 15.0])
def test_all_pairs_of_teeth_and_their_side_bands_are_those_of_brute_force(helix):
    """77 mesh cycles, z 7/11, to 1e-9: no two have the same teeth."""
    waves = {"pinion": [{"order": 1, "amplitude": 6.0}], "wheel": [{"order": 5, "amplitude": 0.7, "phase": 40.0}]}
    made = scene({"pitch_errors": PITCH, "waviness": waves}, helix, positions=12)
    whole = hunting_cycle(made)
    assert whole.sizes["cycle"] == 77
    alone = brute_force(made, range(77))
    for name in ("transmission_error", "mesh_stiffness"):
        wanted = np.array([each[name].values for each in alone])
        assert_allclose(whole[name].values, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
        # equidistant phases of all cycles are one series over 77 mesh periods
        bands = 2 * np.abs(np.fft.rfft(wanted.ravel()))[1:232] / wanted.size
        assert_allclose(whole[f"{name}_order_amplitude"].values[:231], bands, atol=1e-9 * np.abs(wanted).max())


def test_gauss_points_give_the_orders_of_their_polynomials():
    made = scene({"pitch_errors": PITCH}, gauss_points=10)
    whole = hunting_cycle(made, orders=1.0)
    t = np.arange(77)[:, None] + whole["mesh_phase"].values
    weight = np.broadcast_to(whole["phase_weight"].values, t.shape) / 77
    values, order = whole["transmission_error"].values, whole["mesh_order"].values
    direct = [2 * abs(np.sum(weight * values * np.exp(-2j * np.pi * nu * t))) for nu in order]
    # the rule itself against the integral of the polynomial through its points
    assert_allclose(whole["transmission_error_order_amplitude"].values, direct, atol=1e-6 * np.abs(values).max())


def test_a_wave_of_a_pair_without_fluctuation_is_its_order_alone():
    """Even over the face it turns the gear, and nothing else: amplitude a at the order q/z, none beside it."""
    waves = {"pinion": [{"order": 3, "amplitude": 5.0}]}
    made, plain = scene({"waviness": waves}, law="yang_sun"), scene({}, law="yang_sun")
    found, still = hunting_cycle(made), simulate(plain)
    shift = found["transmission_error"].values - still["transmission_error"].values
    t = np.arange(77)[:, None] + found["mesh_phase"].values
    assert_allclose(shift, 5 * np.sin(2 * np.pi * 3 / 7 * t), atol=1e-9)
    amplitude = found["transmission_error_order_amplitude"].values
    at = np.flatnonzero(np.isclose(found["pinion_order"].values, 3.0))[0]
    assert amplitude[at] == pytest.approx(5.0, rel=1e-6)
    below = np.delete(amplitude[:76], at)
    assert below.max() < 1e-5
    assert found["wheel_order"].values[at] == pytest.approx(33 / 7)


def test_wobble_is_solved_as_it_is():
    made = scene({"waviness": {"wheel": [{"order": 1, "amplitude": 1.0, "over_face": "tilting"}]}}, segments=40,
                 gauss_points=4)  # fmt: skip
    found, alone = hunting_cycle(made)["transmission_error"].values, brute_force(made, [0, 4])
    for n, each in zip((0, 4), alone, strict=True):
        # cells are taken as evenly loaded where flanks part within them: second order in their size
        assert_allclose(found[n], each["transmission_error"].values, rtol=1e-4)


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({}, "effects = all teeth are alike: must have pitch_errors, random_pitch or waviness"),
        ({"waviness": {}}, "effects.waviness.pinion = missing: a wave is required"),
        ({"waviness": {"pinion": [{"order": 0, "amplitude": 1.0}]}}, "effects.waviness.pinion.0.order = 0: must be"),
        (
            {"waviness": {"pinion": [{"order": 1, "amplitude": -1.0}]}},
            "effects.waviness.pinion.0.amplitude = -1.0: must",
        ),
    ],
)
def test_bad_values_are_one_line(effects, message):
    with pytest.raises(InputError) as caught:
        hunting_cycle(scene(effects))
    assert str(caught.value).startswith(message)


def test_orders_that_uniform_phases_do_not_give_are_not_there():
    made = scene({"pitch_errors": PITCH}, positions=3)
    whole = hunting_cycle(made)
    assert np.isfinite(whole["transmission_error_order_amplitude"].values).all()
    assert whole["mesh_order"].values[-1] == pytest.approx(115 / 77)  # below half of 3 · 77 points
    with pytest.raises(InputError, match="at least"):
        hunting_cycle(made, orders=0.01)
