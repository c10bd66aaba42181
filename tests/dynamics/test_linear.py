"""Harmonic balance against time integration, Mathieu's tongues, limits, and meshes that cancel."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b

from gearbench.dynamics.analysis import response
from gearbench.dynamics.balance import solve
from gearbench.dynamics.model import Model
from gearbench.dynamics.modes import modes
from gearbench.dynamics.stability import multipliers
from gearbench.errors import InputError
from gearbench.scene_file import read_scene
from gearbench.schema import read
from gearbench.system.gearbox import Gearbox
from gearbench.system.schema import System
from tests.support.paths import EXAMPLES
from tests.support.systems import excitation, series, shafts, spur_scene, wheels

ONE = np.array([0])


@pytest.mark.parametrize("seed", range(10))
def test_two_wheels_against_time_integration(seed):
    rng = np.random.default_rng(seed)
    m, k, F = 10 ** rng.uniform(-4, -2), 10 ** rng.uniform(5, 6), rng.uniform(500, 5000)
    zeta, H = rng.uniform(0.04, 0.1), 24
    k_orders = k * rng.uniform(0.02, 0.1, 3) * np.exp(1j * rng.uniform(0, 6, 3))
    x_orders = [F / k, *(F / k * rng.uniform(0.02, 0.2, 3) * np.exp(1j * rng.uniform(0, 6, 3)))]
    drive = excitation(k, k_orders, x_orders, F, H)
    omega = rng.uniform(0.2, 1.8) * np.sqrt(k / m)
    system = modes(wheels(m), np.array([[k]]), zeta)
    x, f = solve(drive, system.mesh_receptance(omega * np.arange(H + 1)[None], ONE), np.array([[k]]))
    c = 2 * zeta * np.sqrt(k * m)

    def rate(t, y):
        force = F + series(drive.stiffness[0, 0], omega, t) * (y[0] - series(drive.motion[0], omega, t))
        return [y[1], (F - force - c * y[1]) / m]

    T = 2 * np.pi / omega
    # started from the solution, one period leads back to it
    start = [series(x[0, 0], omega, 0.0), series(1j * omega * np.arange(H + 1) * x[0, 0], omega, 0.0)]
    t = np.linspace(0, T, 60)
    y = solve_ivp(rate, (0, T), start, method="DOP853", rtol=1e-11, atol=1e-16, t_eval=t).y[0]
    assert_allclose(series(x[0, 0], omega, t), y, atol=1e-6 * np.ptp(y))
    force = F + series(drive.stiffness[0, 0], omega, t) * (y - series(drive.motion[0], omega, t))
    # the force is a product, whose highest orders are truncated
    assert_allclose(series(f[0, 0], omega, t), force, atol=1e-6 * np.ptp(force))


@pytest.mark.parametrize("depth", [0.1, 0.3])
def test_first_tongue_of_mathieu(depth):
    w0, m = 2e4, 1e-3
    system = modes(wheels(m), np.array([[m * w0**2]]), 0.0)
    t = (np.arange(256) + 0.5) / 256 * 2 * np.pi
    k = m * w0**2 * (1 + depth * np.cos(t))

    def growth(omega):
        return multipliers(system, ONE, np.array([omega]), k[None, :, None, None])[0] - 1

    def edge(value):
        def gap(omega):
            a = 4 * w0**2 / omega**2
            return a - value(1, depth * a / 2)

        return brentq(gap, 1.5 * w0, 2.6 * w0)

    low, high = sorted((edge(mathieu_a), edge(mathieu_b)))
    for inside, outside in ((low * 1.0002, low * 0.9998), (high * 0.9998, high * 1.0002)):
        assert growth(inside) > 1e-3
        assert abs(growth(outside)) < 1e-10


def test_damping_closes_the_tongue():
    """To first order, the motion is unstable if the depth ε of k̄(1 + ε cos) exceeds 4ζ."""
    w0, m, depth = 2e4, 1e-3, 0.05
    t = (np.arange(256) + 0.5) / 256 * 2 * np.pi
    k = (m * w0**2 * (1 + depth * np.cos(t)))[None, :, None, None]
    for zeta, sign in ((0.97 * depth / 4, 1), (1.03 * depth / 4, -1)):
        found = multipliers(modes(wheels(m), np.array([[m * w0**2]]), zeta), ONE, np.array([2 * w0]), k)[0]
        assert sign * (found - 1) > 0


def test_limits_of_slow_and_fast():
    """ω → 0: x = δ_s and f = F̄. ω → ∞: x stands still. Constant k: a forced oscillator for every order."""
    k, m, zeta, H = 5e5, 1e-3, 0.03, 6
    drive = excitation(k, [4e4, 1e4j], [4e-3, 1e-3, 2e-4j], 2000.0, H)
    system = modes(wheels(m), np.array([[k]]), zeta)
    w = np.sqrt(k / m) * np.array([1e-7, 1e4])
    x, f = solve(drive, system.mesh_receptance(np.outer(w, np.arange(H + 1)), ONE), np.array([[k]]))
    assert_allclose(x[0, 0], drive.motion[0], atol=1e-9 * 4e-3)
    assert_allclose(f[0, 0], [2000.0, *np.zeros(H)], atol=1e-3)
    assert np.abs(x[1, 0, 1:]).max() < 1e-10
    constant = excitation(k, [], [4e-3, 1e-3, 2e-4j], 2000.0, H)
    w = np.sqrt(k / m) * np.array([0.4, 0.9, 1.7])
    x, _ = solve(constant, system.mesh_receptance(np.outer(w, np.arange(H + 1)), ONE), np.array([[k]]))
    n, r = np.arange(1, H + 1), w[:, None] / np.sqrt(k / m)
    transfer = 1 / (1 - (n * r) ** 2 + 2j * zeta * n * r)
    assert_allclose(x[:, 0, 1:], transfer * constant.motion[0, 1:], rtol=1e-12, atol=1e-18)


def test_uniform_phases_must_resolve_the_orders():
    with pytest.raises(InputError, match="must be more than 80, twice the 40 orders"):
        response(spur_scene({}, segments=15, positions=32), speed=1000.0, harmonics=20)


def split(phase, angle):
    """A pinion between two wheels on opposite sides; the wheel of the scene's pair is on the right."""
    support = {"radial_stiffness": 200.0, "axial_stiffness": 100.0}
    ends = [{"position": 0.0, **support}, {"position": 100.0, **support}]
    shaft = {"sections": [{"length": 100.0, "diameter": 40.0}], "bearings": ends}
    a = 3 * 65 / 2
    side = -a if angle else a
    return {
        "damping_ratio": 0.03,
        "meshes": [{"name": "left", "scene": "left.toml", "phase": phase}],
        "shafts": [
            shaft
            | {
                "name": "input",
                "axis": [0.0, 0.0],
                "gears": [{"gear": "pinion", "position": 50.0}, {"mesh": "left", "gear": "pinion", "position": 50.0}],
                "coupling": {"position": 0.0},
            },
            shaft
            | {
                "name": "one",
                "axis": [a, 0.0],
                "gears": [{"gear": "wheel", "position": 50.0}],
                "coupling": {"position": 0.0},
            },
            shaft
            | {
                "name": "two",
                "axis": [side, 0.0],
                "gears": [{"mesh": "left", "gear": "wheel", "position": 50.0}],
                "coupling": {"position": 0.0},
            },
        ],
    }  # fmt: skip


