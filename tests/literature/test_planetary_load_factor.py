"""Mesh load factor over errors of class 6 against the tables of norms: an order of size, no proof."""

import pytest

from gearbench import robust
from gearbench.scene_file import parse_scene

#: K_γ of IEC 61400-4 by the number of planets.
IEC = {3: 1.10, 4: 1.25, 5: 1.35, 6: 1.44, 7: 1.47}


@pytest.mark.slow
@pytest.mark.parametrize("planets", IEC)
def test_factor_of_the_norm_lies_between_the_mean_and_the_worst_of_a_hundred(planets):
    # z 60/24/−108, m 2, class 6: run-outs by ISO 1328-2, pins within IT 6; the sun floats
    pins = {"pin_tangential": 15.0, "pin_radial": 15.0, "planet_thickness": 8.0}
    turning = {"sun_run_out": 28.0, "ring_run_out": 32.0, "planet_run_out": 20.0, "carrier_run_out": 20.0}
    own = {
        "normal_module": 2.0,
        "face_width": 25.0,
        "centre_distance": 84.0,
        "planets": planets,
        "floating": ["sun"],
        "pin_stiffness": 400.0,
        "sun": {"teeth": 60, "bore_diameter": 80.0},
        "planet": {"teeth": 24, "bore_diameter": 25.0},
        "ring": {"teeth": -108, "outer_diameter": 250.0},
        "scatter": pins | turning,
    }
    effects = {"tooth_bending": {"model": "solid"}, "gear_body": {}, "hertz": {}}
    scene = {"planetary": own, "load": {"torque": 200.0 * planets}, "effects": effects, "resolution": {"positions": 8}}
    factor = robust(parse_scene(scene), samples=256)["mesh_load_factor"]
    mean, worst = float(factor.mean()), float(factor.quantile(0.99))
    if planets == 3:  # shared exactly: what the norm has is not in the model
        assert worst == pytest.approx(1.0, abs=1e-6)
    else:
        assert mean < IEC[planets] < worst
