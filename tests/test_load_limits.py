"""Loads beyond what a scene may have are refused, those beyond linear elasticity carry a warning."""

import pytest

from gearbench.errors import InputError
from gearbench.library.garambois2017 import case
from gearbench.scene import LOADS, Load
from gearbench.scene_file import read_scene
from gearbench.schema import changed
from gearbench.simulation import simulate
from gearbench.sweeps.run import sweep
from tests.support.paths import EXAMPLES

CASE = read_scene(EXAMPLES / "case1.toml")


@pytest.mark.parametrize("torque", ["5e-324", "1e300", "1.7e308"])
def test_torques_that_mean_nothing_are_one_line(refused, torque):
    err = refused("simulate", EXAMPLES / "case1.toml", "--torque", torque)
    assert f"--torque = {float(torque):.6g}: must lie within " in err


@pytest.mark.parametrize("end", [0, 1])
def test_the_ends_of_the_range_are_solved(end):
    torque = CASE.load.torque * LOADS[end] / CASE.relative_load
    inside = changed(CASE, load=Load(torque=torque * (1 + (1e-9 if end == 0 else -1e-9))))
    assert 0 < float(simulate(inside)["mesh_stiffness_mean"]) < 1e6
    with pytest.raises(InputError, match=r"load\.torque"):
        changed(CASE, load=Load(torque=torque * (1 + (-1e-6 if end == 0 else 1e-6))))


def test_results_beyond_linear_elasticity_carry_a_warning():
    assert "warning" not in simulate(case(1)).attrs
    # 2 % of strain at the root: well above what this pair of steel is loaded with
    limit = CASE.load.torque * 0.02 / (3 * CASE.relative_load)
    assert 10 < limit / CASE.load.torque < 30
    warning = simulate(changed(CASE, load=Load(torque=1.5 * limit))).attrs["warning"]
    assert warning.startswith("teeth strained by about 3 %: linear elasticity")
    swept = sweep(CASE, torque=[0.5 * limit, 1.5 * limit])
    assert swept.attrs["warning"] == warning
    assert "warning" not in sweep(CASE, torque=[0.2 * limit, 0.5 * limit]).attrs