def test_two_equal_opposite_meshes_cancel(tmp_path):
    """Two wheels in phase on opposite sides of a pinion: their forces cancel at its bearings."""
    import tomli_w

    plain = spur_scene()
    (tmp_path / "left.toml").write_text(plain.to_toml())
    forces = {}
    for name, phase in (("together", 0.0), ("apart", 0.5)):
        tables = plain.to_mapping() | {"system": split(phase, 180)}
        (tmp_path / f"{name}.toml").write_text(tomli_w.dumps(tables))
        data = response(read_scene(tmp_path / f"{name}.toml"), speed=[1500.0, 4000.0], harmonics=5)
        chosen = data["bearing_force_amplitude"].sel(mesh="pair", bearing=["input 1", "input 2"])
        forces[name] = chosen.sel(direction=["x", "y"]).max(["speed", "bearing", "direction"]).values
    # half a period apart the odd orders add, the even ones cancel; contacts are solved to 1e-9
    assert forces["together"].max() < 1e-9 * forces["apart"].max()
    assert forces["apart"][1::2].max() < 1e-9 * forces["apart"].max()


@pytest.mark.parametrize(("planet", "phase"), [(42, 0.35), (84, 0.70), (0.5, 0.5), (1, 0.0)])
def test_phases_of_meshes_on_a_shared_pinion(planet, phase):
    """On a sun with 21 teeth, a planet at 42/120 of a turn is 7.35 pitches, so 0.35 of a period, ahead or behind."""
    z = 21 if planet < 2 else 120
    pair = spur_scene().pair
    pair = replace(pair, pinion=replace(pair.pinion, teeth=21), centre_distance=3 * 61 / 2)
    angle, a = 2 * np.pi * planet / z, pair.centre_distance
    tables = split(None, 0)
    tables["shafts"][1]["axis"], tables["shafts"][2]["axis"] = [a, 0.0], [a * np.cos(angle), a * np.sin(angle)]
    del tables["meshes"][0]["phase"]
    for rotation, expected in (("counterclockwise", phase), ("clockwise", -phase % 1)):
        box = Gearbox(
            system=read(System, tables | {"rotation": rotation}), pairs={"pair": pair, "left": pair}, torque=100.0
        )
        assert_allclose(np.exp(2j * np.pi * box.phases["left"]), np.exp(2j * np.pi * expected), atol=1e-12)


