"""A ring on its shaft: forces by statics, springs of bearings in the transmission error, hands."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gearbench import response, simulate
from gearbench.scene_file import parse_scene
from gearbench.system.frame import MeshFrame
from tests.geometry.test_internal import example, internal


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("hand", [1, -1])
def test_forces_on_pinion_and_ring_balance(turn, hand):
    """Both turn the same way: the pinion is held back by r_b1, the ring pushed on by r_b2, and away from the mesh."""
    pair = internal(24, 72, a=49.0, helix_angle=10.0, wheel={"addendum": 0.8})
    frame = MeshFrame(pair=pair, across=(0.6, 0.8), turn=turn, hand=hand, middle=(0.0, 0.0))
    for u in (pair.meshing.path_start, pair.meshing.pitch_point):
        one, two = frame.wrench(0, u), frame.wrench(1, u)
        assert one[5] == pytest.approx(-turn * pair.gears[0].base_radius)
        assert two[5] == pytest.approx(-turn * pair.gears[1].base_radius)
        np.testing.assert_allclose(one[:3] + two[:3], 0.0, atol=1e-12)
        assert two[:3] @ [0.6, 0.8, 0.0] == pytest.approx(math.sin(pair.meshing.alpha_wt))


def on_shafts(stiffness: float):
    """The example on two stiff shafts, each in two radial bearings of a stiffness [N/µm]."""
    tables = example()
    shafts = []
    for name in ("pinion", "wheel"):
        bearings = [{"position": at, "radial_stiffness": stiffness} for at in (0.0, 80.0)]
        bearings[0]["axial_stiffness"] = 1e6
        shafts.append(
            {
                "name": f"shaft of {name}", "sections": [{"length": 80.0, "diameter": 300.0}], "bearings": bearings,
                "gears": [{"gear": name, "position": 40.0}], "coupling": {"position": 40.0},
            }
        )  # fmt: skip
    return parse_scene({**tables, "system": {"shafts": shafts}})


def test_bearings_yield_by_what_their_springs_give():
    """Between stiff and soft bearings each gear moves along the line of action by F/2k."""
    stiff, soft = (on_shafts(k) for k in (1e6, 200.0))
    more = [float(simulate(scene)["transmission_error_mean"]) for scene in (stiff, soft)]
    F = stiff.F_bt
    assert more[1] - more[0] == pytest.approx(2 * F * (1 / 400 - 1 / 2e6), rel=2e-3)


def test_slow_response_is_static():
    scene = parse_scene({**example(resolution={"positions": 64, "segments": 7}), "system": {"damping_ratio": 0.05}})
    static, slow = simulate(scene), response(scene, speed=[1.0])
    first = float(static["transmission_error_amplitude"][0])
    assert float(slow["dynamic_transmission_error_amplitude"].squeeze()[0]) == pytest.approx(first, rel=0.05)
