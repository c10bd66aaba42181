"""Flank compliance at many mesh phases: interpolated between corners, and one by one where that is not possible."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance import over_phases
from gearbench.compliance.flank import FlankCompliance, flank_matrix
from gearbench.compliance.over_phases import matrix_at_phases
from gearbench.geometry.action import contact_lines
from tests.compliance.test_flank import blocks
from tests.effects.test_gear_body import scene

PHASES = np.random.default_rng(5).random(400)


@pytest.fixture
def flanks():
    """Compliance of random directions on 5 × 12 polynomials of both gears of a helical pair, coupled to one tooth."""
    pair = scene("helical").pair
    return [
        FlankCompliance(gear=g, order=(5, 12), blocks=blocks(1, 60, seed=k), driven=k == 1)
        for k, g in enumerate(pair.gears)
    ]


@pytest.fixture
def computed(monkeypatch):
    """Numbers of positions that are computed, in the order of the calls."""
    numbers = []

    def counted(flanks, lines):
        numbers.append(len(lines.mesh_phase))
        return flank_matrix(flanks, lines)

    monkeypatch.setattr(over_phases, "flank_matrix", counted)
    return numbers


def test_many_phases_equal_those_computed_one_by_one(flanks, computed):
    lines = contact_lines(scene("helical").pair, PHASES, 9)
    expected = flank_matrix(flanks, lines)
    # rounding of the interpolation, about 1e-13 for thirty points
    assert_allclose(matrix_at_phases(flanks, lines), expected, rtol=0, atol=1e-12 * expected.max())
    assert sum(computed) < 150
    # other phases use what is known
    before = len(computed)
    other = contact_lines(scene("helical").pair, (PHASES + 0.3) % 1.0, 9)
    expected = flank_matrix(flanks, other)
    assert_allclose(matrix_at_phases(flanks, other), expected, rtol=0, atol=1e-12 * expected.max())
    assert len(computed) <= before + 1


def test_nodes_that_do_not_move_linearly_are_computed_one_by_one(flanks, computed):
    pair = scene("helical").pair
    middle = (pair.meshing.path_start + pair.meshing.path_end) / 2
    kinked = contact_lines(pair, PHASES, 9, [middle])
    assert_allclose(matrix_at_phases(flanks, kinked), flank_matrix(flanks, kinked), rtol=0, atol=0)
    assert computed[-1] > 200


def test_too_few_phases_are_noticed(flanks, computed, monkeypatch):
    """Three phases do not determine products of twelve polynomials: nothing is interpolated."""
    monkeypatch.setattr(over_phases, "phases_needed", lambda *_: 3)
    lines = contact_lines(scene("helical").pair, PHASES, 9)
    assert_allclose(matrix_at_phases(flanks, lines), flank_matrix(flanks, lines), rtol=0, atol=0)
    assert computed[-1] == len(PHASES)
