"""Hard cases of the catalogue with contact where flanks touch: off the line of action, at tips, before and after."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.solver import solve
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.profile_relief import Relief
from gearbench.effects.tip_relief import TipRelief
from gearbench.scene import Load, Resolution, Scene
from tests.stability.catalogue import CASES, HELICAL, SPUR, scene
from tests.support.contact_invariants import assert_solved, mirrored
from tests.support.gears import swapped


def off_line(scene: Scene, *more: object) -> Scene:
    return replace(scene, effects=(*scene.effects, OffLineContact(), *more))


def solved(scene: Scene, most: int = 40) -> None:
    tau, _ = mesh_phases(scene)
    assert_solved(solve(assemble(scene, scene_lines(scene, tau[:: max(1, tau.size // most)]))), residual=1e-10)


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if not case.slow])
def test_the_whole_catalogue_is_solved(name):
    """Every hard case, its own gaps on it, and with a relief of both tips where it has none."""
    given = CASES[name].build()
    m = given.pair.normal_module
    solved(off_line(given), most=12)
    if given.effect("tip_relief") is None:
        solved(off_line(given, TipRelief(amount=5 * m, length=0.3 * m)), most=12)


@pytest.mark.parametrize("name", ["undercut spur, z = 12", "β = 45°"])
def test_and_so_it_is_on_five_hundred_segments(name):
    scene = replace(CASES[name].build(), resolution=Resolution(gauss_points=2, segments=500))
    solved(off_line(scene, TipRelief(amount=10.0, length=0.3 * scene.pair.normal_module)), most=6)


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_gears_exchanged_touch_alike(pair, shape):
    """Seen from the wheel, at the same phase of motion and under the torque that the wheel has there.

    Off the line the torques of both gears are not in the ratio of their teeth, by the slope of the STE: half a percent.
    """
    reliefs = [Relief(amount=15.0, length=0.8, shape=shape), Relief(amount=10.0, length=1.2, shape=shape)]
    tau = np.array([0.11, 0.31, 0.62, 0.66, 0.93])
    scenes = [
        off_line(scene(each, torque=torque), TipRelief(pinion=one, wheel=other))
        for each, torque, one, other in ((pair, 150.0, *reliefs), (swapped(pair), 225.0, *reliefs[::-1]))
    ]
    lines = scene_lines(scenes[0], tau)
    here = solve(assemble(scenes[0], lines))
    assert lines.touch is not None
    # forces of the solution are moments about the pinion over its base radius
    own = here.force / lines.touch.levers[0]
    moment = (own * lines.touch.levers[1]).sum(axis=(1, 2)) / scenes[0].F_bn
    assert np.abs(moment - 1).max() > 1e-4
    turned = mirrored(pair, tau)
    for i in range(len(tau)):
        other = replace(scenes[1], load=Load(torque=225.0 * float(moment[i])))
        seen = scene_lines(other, turned[i : i + 1])
        there = solve(assemble(other, seen))
        # the work of both torques; rotations count at the phase of the gear that turns, and lines are cut into cells
        assert there.approach[0] * moment[i] == pytest.approx(here.approach[i], rel=3e-4)
        assert seen.touch is not None
        theirs = there.force[0] / seen.touch.levers[0][0]
        shares = (np.sort(each.sum(axis=1))[-2:] for each in (theirs, own[i]))
        assert_allclose(*shares, rtol=0, atol=2e-3 * scenes[0].F_bn)


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_continuous_in_the_load(pair):
    """From a thousandth to thrice the load, over starts of contact at kinks, tips and beyond the path: no steps."""
    given, tau = scene(pair), np.array([0.02, 0.33, 0.64, 0.67, 0.98])
    relief = TipRelief(amount=10.0, length=0.8)
    torque = np.geomspace(0.15, 450.0, 25)
    approach = []
    for t in torque:
        loaded = off_line(replace(given, load=Load(torque=float(t))), relief)
        approach.append(solve(assemble(loaded, scene_lines(loaded, tau))).approach)
    approach = np.array(approach)
    step = np.diff(approach, axis=0)
    assert step.min() > 0
    # compliance falls with the load, or stays: no more than the softest single pair times the step of the torque
    assert (step / np.diff(torque)[:, None]).max() < 1.5 * (approach[1] - approach[0]).max() / (torque[1] - torque[0])
