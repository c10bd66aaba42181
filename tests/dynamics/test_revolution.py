"""Sidebands of teeth that differ: against one cycle after the other, time integration, and what alike teeth do."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from gearbench import simulate
from gearbench.dynamics.analysis import response
from gearbench.dynamics.balance import Excitation
from gearbench.dynamics.loaded_mesh import loaded_mesh
from gearbench.dynamics.modes import modes
from gearbench.dynamics.revolution import Revolution, revolution, revolution_response, side_bands
from gearbench.errors import InputError
from gearbench.hunting.cycles import tooth_to_tooth_effects
from gearbench.results.cycle import Phases, fourier_rows
from gearbench.scene_file import parse_scene
from tests.support.systems import series, shafts, wheels

RNG = np.random.default_rng(4)
PINION, WHEEL = RNG.uniform(-3, 3, 7).round(2).tolist(), RNG.uniform(-3, 3, 11).round(2).tolist()


def scene(system=None, teeth=(7, 11), **errors):
    tables = {
        "pair": {
            "normal_module": 3.0,
            "helix_angle": 20.0,
            "face_width": 30.0,
            "centre_distance": 3 * abs(sum(teeth)) / 2 / np.cos(np.radians(20.0)),
            "pinion": {"teeth": teeth[0], "profile_shift": 0.3, "addendum": 0.8},
            "wheel": {"teeth": teeth[1], "profile_shift": -0.3, "addendum": 0.8},
        },
        "load": {"torque": 100.0},
        "effects": {"hertz": {}, "tooth_bending": {"model": "plate", "order": [3, 3]}},
        "resolution": {"segments": 12, "gauss_points": 5},
    }
    if waves := errors.pop("waviness", None):
        tables["effects"]["waviness"] = waves
    if errors:
        tables["effects"]["pitch_errors"] = errors
    return parse_scene(tables | ({} if system is None else {"system": system}))


@pytest.mark.parametrize(("errors", "cycles"), [({"pinion": PINION}, 7), ({"pinion": PINION, "wheel": WHEEL}, 77)])
def test_excitation_is_that_of_every_pair_of_teeth(errors, cycles):
    """Mean and orders of a revolution from ``simulate`` of each of its mesh cycles."""
    own, H = scene({}, **errors), 2
    found = revolution(loaded_mesh(scene({})), tooth_to_tooth_effects(own), H)
    assert found.cycles == cycles
    orders = np.zeros(H * cycles + 1, complex)
    for i in range(cycles):
        at = {"pinion_tooth": i % 7, "wheel_tooth": i % 11 if "wheel" in errors else 0}
        data = simulate(scene(**errors, **at))
        n = np.arange(H * cycles + 1) / cycles
        rows = fourier_rows(Phases.of_dataset(data), n)
        orders += np.exp(-2j * np.pi * n * i) * (rows @ data["transmission_error"].values) / cycles * 1e-3
    assert_allclose(found.excitation.motion[0], orders, atol=1e-9 * np.abs(orders).max())


@pytest.mark.parametrize(("gear", "cycles"), [("pinion", 18), ("wheel", 41)])
def test_revolution_of_a_pair_with_a_ring(gear, cycles):
    """The deviations of one gear repeat after its own revolution; their mean is that of the gaps of all cycles."""
    teeth, own = (18, -41), RNG.uniform(-3, 3, cycles).tolist()
    plain, H = scene({}, teeth), 1
    found = revolution(loaded_mesh(plain), tooth_to_tooth_effects(scene({}, teeth, **{gear: own})), H)
    assert found.cycles == cycles
    at_once = found.excitation.motion[0, 1:cycles]
    assert np.abs(at_once).max() > 1e-4
    data = [simulate(scene(None, teeth, **{gear: own, f"{gear}_tooth": i})) for i in range(cycles)]
    orders = np.arange(1, cycles) / cycles
    rows = fourier_rows(Phases.of_dataset(data[0]), orders)
    each = [np.exp(-2j * np.pi * orders * i) * (rows @ one["transmission_error"].values) for i, one in enumerate(data)]
    assert_allclose(at_once, 1e-3 * np.mean(each, axis=0), atol=1e-9)


def test_side_bands_against_time_integration():
    """A wheel of five teeth: orders 1/5 … H excite a mesh whose stiffness varies with the mesh frequency."""
    rng = np.random.default_rng(0)
    P, H, m, k, F, zeta = 5, 12, 1e-3, 4e5, 2000.0, 0.06
    error = np.zeros(H * P + 1, complex)
    error[: 3 * P] = 1e-4 * rng.normal(size=(2, 3 * P)).T @ [1, 1j]
    error[0] = F / k
    stiffness = np.zeros(2 * H + 1, complex)
    stiffness[:4] = k, 0.06 * k, 0.03j * k, -0.02 * k
    system = modes(wheels(m), np.array([[k]]), zeta)
    omega = 0.7 * np.sqrt(k / m)
    h = system.mesh_receptance(omega * np.arange(H * P + 1) / P, np.array([0]))
    drive = Excitation(
        stiffness=stiffness[None, None], motion=error[None], force=F * np.eye(1, H * P + 1, dtype=complex)
    )
    x, f = (each[0] for each in side_bands(Revolution(cycles=P, excitation=drive), h, np.array([[k]])))
    c = 2 * zeta * np.sqrt(k * m)

    def rate(t, y):
        force = F + series(stiffness, omega, t) * (y[0] - series(error, omega / P, t))
        return [y[1], (F - force - c * y[1]) / m]

    T = 2 * np.pi / omega * P
    start = [series(x, omega / P, 0.0), series(1j * omega / P * np.arange(H * P + 1) * x, omega / P, 0.0)]
    t = np.linspace(0, T, 50)
    y = solve_ivp(rate, (0, T), start, method="DOP853", rtol=1e-10, atol=1e-15, t_eval=t).y[0]
    assert_allclose(series(x, omega / P, t), y, atol=1e-6 * np.ptp(y))
    assert_allclose(f[0], F, rtol=1e-12)


@pytest.mark.parametrize("system", [{}, pytest.param(shafts(), marks=pytest.mark.slow)], ids=["wheels", "shafts"])
def test_alike_teeth_have_no_side_bands(system):
    """Every tooth 2 µm behind: the mean moves, the orders are those of ``response``."""
    speed, H = [2000.0, 9000.0], 4
    alike = revolution_response(scene(system, pinion=[2.0] * 7), speed=speed, harmonics=H)
    plain = response(scene(system), speed=speed, harmonics=H)
    assert_allclose(alike["order"], np.arange(1, H + 1))
    for name in ("mesh_force_amplitude", "dynamic_transmission_error_amplitude", "dynamic_factor"):
        assert_allclose(alike[name].values, plain[name].values, rtol=1e-7)


def test_given_error_of_a_revolution():
    """Run-out of the pinion as a curve: below all modes the motion follows it, once a revolution."""
    own = scene(shafts(), teeth=(25, 40))
    steps = np.arange(25 * 64) / (25 * 64)
    data = revolution_response(own, speed=5.0, harmonics=3, error=20 + 8 * np.cos(2 * np.pi * steps))
    amplitude = data["dynamic_transmission_error_amplitude"].values[0, 0]
    assert_allclose(amplitude[0], 8.0, rtol=1e-4)
    assert amplitude[1:].max() < 1e-3
    assert data["bearing_force_amplitude"].sizes["order"] == 75
    with pytest.raises(InputError, match="more than 150"):
        revolution_response(own, speed=5.0, harmonics=3, error=np.zeros(100))


def test_alike_scene_is_told_so():
    with pytest.raises(InputError, match="all teeth alike"):
        revolution_response(scene({}), speed=1000.0)
