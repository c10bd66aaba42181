"""Hard cases of the catalogue with contact where flanks touch: off the line of action, at tips, before and after."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearbench.contact.assemble import assemble, mesh_phases, scene_lines
from gearbench.contact.solver import solve
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.scene import Resolution, Scene
from tests.stability.catalogue import CASES

#: Undercut: the form circle lies inside the path of contact that the mate's tip would allow.
HARD = [
    "undercut spur, z = 12",
    "teeth nearly pointed",
    "r_f < r_b",
    "x at its upper limit",
    "x at its lower limit",
    "β = 0.01°",
    "β = 45°",
    "ε_γ just above 1, spur",
    "b/m = 100",
    "two thousand teeth",
]


def off_line(scene: Scene, *more: object) -> Scene:
    return replace(scene, effects=(*scene.effects, OffLineContact(), *more))


def solved(scene: Scene, most: int = 40) -> None:
    """Finite, P ≥ 0, residuals to 1e-10, k > 0."""
    tau, _ = mesh_phases(scene)
    s = solve(assemble(scene, scene_lines(scene, tau[:: max(1, tau.size // most)])))
    for values in (s.force, s.approach, s.stiffness):
        assert np.all(np.isfinite(values))
    assert s.force.min() >= 0
    assert s.equilibrium.max() <= 1e-10
    assert s.complementarity.max() <= 1e-10
    assert s.stiffness.min() > 0


@pytest.mark.parametrize("name", HARD)
def test_hard_cases_are_solved(name):
    scene = CASES[name].build()
    if scene.effect("hertz") is None:
        pytest.fail("the case has no contact law: choose another")
    solved(off_line(scene))


@pytest.mark.parametrize("name", ["undercut spur, z = 12", "teeth nearly pointed", "β = 45°"])
def test_so_are_they_with_relief(name):
    scene = CASES[name].build()
    m = scene.pair.normal_module
    solved(off_line(scene, TipRelief(amount=5 * m, length=0.3 * m)))


@pytest.mark.parametrize("name", ["undercut spur, z = 12", "β = 45°"])
def test_and_on_five_hundred_segments(name):
    scene = replace(CASES[name].build(), resolution=Resolution(gauss_points=2, segments=500))
    solved(off_line(scene, TipRelief(amount=10.0, length=0.3 * scene.pair.normal_module)), most=6)
