"""Coarse solutions under many loads."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import read_scene
from gearbench.contact.coarse_solution import COARSE_PHASES, coarse_solution
from gearbench.contact.solver import Guess, solve
from tests.support.paths import ROOT


@pytest.mark.parametrize("name", ["nasa_28", "e_drive_output"])
def test_each_load_is_solved_to_the_square_of_its_residual(name):
    scene = read_scene(ROOT / "examples" / "gears" / f"{name}.toml").without("off_line_contact")
    # light, and 20 and 0.5 times the load before
    shares = np.array([0.1, 2.0, 1.0, 1.2])
    under = coarse_solution(scene, COARSE_PHASES).under(shares)
    exact = Guess.empty(under.problem)
    solve(under.problem, exact)
    # ``solve_roughly`` leaves the square of 1e-6, or more where a segment is about to touch
    assert_allclose(under.guess.delta, exact.delta, rtol=1e-9)
    assert_allclose(under.guess.q, exact.q, rtol=0, atol=1e-8 * np.abs(exact.q).max())