def test_stiff_bearings_leave_the_lowest_modes():
    """With bearings of 1e10 N/µm the torsional modes of the coupled inertias remain; rigid-body modes are left out."""
    found = []
    for stiffness in (1e6, 1e10):
        ends = [{"position": p, "radial_stiffness": stiffness, "axial_stiffness": stiffness} for p in (0.0, 200.0)]
        motor = {"position": 0.0, "inertia": 0.02, "torsional_stiffness": 2000.0}
        model = Model(scene=spur_scene(shafts({"bearings": ends, "coupling": motor})))
        found.append(model.modes.frequency[model.modes.frequency > 0][:2])
    assert found[0][0] / (2 * np.pi) < 100
    assert_allclose(found[1], found[0], rtol=1e-3)


@pytest.mark.slow
def test_relief_that_a_helical_stage_needs():
    """Numbers of docs/tutorial_response.md: largest RMS of the mesh force over the relief of both gears."""
    scene = read_scene(EXAMPLES / "shafts.toml")
    relief, found = scene.effect("tip_relief"), []
    for amount in (0.0, 10.0, 20.0, 30.0):
        changed = tuple(replace(e, amount=amount) if e is relief else e for e in scene.effects)
        data = response(replace(scene, effects=changed), speed=np.linspace(500, 8000, 200))
        found.append(float(data["mesh_force_rms"].max()))
    assert_allclose(found, [648, 432, 149, 370], rtol=0.01)


@pytest.mark.parametrize(
    ("speed", "match"), [(0.0, "must be positive"), (np.nan, "must be positive"), ([], "one number or a list")]
)
def test_speeds_that_cannot_be(speed, match):
    with pytest.raises(InputError, match=match):
        response(spur_scene({}), speed=speed)


def test_scene_without_system_is_told_so():
    with pytest.raises(InputError, match=r"needs \[system\]"):
        response(spur_scene(), speed=1000.0)


def test_resonances_above_the_highest_order_are_said():
    data = response(spur_scene({}), speed=[200.0, 8000.0], harmonics=4)
    assert "raise harmonics" in data.attrs["notes"]
