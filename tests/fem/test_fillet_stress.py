"""Stress on the fillet from the condensed sector: plane strain by a mesh of triangles, mirrors, sums."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.circulant import circulant_compliance, condensed_sector
from fem_reference.fillet_stress import Fillet, FilletStress, fillet_stress
from fem_reference.refinement import Level
from fem_reference.section import Body
from gearbench.geometry.action import contact_lines
from gearbench.geometry.pair import Member, Pair
from tests.gears import standard_gear


def test_uniform_strain_gives_its_stress_on_the_surface(steel):
    """u = e_y y: σ_yy = λ + 2μ, σ_RR = σ_θθ = λ; along outline and helix of a spur gear λ, λ + 2μ, 0."""
    section = Level(body=Body(gear=standard_gear(20), bore_radius=5.0), number=3, waves=2).section
    fillet = Fillet(section=section)
    F0, F1 = fillet.functionals(steel)
    one = np.tile([0.0, 0.0, 1.0], len(section.positions))
    lam = steel.E * steel.nu / ((1 + steel.nu) * (1 - 2 * steel.nu))
    found = (F1.T @ one).reshape(-1, 3)  # ∂u_y/∂y = 1
    assert_allclose(found, np.tile([lam, lam + steel.E / (1 + steel.nu), 0.0], (len(found), 1)), atol=1e-6 * lam)
    assert_allclose(F0.T @ one, 0, atol=1e-6 * lam)
    R = fillet.radius
    assert R.min() < section.body.gear.root_radius + 0.02
    assert R.max() > section.body.gear.form_radius - 0.02
