"""Curves over the mesh cycle and mesh orders: against closed forms."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from gearbench.contact.phases import gauss_phases, uniform_phases
from gearbench.results.cycle import CycleCurve, MeshCycle, Phases, coefficients, fourier, panels
from gearbench.results.responses import response


def gauss(points, edges=(0.0, 0.3)):
    phase, weight = gauss_phases(edges, points)
    return Phases(phase=phase, weight=weight, size=points)


def uniform(count):
    phase, weight = uniform_phases(count)
    return Phases(phase=phase, weight=weight, size=None)


def dataset(phases, values):
    coords = {name: ("position", x) for name, x in phases.coordinates.items()}
    return xr.Dataset({"k": ("position", values)}, coords=coords)


@pytest.mark.parametrize("moved", ["across the end", "gap", "size"])
def test_phases_outside_their_panels_are_refused(moved):
    phase, weight = gauss_phases((0.0, 0.3), 4)
    if moved == "across the end":
        phase = np.sort((phase + 0.1) % 1.0)
    elif moved == "gap":
        phase = phase[4:]
    with pytest.raises(ValueError, match=r"panels of 5|Gauss points of each panel"):
        Phases(phase=phase, weight=weight, size=5 if moved == "size" else 4)


def square(phase):
    return np.where(phase < 0.3, 5.0, 2.0)


def test_orders_of_a_square_wave():
    phases, n = gauss(8), np.arange(1, 11)
    expected = 2 * 3.0 * np.abs(np.sin(np.pi * n * 0.3)) / (np.pi * n)
    # a Gauss panel of a constant: exact but for the quadrature of the wave, spectrally small
    assert_allclose(fourier(dataset(phases, square(phases.phase)), "k"), expected, atol=1e-12)


def test_orders_of_a_cosine_from_uniform_phases_and_the_limit_of_what_they_resolve():
    phases = uniform(12)
    values = 7 + 3 * np.cos(2 * np.pi * 4 * phases.phase + 0.3)
    amplitude = fourier(dataset(phases, values), "k")
    assert_allclose(amplitude[:5], [0, 0, 0, 3, 0], atol=1e-13)
    assert np.isnan(amplitude[5:]).all()


@pytest.mark.parametrize("phases", [uniform(64), gauss(24)], ids=["uniform", "gauss"])
def test_coefficients_carry_the_phase_of_every_curve(phases):
    """x = c_0 + Σ Re(2 c_n e^{2πi n τ}): a phase of +0.4 puts the crest 0.4/2πn before τ = 0."""
    amplitude, lead = np.array([3.0, 0.5, 0.02]), np.array([[0.4, -2.0, 3.0], [-0.1, 1.0, 0.0]])
    n = np.arange(1, 4)
    curves = 7 + np.einsum("n,snp->sp", amplitude, np.cos(2 * np.pi * np.outer(n, phases.phase) + lead[..., None]))
    c = coefficients(phases, curves, 5)
    assert_allclose(2 * np.abs(c[:, :3]), np.broadcast_to(amplitude, (2, 3)), atol=1e-10)
    assert_allclose(np.angle(c[:, :3]), lead, atol=1e-9)
    assert_allclose(c[:, 3:], 0, atol=1e-10)


def test_many_cycles_answer_as_each_by_itself():
    phases, rng = gauss(6), np.random.default_rng(1)
    ste, k = rng.normal(3, 1, (2, 5, len(phases.phase)))
    together = MeshCycle(phases=phases, transmission_error=ste, mesh_stiffness=k)
    for name in ("mesh_stiffness_rms", "transmission_error_peak_to_peak", "mesh_stiffness_amplitude_3"):
        reduce = response(name).reduce
        alone = [
            reduce(MeshCycle(phases=phases, transmission_error=x, mesh_stiffness=y))
            for x, y in zip(ste, k, strict=True)
        ]
        assert_allclose(reduce(together), alone, rtol=1e-13)


def test_phases_of_a_dataset_are_those_it_was_made_with():
    for phases in (gauss(5, (0.0, 0.25, 0.7)), gauss(1), uniform(7)):
        found = Phases.of_dataset(dataset(phases, phases.phase))
        assert found.size == phases.size
        if found.size is not None:
            assert_allclose(found.edges, phases.edges, atol=1e-15)
    assert_allclose(gauss(5, (0.0, 0.25, 0.7)).edges, [[0, 0.25], [0.25, 0.7], [0.7, 1]], atol=1e-15)


@pytest.mark.parametrize("points", [1, 3, 8])
def test_panels_are_the_polynomials_up_to_the_jumps(points):
    phases = gauss(points)
    polynomial = np.polynomial.Polynomial([1.0, -2.0, 3.0][:points])
    values = polynomial(phases.phase) + square(phases.phase)
    curves = panels(dataset(phases, values), "k")
    assert len(curves) == 2
    assert_allclose([curves[0][0][0], curves[0][0][-1], curves[1][0][-1]], [0.0, 0.3, 1.0], atol=1e-14)
    for (x, y), level in zip(curves, (5.0, 2.0), strict=True):
        assert_allclose(y, polynomial(x) + level, atol=1e-12)
    everywhere = np.concatenate([y for _, y in curves])
    assert CycleCurve(phases=phases, values=values).peak_to_peak == pytest.approx(np.ptp(everywhere), rel=1e-3)


def test_peak_to_peak_reaches_the_transitions():
    """Pair 1: 8 Gauss points a panel against 20 000 uniform positions."""
    from dataclasses import replace

    from gearbench.library.garambois2017 import case
    from gearbench.scene import Resolution
    from gearbench.simulation import simulate

    names = ("transmission_error_peak_to_peak", "mesh_stiffness_peak_to_peak")
    scene = case(1)
    coarse = simulate(scene, outputs=names)
    fine = simulate(replace(scene, resolution=Resolution(positions=20_000)), outputs=names)
    for name in names:
        # the nearest uniform position is half a step off the jump: relative 1e-5
        assert_allclose(coarse[name], fine[name], rtol=3e-5)


def errors_and_floors(values, exact, low):
    """Errors of harmonics and of peak-to-peak over their noise floors: of panels with 5 points against 400 of 8."""
    phases, fine = gauss(5, (0.0, 0.3, 0.6)), gauss(8, tuple(np.arange(400) / 400))
    curve = CycleCurve(phases=phases, values=values(phases.phase))
    floor = curve.noise_floor(np.zeros(15), located=0.0)
    found, wanted = (2 * np.abs(coefficients(each, values(each.phase))) for each in (phases, fine))
    peak = abs(curve.peak_to_peak - (exact - low))
    return np.abs(found - wanted), floor, peak, curve.peak_to_peak_floor(floor)


@pytest.mark.parametrize("at", [0.32, 0.37, 0.41, 0.48, 0.5, 0.58])
def test_noise_floors_see_a_kink_within_a_panel(at):
    error, floor, peak, doubt = errors_and_floors(lambda x: np.abs(x - at), max(at, 1 - at), 0.0)
    assert np.all(error < 3.1 * floor)  # the share is that of all positions of a kink, in RMS
    assert np.all(floor < 0.01)
    assert peak < 2 * doubt < 0.2


def test_noise_floors_see_no_error_where_panels_end_at_a_jump():
    error, floor, peak, doubt = errors_and_floors(square, 5.0, 2.0)
    assert max(error.max(), floor.max(), peak, doubt) < 1e-12


def test_peak_to_peak_is_known_where_a_curve_that_runs_on_jumps_within_a_panel():
    """Polynomials miss half of the jump; no extreme is missed."""
    *_, floor, peak, doubt = errors_and_floors(lambda x: np.where(x < 0.45, x, 3 + x), 4.0, 0.0)
    assert peak <= doubt < 3 * np.sqrt((floor**2).sum())


@pytest.mark.parametrize("width", [0.005, 0.03, 0.08])
def test_peak_to_peak_of_a_steep_rise_is_its_height_wherever_it_lies_on_a_panel(width):
    """Polynomials overshoot by up to a quarter, also where their last coefficient vanishes."""
    phases = gauss(5, (0.0, 0.3, 0.6))
    for at in np.linspace(0.3, 0.6, 61):
        rise = np.clip((phases.phase - at) / width, 0.0, 1.0)
        assert 1.0 <= CycleCurve(phases=phases, values=rise).peak_to_peak < 1.01


@pytest.mark.parametrize("points", [6, 8, 10])
def test_peak_to_peak_of_a_bump_is_its_height_where_a_few_points_hardly_resolve_it(points):
    """The greatest sample is up to 3, 5 and 8 % too low."""
    phases = gauss(points, (0.0, 0.3, 0.6))
    for at in np.linspace(0.41, 0.49, 31):
        bump = 1 / (1 + ((phases.phase - at) / 0.25) ** 2) ** 4
        assert abs(CycleCurve(phases=phases, values=bump).peak_to_peak - 1) < {6: 0.03, 8: 0.005, 10: 0.002}[points]


def test_few_uniform_phases_give_a_noise_floor_of_peak_to_peak():
    """Of the ten orders they know three."""
    phases = uniform(8)
    curve = CycleCurve(phases=phases, values=square(phases.phase))
    floor = curve.noise_floor(np.zeros(8))
    assert np.isnan(floor).sum() == 7
    doubt = curve.peak_to_peak_floor(floor)
    assert doubt == pytest.approx(2 * np.sqrt(10) * np.nanmax(floor))
