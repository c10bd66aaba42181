"""Loss of contact: both branches against time integration, softening and hysteresis, limits without it."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from gearbench.dynamics.analysis import response
from gearbench.dynamics.branches import branches, sweeps
from gearbench.dynamics.continuation import follow
from gearbench.dynamics.force_curve import force_curve
from gearbench.dynamics.model import Model
from gearbench.dynamics.nonlinear import nonlinear_response
from gearbench.dynamics.oscillator import Oscillator
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
SPEEDS = np.array([3400.0, 4000.0, 4600.0, 5000.0, 6400.0, 6500.0])


@cache
def rig():
    model = Model(scene=parse_scene(RIG))
    curve = force_curve(model.cycles[0], 256)
    oscillator = Oscillator(model=model, group=model.groups[0], curve=curve, harmonics=16, speeds=(3400.0, 6500.0))
    known = branches(oscillator, SPEEDS)
    return oscillator, known, known.solutions[sweeps(known, SPEEDS)]


def test_curve_folds_and_the_jump_is_down_the_speeds():
    """Softening: between the folds the sweep down stays on the branch with loss of contact, the sweep up does not."""
    oscillator, known, found = rig()
    assert any((np.diff(curve.parameter) < 0).any() and (np.diff(curve.parameter) > 0).any() for curve in known.curves)
    count = np.bincount(known.speed, minlength=len(SPEEDS))
    assert (count[1:4] >= 3).all()
    assert list(count[4:]) == [1, 1]
    assert (count % 2 == 1).all()
    rms = np.sqrt(2 * (found[..., 1:] ** 2).sum(axis=-1))
    assert (rms[1, 1:4] > 2 * rms[0, 1:4]).all()
    assert_allclose(found[0, 4:], found[1, 4:])
    kept = oscillator.curve.force(oscillator.values(found))[0].min(axis=-1) > 0
    assert kept[0].all()
    assert list(kept[1, 1:]) == [False, False, False, True, True]


@pytest.mark.parametrize("sweep", [0, 1])
@pytest.mark.parametrize("at", [1, 2, 4])
def test_branches_against_time_integration(sweep, at):
    """Started on the branch, time integration of the same force curve stays on it."""
    oscillator, _, found = rig()
    model, curve = oscillator.model, oscillator.curve
    mesh = 0
    J = 1 / np.diag(model.mechanics.mass)
    m = 1 / J.sum()
    k, F = model.stiffness[mesh, mesh], model.force[mesh]
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


def cubic(z, parameter):
    """λ = (z³ − 3z + 5)/10, of order one: folds at z = ±1."""
    return z**3 - 3 * z + 5 - 10 * parameter, np.diag(3 * z**2 - 3), np.array([-10.0])


def test_arc_length_goes_around_folds():
    """A curve followed from z = −2.2 to z = 2.2 meets each λ in between thrice."""
    curve = follow(cubic, np.array([-2.2]), ((-2.2) ** 3 + 6.6 + 5) / 10, 1, 0.02, 0.1)
    z, parameter = curve.z[:, 0], curve.parameter
    assert curve.ends == "range"
    assert_allclose((z**3 - 3 * z + 5) / 10, parameter, atol=1e-10)
    assert_allclose(parameter.max(initial=-9, where=z < 0), 0.7, atol=0.01)
    assert np.sum(np.diff(np.sign(np.diff(parameter))) != 0) == 2


def test_curves_end_where_they_close_or_grow():
    """A circle comes back to its start; λ = 1/2 + 1/z leaves for ever greater z, and is followed as far as is said."""

    def circle(z, parameter):
        return z**2 + (parameter - 0.5) ** 2 - 0.09, np.diag(2 * z), 2 * np.array([parameter - 0.5])

    closed = follow(circle, np.array([0.3]), 0.5, 1, 0.02, 0.05)
    assert closed.ends == "closed"
    assert_allclose(np.ptp(closed.parameter), 0.6, atol=0.01)

    def hyperbola(z, parameter):
        return z * (parameter - 0.5) - 1, np.array([[parameter - 0.5]]), z

    far = follow(hyperbola, np.array([2.5]), 0.9, -1, 0.02, 0.05, largest=20.0)
    assert far.ends == "size"
    assert 20 < far.z[-1, 0] < 25


def test_osu_50_with_little_damping():
    """Softening and hysteresis of the spur rig at ζ 0.01: going up contact is kept for longer.

    Curves that run off to large motions between both flanks are followed as far as the notes say, and the sweep ends.
    """
    tables = RIG | {
        "effects": RIG["effects"] | {"gear_body": {}},
        "pair": RIG["pair"] | {g: {"teeth": 50, "dedendum": 1.4, "bore_diameter": 50.0} for g in ("pinion", "wheel")},
        "system": {"damping_ratio": 0.01},
    }
    data = nonlinear_response(parse_scene(tables), speed=np.linspace(500, 6500, 200))
    assert "is followed to 20 × the mean deflection, not beyond, at" in data.attrs["notes"]
    assert "two stable responses, by the way the speed changes" in data.attrs["notes"]
    up, down = (data.sel(sweep=way, mesh="pair") for way in ("up", "down"))
    both = slice(1700, 2300)
    assert bool(up["contact_kept"].sel(speed=slice(1900, 2300)).all())
    assert not bool(down["contact_kept"].sel(speed=both).any())
    rms = "dynamic_transmission_error_rms"
    assert bool((down[rms] > 3 * up[rms]).sel(speed=both).all())
    # the branch bends to lower speeds: its motion grows as the speed falls
    assert bool((down[rms].sel(speed=slice(1700, 3300)).diff("speed") < 0).all())
