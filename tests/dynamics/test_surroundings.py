"""Static deflection of shafts, energies of modes, ripples, damping by mode, friction: closed forms and limits."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import read_scene
from gearbench.dynamics.analysis import response
from gearbench.dynamics.figures import draw_response
from gearbench.dynamics.loaded_mesh import FRICTION, loaded_mesh
from gearbench.dynamics.model import Model
from gearbench.errors import InputError
from gearbench.scene import Resolution
from gearbench.schema import read
from gearbench.system.schema import System
from tests.support.systems import shafts, spur_scene

STIFF = {"sections": [{"length": 200.0, "diameter": 400.0}]}
SPRINGS = [{"position": p, "radial_stiffness": 50.0, "axial_stiffness": 50.0} for p in (0.0, 200.0)]


def test_static_deflection_is_that_of_a_rigid_shaft_on_two_springs():
    """Deflection and slope at p of L, from the loads of the bearings over their stiffness; the load leaves mid-face."""
    scene = spur_scene(shafts(STIFF | {"bearings": SPRINGS}))
    data = response(scene, speed=1000.0, harmonics=2)
    share, k = 70.0 / 200.0, 50.0
    loads = data["bearing_load"].sel(bearing=["input 1", "input 2"], direction=["x", "y"])
    assert_allclose(np.linalg.norm(loads.sum("bearing")), scene.F_bt, rtol=1e-9)
    first, second = np.linalg.norm(loads.values, axis=1) / k
    assert share + 0.03 < second / (first + second) < 90.0 / 200.0
    moved = data["gear_deflection"].sel(gear="pair pinion").values
    assert_allclose(np.linalg.norm(moved), first + share * (second - first), rtol=5e-3)
    assert_allclose(data["mesh_misalignment"].values, [abs(second - first) * 40.0 / 200.0], rtol=5e-3)
    tilt = data["gear_tilt"].sel(gear="pair pinion").values
    assert_allclose(np.linalg.norm(tilt), abs(second - first) / 200.0, rtol=5e-3)


def test_energies_of_a_mode_are_shares():
    """They sum to one; of bearings 10 000 times softer than all else the bearings have nearly all."""
    soft = [{"position": p, "radial_stiffness": 1.0, "axial_stiffness": 1.0} for p in (0.0, 200.0)]
    data = response(spur_scene(shafts(STIFF | {"bearings": soft})), speed=6000.0, harmonics=8)
    energy = data["mode_energy"]
    assert_allclose(energy.sum("part"), 1.0, rtol=1e-12)
    assert float(energy.min()) >= 0.0
    lowest = energy.isel(mode=0)
    assert float(lowest.sel(part=["bearing input 1", "bearing input 2"]).sum()) > 0.98
    assert_allclose(np.abs(data["shaft_mode_shape"]).max(["station", "component"]), 1.0)


def heavy(**shaft):
    motor, load = ({"position": 0.0, "inertia": inertia} for inertia in (10.0, 50.0))
    return spur_scene(shafts({"coupling": motor, "bearings": SPRINGS} | shaft, {"coupling": load, "sections": [{"length": 100.0, "diameter": 60.0}]}))  # fmt: skip  # noqa: E501


def test_slow_ripple_of_torque_accelerates_both_inertias():
    """The mesh passes on what the load's inertia takes."""
    scene = heavy(ripples=[{"order": 6, "torque": 2.0}])
    data = response(scene, speed=[2.0, 4.0], harmonics=2)
    r_1, r_2 = (gear.base_radius for gear in scene.pair.gears)
    m_1, m_2 = 10.0 / r_1**2, 50.0 / r_2**2
    assert_allclose(data["ripple_frequency"].values[:, 0], 6 * np.array([2.0, 4.0]) / 60)
    expected = 2000.0 / r_1 * m_2 / (m_1 + m_2)
    assert_allclose(data["ripple_mesh_force_amplitude"].values.ravel(), expected, rtol=0.01)
    assert "ripples" in data.attrs["notes"]


