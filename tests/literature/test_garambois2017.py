"""Garambois, Perret-Liaudet, Rigaud, Mechanism and Machine Theory 117 (2017) 78–95.

doi 10.1016/j.mechmachtheory.2017.07.008. The standard gear SC of Table 2 without errors. The values were worked out
independently of this program with the paper's 9-unknown plate and a load-dependent Hertz law of the Weber–Banaschek
kind; the paper's own, with errors of class 6, are m_k 18.0 % and m_ste 0.48 µm.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.solver import solve
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.pair import Member, Pair
from gearbench.results.cycle import fluctuation_rms, relative_rms
from gearbench.scene import Load, Resolution, Scene
from gearbench.simulation import simulate
from gearbench.solution import solve_lines

GEAR = Member(teeth=38, addendum=1.0, dedendum=1.25)
SC = Scene(
    name="SC",
    pair=Pair(normal_module=1.0, face_width=8.0, centre_distance=38.0, pinion=GEAR, wheel=GEAR),
    load=Load(torque=10.0),
    effects=(ToothBending(basis="paper"), Hertz(law="weber_banaschek")),
)
YANG_SUN = replace(SC, effects=(ToothBending(basis="paper"), Hertz(law="yang_sun")))


def at_64_phases_from_the_entry(scene: Scene) -> tuple[float, float]:
    """RMS of k [%] and of δ [µm] at τ = 0, 1/64, …, as in the hand computation."""
    scene = replace(scene, resolution=Resolution(positions=64))
    lines = scene_lines(scene, np.arange(64) / 64)
    weight = np.full(64, 1 / 64)
    s = solve_lines(scene, lines, weight)
    c = s.cycle
    return float(relative_rms(c.mesh_stiffness, weight)), float(fluctuation_rms(c.transmission_error, weight))


@pytest.mark.parametrize("resolution", [Resolution(), Resolution(positions=64)], ids=["default", "64 positions"])
def test_standard_gear(resolution):
    out = simulate(replace(SC, resolution=resolution))
    assert float(out.mesh_stiffness_rms) == pytest.approx(18.3, abs=0.5)
    assert float(out.transmission_error_rms) == pytest.approx(0.495, abs=0.015)


def test_standard_gear_at_the_phases_of_the_hand_computation():
    """17.9 % and 0.496 µm by hand, with the depth t_i taken as half the tooth thickness: 1 % in STE."""
    m_k, ste = at_64_phases_from_the_entry(SC)
    assert m_k == pytest.approx(17.9, abs=0.1)
    assert ste == pytest.approx(0.496, abs=0.006)


def test_standard_gear_with_a_constant_contact_compliance():
    """17.2 % and 0.33 µm: both digits that are given."""
    m_k, ste = at_64_phases_from_the_entry(YANG_SUN)
    assert m_k == pytest.approx(17.2, abs=0.05)
    assert ste == pytest.approx(0.33, abs=0.005)


def test_uniform_phases_underestimate_the_fluctuation():
    """k jumps where a pair enters: 16 phases from the entry give about a point of per cent less than the integral."""
    out = simulate(SC)
    lines = scene_lines(SC, np.arange(16) / 16)
    coarse = float(relative_rms(solve(assemble(SC, lines)).stiffness, np.full(16, 1 / 16)))
    assert 0.7 < float(out.mesh_stiffness_rms) - coarse < 1.7  # 18.7 − 17.4 by hand, k from the secant law


def test_clamped_teeth_are_stiffer_than_the_norm():
    """ISO 6336-1 describes teeth on a body; clamped ones are about 1.6 times stiffer: 33 against 20 N/(mm·µm)."""
    k = float(simulate(SC).mesh_stiffness_mean) / SC.pair.face_width
    assert k == pytest.approx(33, abs=1.5)
