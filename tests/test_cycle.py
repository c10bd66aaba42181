"""Curves over the mesh cycle and mesh orders: against closed forms."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from gearbench.contact.phases import gauss_phases, uniform_phases
from gearbench.results.cycle import fourier, panels


def dataset(phase, values, scene):
    return xr.Dataset({"k": ("position", values)}, coords={"mesh_phase": ("position", phase)}, attrs={"scene": scene})


def square(phase):
    return np.where(phase < 0.3, 5.0, 2.0)


def test_orders_of_a_square_wave():
    phase, _ = gauss_phases((0.0, 0.3), 8)
    n = np.arange(1, 11)
    expected = 2 * 3.0 * np.abs(np.sin(np.pi * n * 0.3)) / (np.pi * n)
    # a Gauss panel of a constant: exact but for the quadrature of the wave, spectrally small
    assert_allclose(fourier(dataset(phase, square(phase), ""), "k"), expected, atol=1e-12)


def test_orders_of_a_cosine_from_uniform_phases_and_the_limit_of_what_they_resolve():
    phase, _ = uniform_phases(12)
    values = 7 + 3 * np.cos(2 * np.pi * 4 * phase + 0.3)
    amplitude = fourier(dataset(phase, values, "[resolution]\npositions = 12\n"), "k")
    assert_allclose(amplitude[:5], [0, 0, 0, 3, 0], atol=1e-13)
    assert np.isnan(amplitude[5:]).all()


@pytest.mark.parametrize("points", [1, 3, 8])
def test_panels_are_the_polynomials_up_to_the_jumps(points):
    phase, _ = gauss_phases((0.0, 0.3), points)
    polynomial = np.polynomial.Polynomial([1.0, -2.0, 3.0][:points])
    scene = f"[resolution]\ngauss_points = {points}\n"
    curves = panels(dataset(phase, polynomial(phase) + square(phase), scene), "k")
    assert len(curves) == 2
    if points > 1:
        assert_allclose([curves[0][0][0], curves[0][0][-1], curves[1][0][-1]], [0.0, 0.3, 1.0], atol=1e-14)
    for (x, y), level in zip(curves, (5.0, 2.0), strict=True):
        assert_allclose(y, polynomial(x) + level, atol=1e-12)


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