def test_slow_ripple_of_force_is_shared_by_the_bearings():
    data = response(heavy(ripples=[{"order": 1, "force": [30.0, 0.0, 0.0], "position": 50.0}]), speed=1.0, harmonics=2)
    felt = data["ripple_bearing_force_amplitude"].sel(direction="x").values[0, 0, :2]
    # the meshing wheel yields far less than the bearings do along the line of action, so that they share with it
    assert 0.5 * 30.0 < felt.sum() < 30.0 * 1.001


def test_damping_by_mode():
    """One value for all is the damping ratio; of two values each mode has that of its frequency."""
    ends = {"bearings": SPRINGS}
    plain = Model(scene=spur_scene(shafts(ends, damping_ratio=0.03))).modes
    same = Model(scene=spur_scene(shafts(ends, mode_damping=[[100.0, 0.03]]))).modes
    assert_allclose(same.damping_ratio, plain.damping_ratio, rtol=1e-15)
    two = Model(scene=spur_scene(shafts(ends, mode_damping=[[500.0, 0.01], [2500.0, 0.05]]))).modes
    f = two.frequency / (2 * np.pi)
    assert_allclose(two.damping_ratio, np.clip(0.01 + 0.04 * (f - 500) / 2000, 0.01, 0.05), rtol=1e-12)
    assert np.ptp(two.damping_ratio) > 0.03


@pytest.mark.parametrize(
    ("table", "match"),
    [
        ({"mode_damping": [[900.0, 0.02], [100.0, 0.02]]}, "mode_damping.*must ascend"),
        ({"shafts": shafts({"ripples": [{"order": 2}]})["shafts"]}, "give torque, force, or both"),
        ({"shafts": shafts({"ripples": [{"order": 2, "torque": 1.0}], "coupling": None})["shafts"]}, "give a position"),
        ({"shafts": shafts({"ripples": [{"order": 2, "torque": 1.0, "position": 900.0}]})["shafts"]}, "must lie on"),
    ],
)
def test_ripples_and_damping_that_cannot_be(table, match):
    with pytest.raises(InputError, match=match):
        read(System, table)


def test_friction_of_a_spur_pair_turns_at_the_pitch_point():
    """It is the coefficient times the force where one pair is loaded, of either sign, and never more."""
    mesh = loaded_mesh(spur_scene({}))
    found, most = mesh.friction, FRICTION * mesh.scene.F_bt
    assert np.abs(found).max() <= most * (1 + 1e-9)
    assert_allclose([found.min(), found.max()], [-most, most], rtol=1e-6)
    data = response(mesh.scene, speed=1000.0, harmonics=4)
    assert 0.1 * most < float(data["friction_force_amplitude"].max()) < 4 / math.pi * most
    assert "friction" in data.attrs["notes"]


@pytest.mark.slow
def test_figures_of_modes_and_ripples_are_drawn(tmp_path):
    scene = replace(heavy(ripples=[{"order": 6, "torque": 2.0}]), name="a $name_")
    names = [path.name for path in draw_response(response(scene, speed=[500.0, 3000.0], harmonics=3), tmp_path)]
    assert {"modes.png", "ripples.png", "waterfall_pair.png"} <= {*names}
    assert all((tmp_path / name).stat().st_size > 5000 for name in names)


@pytest.mark.slow
def test_orders_whose_excitation_is_uncertain_are_named():
    """All orders that finer phases and segments change by more than a tenth are among them; orders 1 and 2 are not."""
    scene = read_scene("examples/shafts.toml")
    finer = replace(scene, resolution=Resolution(segments=45, gauss_points=9))
    found, expected = (2 * np.abs(Model(scene=each).quasi_static_approach(10)[0, 1:]) for each in (scene, finer))
    wrong = np.flatnonzero(np.abs(found / expected - 1) > 0.1) + 1
    (line,) = (each for each in Model(scene=scene).remarks(np.array([1000.0]), 10) if "noise floor" in each)
    named = {int(each) for each in re.findall(r"\d+", line.partition(" of its")[0])}
    assert len(wrong) >= 1
    assert set(wrong.tolist()) <= named <= set(range(3, 11))
