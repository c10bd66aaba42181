"""On the flank under load: pressure, sliding, friction, flash temperature, face load factor, against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from gearbench import open_result, read_scene, save, simulate, sweep
from gearbench.errors import InputError
from gearbench.results.flank import BLOK
from gearbench.results.outputs import OUTPUTS
from gearbench.results.quantities import GROUPS
from gearbench.scene_file import parse_scene
from tests.support.paths import ROOT

SPUR = {
    "pair": {
        "normal_module": 3.0, "face_width": 24.0, "centre_distance": 90.4,
        "pinion": {"teeth": 24}, "wheel": {"teeth": 36},
    },
    "load": {"torque": 150.0},
    "operation": {"speed": 1500.0, "friction_coefficient": 0.06},
    "effects": {"hertz": {"law": "yang_sun"}},
    "resolution": {"gauss_points": 12},
}  # fmt: skip
HELICAL = {**SPUR, "pair": {**SPUR["pair"], "helix_angle": 18.0, "centre_distance": 94.9}}
ALL = tuple(GROUPS["on the flank"])


def scene(tables=SPUR, **more):
    return parse_scene({**tables, **more})


def test_friction_loss_of_evenly_shared_load_is_ohlendorfs():
    """H_V = π (u + 1)/(z_1 u cos β_b) (1 − ε_α + ε_1² + ε_2²), Ohlendorf 1958: pairs on the path share the load evenly.

    They do where nothing but a constant contact law yields.
    """
    made = scene()
    found = simulate(made, outputs=["friction_loss", "mesh_efficiency", "load_share"])
    shared = found["load_share"].values
    assert_allclose(shared[shared > 0], 1 / np.broadcast_to((shared > 0).sum(1)[:, None], shared.shape)[shared > 0])
    m, (z_1, z_2) = made.pair.meshing, (24, 36)
    u, p = z_2 / z_1, m.base_pitch
    e_1, e_2 = (m.path_end - m.pitch_point) / p, (m.pitch_point - m.path_start) / p
    H_V = math.pi * (u + 1) / (z_1 * u) * (1 - e_1 - e_2 + e_1**2 + e_2**2)
    power = 150.0 * 1500.0 * math.pi / 30
    assert float(found["friction_loss"]) == pytest.approx(0.06 * H_V * power, rel=1e-9)
    assert float(found["mesh_efficiency"]) == pytest.approx(1 - 0.06 * H_V, rel=1e-12)


@pytest.mark.parametrize("tables", [SPUR, HELICAL], ids=["spur", "helical"])
def test_sliding_is_that_of_two_turning_gears(tables):
    """Vectors in the transverse plane: the velocities of both gears' points at the contact, along the profile."""
    made = scene(tables)
    found = simulate(made, outputs=["sliding_speed", "specific_sliding"])
    m = made.pair.meshing
    x, y = found["path_position"].values, np.full_like(found["path_position"].values, made.pair.gears[0].base_radius)
    omega = 1500 * math.pi / 30
    far = np.array([m.tangent_length, sum(g.base_radius for g in made.pair.gears)])
    own, mate = omega * x, -omega * 24 / 36 * (x - far[0])  # of the velocities, the parts along the profile
    # those along the line of action agree, or the flanks would part
    assert_allclose(omega * y, omega * 24 / 36 * (far[1] - y), rtol=1e-12)
    assert_allclose(found["sliding_speed"], 1e-3 * (own - mate), rtol=1e-12, atol=1e-12)
    present = found["segment_length"].values > 0
    zeta = found["specific_sliding"]
    assert zeta.dims == ("gear", "position", "pair", "segment")
    assert_allclose(zeta.sel(gear="pinion").values[present], ((own - mate) / own)[present], rtol=1e-9)
    assert_allclose(zeta.sel(gear="wheel").values[present], ((mate - own) / mate)[present], rtol=1e-9)
    ends, first = m.specific_sliding[0], zeta.values[0][present]
    assert ends[0] <= first.min() <= ends[0] * 0.8
    assert ends[1] * 0.8 <= first.max() <= ends[1]


