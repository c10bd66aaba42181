"""Claims 1 and 2 of Benatar, Handschuh, Kahraman and Talbot 2019, measured on helical pairs: the response is linear,
without loss of contact, and the dynamic transmission error is nearly proportional to the static one.
"""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import nonlinear_response, response, simulate
from gearbench.scene_file import parse_scene

#: Micro-geometries and torques of the comparison: reliefs [µm], crowning [µm], torque [N·m].
DESIGNS = ((0.0, 0.0, 150.0), (10.0, 0.0, 150.0), (20.0, 0.0, 150.0), (20.0, 10.0, 150.0), (10.0, 5.0, 300.0))
SPEEDS = np.linspace(1000.0, 9000.0, 17)


def scene(relief, crowning, torque):
    effects = {"tooth_bending": {"model": "solid"}, "hertz": {}}
    if relief:
        effects["tip_relief"] = {"amount": relief, "length": 1.6}
    if crowning:
        effects["crowning"] = {"amount": crowning}
    return parse_scene(
        {
            "pair": {
                "normal_module": 3.0,
                "helix_angle": 15.0,
                "face_width": 24.0,
                "centre_distance": 93.5,
                "backlash": 0.15,
                "pinion": {"teeth": 24},
                "wheel": {"teeth": 36},
            },
            "load": {"torque": torque},
            "effects": effects,
            "system": {"damping_ratio": 0.05},
        }
    )


@cache
def answers(design):
    one = scene(*DESIGNS[design])
    return one, response(one, speed=SPEEDS, harmonics=6), simulate(one)


@pytest.mark.parametrize("design", [0, 3, 4])
def test_response_of_helical_pairs_is_linear(design):
    """Claim 1: contact is kept at all speeds; with the whole force curve the answer is the same to a tenth."""
    one, linear, _ = answers(design)
    assert bool(linear["contact_kept"].all())
    whole = nonlinear_response(one, speed=SPEEDS, harmonics=6)
    assert bool(whole["contact_kept"].all())
    name = "dynamic_transmission_error_rms"
    up, down = (whole[name].sel(sweep=way).values for way in ("up", "down"))
    assert_allclose(up, down, rtol=1e-6)
    assert_allclose(up, linear[name].values, atol=0.1 * float(linear[name].max()))


def test_dynamic_error_is_nearly_proportional_to_the_static_one():
    """Claim 2: below resonance the ratio of the first orders is one function of speed for all designs, to 22 %.

    The static error itself varies between them by a factor of more than three. They differ where the second order is
    near resonance, at half its frequency, and the varying stiffness feeds it back to the first: below, 7 %. Tip circles
    0.1 mm smaller, with less contact ratio, make 13 % of the 22 %.
    """
    ratios, static, resonance = [], [], []
    for design in range(len(DESIGNS)):
        _, data, still = answers(design)
        static.append(float(still["transmission_error_amplitude"].sel(harmonic=1)))
        dynamic = data["dynamic_transmission_error_amplitude"].sel(harmonic=1, mesh="pair").values
        ratios.append(dynamic / static[-1])
        resonance.append(float(data["natural_frequency"][-1]))
    below = 0.7 * min(resonance) > SPEEDS * 24 / 60
    quiet = 0.38 * min(resonance) > SPEEDS * 24 / 60
    assert below.sum() > 10
    assert quiet.sum() > 10
    assert max(static) > 3 * min(static)
    for ratio in ratios[1:]:
        assert_allclose(ratio[below], ratios[0][below], rtol=0.22)
        assert_allclose(ratio[quiet], ratios[0][quiet], rtol=0.07)
