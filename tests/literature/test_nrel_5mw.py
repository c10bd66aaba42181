"""High-speed stage of the NREL 5 MW turbine; a commercial program's report of 2017, ISO 6336:2006 method B.

Printed: c_γα 18.632 N/(mm·µm), m_red 0.36503 kg/mm, n_E1 2843 1/min, K_V 1.092 (accuracy, speed and K_A not printed;
the turbine's generator turns at 1173.7 1/min).
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.dynamics.analysis import response
from gearbench.dynamics.modes import modes
from gearbench.scene_file import parse_scene
from tests.systems import wheels

Z, B, STIFFNESS, MASS = 24, 360.0, 18.632, 0.36503
PRINTED, SPEED = 2843.0, 1173.7
PLATE = {"tooth_bending": {"model": "plate", "order": [4, 4]}}
BODIES = {"tooth_bending": {"model": "solid"}, "gear_body": {}}


def test_main_resonance_from_the_printed_stiffness_and_mass():
    """n_E1 = 30 000/(π z_1) √(c_γα/m_red): the mode of two wheels at their mesh frequency."""
    found = modes(wheels(MASS * 1e-3 * B), np.array([1e3 * STIFFNESS * B]), 0.0).frequency[-1]
    assert_allclose(60 * found / (2 * math.pi) / Z, PRINTED, rtol=5e-4)


@pytest.mark.xfail(strict=True, reason="K_V of the norm counts pitch deviations, which the report does not print")
@pytest.mark.parametrize("teeth", ["clamped plate", "solid on gear bodies"])
def test_dynamic_factor_at_the_rated_speed(teeth):
    """Largest over mean mesh force against K_V 1.092: 1.029 with clamped plates, 1.024 on bodies of bore 150/900 mm.

    No deviations: 5.7 and 6.2 % below the norm's number. With a profile slope of class 6, plates give 1.031.
    """
    r_b = 14.0 * Z / 2 / math.cos(math.radians(10)) * math.cos(math.atan(math.tan(math.radians(20)) / 0.984807753))
    ratio, m = 95 / 24, 1e-3 * MASS * B
    # both wheels: m = 1/(r_b1²/J_1 + r_b2²/J_2), shared as their radii would be of one width, J ~ r⁴
    share = ratio**2 / (1 + ratio**2)
    J1 = m / share * r_b**2 * 1e-3
    J2 = m / (1 - share) * (ratio * r_b) ** 2 * 1e-3
    tables = {
        "pair": {
            "normal_module": 14.0,
            "helix_angle": 10.0,
            "face_width": B,
            "centre_distance": 861.0,
            "pinion": {"teeth": 24, "addendum": 0.938, "profile_shift": 0.48, "bore_diameter": 150.0},
            "wheel": {"teeth": 95, "addendum": 0.938, "profile_shift": 0.669, "bore_diameter": 900.0},
            "material": {"youngs_modulus": 206.0},
        },
        "load": {"torque": 40953.0},
        "effects": {
            **(PLATE if teeth == "clamped plate" else BODIES),
            "hertz": {},
            "tip_relief": {"amount": 2.0, "length": 5.0},
        },
        "system": {"damping_ratio": 0.05, "pinion": {"inertia": J1}, "wheel": {"inertia": J2}},
    }
    data = response(parse_scene(tables), speed=SPEED, harmonics=10)
    factor = float(data["dynamic_factor"][0, 0])
    assert_allclose(factor, 1.092, rtol=0.05)