def test_friction_coefficient_of_the_norm_by_hand():
    made = scene(operation={"speed": 1500.0, "viscosity": 30.0, "roughness": 0.6, "lubricant_factor": 0.8})
    found = simulate(made, outputs=["friction_coefficient"])
    alpha = math.acos((36 + 54) * math.cos(math.radians(20)) / 90.4)
    v_t = 1500 * math.pi / 30 * 90.4 * 24 / 60 / 1e3
    r_1, r_2 = 90.4 * 0.4, 90.4 * 0.6
    rho = r_1 * r_2 / (r_1 + r_2) * math.sin(alpha)
    w = 150e3 / (36 * math.cos(math.radians(20))) / 24
    assert w > 150
    mu = 0.048 * (w / (2 * v_t * math.sin(alpha) * rho)) ** 0.2 * 30**-0.05 * 0.6**0.25 * 0.8
    assert float(found["friction_coefficient"]) == pytest.approx(mu, rel=1e-9)
    light = simulate(replace(made, load=replace(made.load, torque=1.0)), outputs=["friction_coefficient"])
    assert float(light["friction_coefficient"]) == pytest.approx(mu * (150 / w) ** 0.2, rel=1e-9)


def test_bloks_constant_is_that_of_a_fast_semi_elliptical_source():
    """T(x) = ∫ q(ξ)/√(π v λρc (x − ξ)) dξ, the half-space behind a band that moves fast (Carslaw & Jaeger)."""
    from scipy.integrate import quad

    def rise(x: float) -> float:
        # ξ = x − s²: the singularity of 1/√ is gone; half width 1, total flow 1
        def flow(s: float) -> float:
            return 2 * 2 / math.pi * math.sqrt(max(1 - (x - s * s) ** 2, 0.0))

        return quad(flow, math.sqrt(max(x - 1, 0.0)), math.sqrt(x + 1), limit=200)[0] / math.sqrt(math.pi)

    largest = max(rise(x) for x in np.linspace(0.0, 0.8, 81))
    # q |v_1 − v_2| μ enters; both flanks take it so that their temperatures agree: 1/(√v_1 + √v_2) of it, 2b_H = 2
    assert largest * math.sqrt(2) == pytest.approx(BLOK, rel=0.005)


def test_flash_temperature_by_hand_at_a_tip():
    made = scene(effects={"hertz": {}})
    found = simulate(made, outputs=["flash_temperature", "flash_temperature_max", "flank_pressure", "line_load"])
    at = np.unravel_index(found["flash_temperature"].values.argmax(), found["flash_temperature"].shape)
    q, u = float(found["line_load"].values[at]), float(found["path_position"].values[at])
    T, omega = made.pair.meshing.tangent_length, 1500 * math.pi / 30
    v_1, v_2 = omega * u, omega * 24 / 36 * (T - u)
    b_H = math.sqrt(8 * q * u * (T - u) / T * (1 - 0.3**2) / (math.pi * 210e3))
    by_hand = 1.11 * 0.06 * q * abs(math.sqrt(v_1) - math.sqrt(v_2)) / (13.8 * math.sqrt(2 * b_H))
    assert float(found["flash_temperature_max"]) == pytest.approx(by_hand, rel=1e-12)
    assert 5 < by_hand < 200


def test_face_load_factor():
    even = scene()
    assert float(simulate(even, outputs=["face_load_factor"])["face_load_factor"]) == pytest.approx(1.0, abs=1e-9)
    # a linear bedding under a helix slope, touching all over: q = q̄ + c f (1/2 − y/b), c = πE/(4(1−ν²))
    f = 0.5
    leaning = scene(effects={"hertz": {"law": "yang_sun"}, "helix_slope": {"pinion": f}}, resolution={"segments": 200})
    found = simulate(leaning, outputs=["face_load_factor", "line_load"])
    c = math.pi * 210e3 / (4 * (1 - 0.3**2))
    mean = even.F_bn / 24.0 / even.pair.meshing.total_contact_ratio
    # the mean over the cycle of the load of a line is what all pairs together carry over their number
    weight = found["phase_weight"].values
    pairs = (found["segment_length"].values[..., 0] > 0).sum(axis=1) @ weight
    q = even.F_bn / 24.0 + pairs * c * f * 1e-3 * (0.5 - 0.025)
    assert mean > c * f * 1e-3 / 2  # it does touch all over
    assert float(found["face_load_factor"]) == pytest.approx(q / (even.F_bn / 24.0), rel=1e-6)


