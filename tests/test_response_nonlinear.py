"""Loss of contact: both branches against time integration, softening and hysteresis, limits without it."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from gearbench.dynamics.analysis import response
from gearbench.dynamics.continuation import follow
from gearbench.dynamics.force_curve import force_curve
from gearbench.dynamics.model import Model
from gearbench.dynamics.nonlinear import Oscillator, at_speeds, nonlinear_response, solution_curve
from gearbench.scene_file import parse_scene

#: Spur rig gears of Kahraman and Blankenship, 50/50, with play.
RIG = {
    "pair": {
        "normal_module": 3.0,
        "face_width": 20.0,
        "centre_distance": 150.0,
        "backlash": 0.15,
        "pinion": {"teeth": 50, "dedendum": 1.4},
        "wheel": {"teeth": 50, "dedendum": 1.4},
    },
    "load": {"torque": 200.0},
    "effects": {"tooth_bending": {"model": "solid"}, "hertz": {}, "tip_relief": {"amount": 10.0, "length": 1.5}},
    "system": {"damping_ratio": 0.02},
}
SPEEDS = np.array([4000.0, 4600.0, 5000.0, 6400.0])


@cache
def rig():
    model = Model(scene=parse_scene(RIG))
    curve = force_curve(model.cycles[0], 256)
    oscillator = Oscillator(model=model, group=model.groups[0], curve=curve, harmonics=16, speeds=(3400.0, 6500.0))
    z, parameter = solution_curve(oscillator)
    return oscillator, z, parameter, *at_speeds(oscillator, z, parameter, SPEEDS)


def test_curve_folds_and_the_jump_is_down_the_speeds():
    """Softening: between the folds the sweep down stays on the branch with loss of contact, the sweep up does not."""
    oscillator, _, parameter, found, _, count = rig()
    assert (np.diff(parameter) < 0).any()
    assert list(count >= 3) == [True, True, True, False]
    assert count[3] == 1
    assert (count % 2 == 1).all()
    rms = np.sqrt(2 * (found[..., 1:] ** 2).sum(axis=-1))
    assert (rms[1, :3] > 2 * rms[0, :3]).all()
    assert_allclose(found[0, 3], found[1, 3])
    kept = oscillator.curve.force(oscillator.values(found))[0].min(axis=-1) > 0
    assert list(kept[0]) == [True, True, True, True]
    assert list(kept[1]) == [False, False, False, True]


@pytest.mark.parametrize("sweep", [0, 1])
@pytest.mark.parametrize("at", [0, 1, 3])
def test_branches_against_time_integration(sweep, at):
    """Started on the branch, time integration of the same force curve stays on it."""
    oscillator, _, _, found, _, _ = rig()
    model, curve = oscillator.model, oscillator.curve
    mesh = 0
    J = 1 / np.diag(model.mechanics.mass)
    m = 1 / J.sum()
    k, F = model.stiffness[mesh], model.force[mesh]
    c = 2 * 0.02 * np.sqrt(k * m)
    omega = float(model.omega(oscillator.group, SPEEDS[at]))
    T, steps = 2 * np.pi / omega, curve.steps

    def force(t, x):
        turn = (t / T % 1.0) * steps
        i = int(turn)
        values = np.full(steps, x)
        f = curve.force(values)[0]
        return (1 - turn + i) * f[i % steps] + (turn - i) * f[(i + 1) % steps]

    z = found[sweep, at]
    n = np.arange(1, oscillator.harmonics + 1)
    wave = oscillator.unit * (z[1::2] + 1j * z[2::2])
    start = [oscillator.unit * z[0] + 2 * wave.real.sum(), 2 * (1j * omega * n * wave).real.sum()]
    t = np.arange(64) / 64 * T + 3 * T
    y = solve_ivp(
        lambda s, y: [y[1], (F - force(s, y[0]) - c * y[1]) / m],
        (0, 4 * T), start, method="RK45", rtol=1e-6, atol=1e-10, max_step=T / 128, t_eval=t,
    ).y[0]  # fmt: skip
    own = oscillator.unit * z[0] + 2 * (np.exp(1j * omega * np.outer(t, n)) @ wave).real
    # orders above 16 and the steps of the force over time leave some thousandths
    assert_allclose(y, own, atol=0.01 * np.ptp(own))


def test_with_a_linear_law_and_contact_kept_it_is_the_linear_response():
    """A law linear in the load, no relief: F is linear in x while flanks touch, both answers solve one equation."""
    tables = RIG | {
        "pair": RIG["pair"] | {"helix_angle": 15.0, "centre_distance": 155.4},
        "effects": {"tooth_bending": {"model": "plate", "order": [3, 3]}, "hertz": {"law": "yang_sun"}},
        "system": {"damping_ratio": 0.1},
    }
    scene = parse_scene(tables)
    speed = np.array([1200.0, 2300.0])
    one, two = (run(scene, speed=speed, harmonics=8) for run in (response, nonlinear_response))
    assert bool(two["contact_kept"].all())
    name = "dynamic_transmission_error_amplitude"
    linear, whole = one[name].values[:, 0], two[name].sel(sweep="up").values[:, 0]
    assert_allclose(whole[:, :4], linear[:, :4], atol=0.01 * linear.max())


def test_force_curve_meets_the_contact_at_the_mean_force():
    """F(δ_s(τ), τ) = F̄ and ∂F/∂x = k(τ), where the curve has a knot."""
    oscillator, *_ = rig()
    curve, model = oscillator.curve, oscillator.model
    level = 9  # the mean force
    f, _ = curve.force(curve.knots[:, level])
    assert_allclose(f, model.force[0], rtol=1e-9)
    assert_allclose(curve.force(curve.knots[:, 0] - 1e-3)[0], 0.0, atol=1e-9)
    # back flanks: beyond the play the force is negative
    assert (curve.force(np.full(curve.steps, -curve.backlash - 0.02))[0] < 0).all()


def test_arc_length_goes_around_folds():
    """λ = z³ − 3z + … has folds at z = ±1: a curve followed from z = −2.2 to z = 2.2 meets each λ in between thrice."""

    def cubic(z, parameter):
        return z**3 - 3 * z - parameter, np.diag(3 * z**2 - 3), -np.ones(1)

    start = (-2.2) ** 3 + 6.6
    z, parameter = follow(cubic, np.array([-2.2]), start, 4.0, 0.05, 0.2)
    assert_allclose(z[:, 0] ** 3 - 3 * z[:, 0], parameter, atol=1e-9)
    assert_allclose(parameter.max(initial=-9, where=z[:, 0] < 0), 2.0, atol=0.02)
    assert np.sum(np.diff(np.sign(parameter)) != 0) == 3
