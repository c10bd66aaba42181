"""Root stress from the load as it was found, against ISO 6336-3 where the load is that of the norm."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import simulate, sweep
from gearbench.results.flank import loaded_root_stress
from gearbench.solution import solve_scene
from gearbench.strength.bending import RootBending
from tests.results.test_flank_outputs import HELICAL, SPUR, scene

NAME = "loaded_root_stress"


@pytest.mark.parametrize("index", [0, 1])
def test_single_contact_of_a_spur_pair_is_the_norms(index):
    """One pair carries all, evenly: F_t Y_F Y_S/(b m_n) at the height of the load, the greatest at its outermost."""
    solved = solve_scene(scene())
    pair, lines, gear = solved.scene.pair, solved.lines, solved.scene.pair.gears[index]
    alone = np.flatnonzero(lines.active.sum(axis=1) == 1)
    bending, found = RootBending(pair=pair, gear=index), []
    for position in alone:
        (at,) = np.flatnonzero(lines.active[position])
        factors = bending.factors_at(math.hypot(gear.base_radius, lines.rolls[index][position, at, 0]))
        found.append(math.prod(factors) * 150e3 / pair.gears[0].pitch_radius / 24.0 / 3.0)
    # shared evenly, two pairs put less on the root than one at its outer end
    assert float(loaded_root_stress(solved)[index]) == pytest.approx(max(found), rel=1e-12)
    # the last phase lies a hundredth of the panel before the outer point of single contact
    assert max(found) == pytest.approx(bending.stress(150.0), rel=2e-3)
    assert max(found) < bending.stress(150.0)


@pytest.mark.parametrize("tables", [SPUR, HELICAL], ids=["spur", "helical"])
def test_it_is_proportional_to_the_load_of_a_linear_contact(tables):
    found = sweep(scene(tables), torque=[50.0, 200.0], outputs=[NAME])[NAME]
    assert found.dims == ("torque", "gear")
    assert_allclose(found.sel(torque=200.0), 4 * found.sel(torque=50.0), rtol=1e-11)


def test_load_on_one_end_counts_by_no_more_than_the_face_load_factor():
    uneven = scene(effects={**SPUR["effects"], "helix_slope": {"pinion": 15.0}})
    even = simulate(scene(), outputs=[NAME])
    found = simulate(uneven, outputs=(NAME, "face_load_factor"))
    for ratio in (found[NAME] / even[NAME]).values:
        assert 1.05 < ratio < float(found["face_load_factor"]) * 1.001


def test_a_load_nearer_to_the_tip_weighs_more():
    bending = RootBending(pair=scene().pair, gear=0)
    radius = np.linspace(35.0, bending.tooth.tip_radius, 9)
    loaded = bending.loaded(radius)
    assert np.all(np.diff(loaded) > 0)
    assert loaded[-1] == pytest.approx(math.prod(bending.factors_at(bending.tooth.tip_radius)), rel=1e-12)