def test_loaded_contact_ratio():
    for tables in (SPUR, HELICAL):
        made = scene(tables)
        found = float(simulate(made, outputs=["loaded_contact_ratio"])["loaded_contact_ratio"])
        assert found == pytest.approx(made.pair.meshing.total_contact_ratio, rel=1e-9)
    relieved = scene(effects={"hertz": {"law": "yang_sun"}, "tip_relief": {"amount": 60.0, "length": 1.0}})
    found = float(simulate(relieved, outputs=["loaded_contact_ratio"])["loaded_contact_ratio"])
    assert 1.0 <= found < relieved.pair.meshing.total_contact_ratio - 0.2


def test_largest_pressure_is_that_of_the_segments_and_root_stress_that_of_the_norm():
    made = read_scene(ROOT / "examples" / "case2.toml")
    found = simulate(made, outputs=["flank_pressure", "flank_pressure_max", "root_stress"])
    assert float(found["flank_pressure_max"]) == found["flank_pressure"].values.max()
    from gearbench.strength.rating import root_stress

    assert_allclose(found["root_stress"], root_stress(made), rtol=1e-12)
    assert found["gear"].values.tolist() == ["pinion", "wheel"]


def test_names_of_earlier_versions_are_those_of_one_gear():
    made = scene(HELICAL, resolution={"positions": 3})
    now = simulate(made, outputs=["loaded_root_stress", "specific_sliding"])
    with pytest.warns(DeprecationWarning, match="is now loaded_root_stress"):
        before = simulate(made, outputs=["loaded_root_stress_wheel"])
    with pytest.warns(DeprecationWarning, match="dimension gear"):
        sliding = sweep(made, torque=[100.0, 300.0], outputs=["specific_sliding_pinion"])["specific_sliding_pinion"]
    assert float(before["loaded_root_stress_wheel"]) == float(now["loaded_root_stress"].sel(gear="wheel"))
    assert before["loaded_root_stress_wheel"].attrs["units"] == "MPa"
    assert_allclose(sliding.isel(torque=0), now["specific_sliding"].sel(gear="pinion"))


def test_dataset_of_an_earlier_version_is_read_and_said_to_be_one(tmp_path, caplog):
    made = scene(HELICAL, resolution={"positions": 3})
    now = simulate(made, outputs=["root_stress", "specific_sliding", "transmission_error"])
    each = {f"{name}_{gear}": now[name].sel(gear=gear, drop=True) for name in ("root_stress", "specific_sliding")
            for gear in ("pinion", "wheel")}  # fmt: skip
    before = now.drop_vars(["root_stress", "specific_sliding", "gear"]).assign(each)
    save(before, tmp_path / "before.nc")
    found = open_result(tmp_path / "before.nc")
    assert "earlier version" in caplog.text
    xr.testing.assert_identical(found[sorted(map(str, found))], now[sorted(map(str, now))])


def test_every_output_of_the_flank_follows_the_load_of_a_sweep():
    made = scene(HELICAL, operation={"speed": 1500.0, "viscosity": 30.0}, resolution={"positions": 6})
    whole = sweep(made, torque=[100.0, 300.0], outputs=ALL)
    for torque in (100.0, 300.0):
        single = simulate(replace(made, load=replace(made.load, torque=torque)), outputs=ALL)
        for name in ALL:
            found = whole[name].sel(torque=torque) if "torque" in whole[name].dims else whole[name]
            assert_allclose(found.values, single[name].values, rtol=1e-11, atol=1e-14)
    assert set(ALL) <= set(OUTPUTS)


@pytest.mark.parametrize("name", ["sliding_speed", "friction_loss", "flash_temperature", "friction_coefficient"])
def test_an_operation_that_is_missing_is_named(name):
    with pytest.raises(InputError, match=f"operation = missing: is required for {name}"):
        simulate(parse_scene({key: table for key, table in SPUR.items() if key != "operation"}), outputs=[name])


@pytest.mark.parametrize(
    ("operation", "name", "message"),
    [
        ({"friction_coefficient": 0.05}, "friction_loss", "operation.speed = missing: is required for friction_loss"),
        ({"speed": 100.0}, "friction_loss", "operation.viscosity = missing: is required for friction"),
        ({"speed": -1.0}, "friction_loss", "operation.speed = -1.0: must be greater than 0"),
        ({"speed": 1.0, "friction_coefficient": 0.1, "viscosity": 1.0}, "", "operation.viscosity = 1: conflicts with"),
    ],
)
def test_bad_operations_are_one_line(operation, name, message):
    with pytest.raises(InputError) as caught:
        simulate(scene(operation=operation), outputs=[name])
    assert str(caught.value).startswith(message)
