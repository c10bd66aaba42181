"""Forces that wander over the face: the limit of slow speed, statics of the bearings, a model of many slices."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import simulate
from gearbench.dynamics.analysis import response
from gearbench.dynamics.model import Model
from gearbench.results.cycle import Phases, fourier_matrix
from tests.support.systems import shafts, spur_scene

SUPPORT = {"radial_stiffness": 250.0, "axial_stiffness": 150.0}
TEETH = {"hertz": {}, "tooth_bending": {"model": "plate", "order": [3, 3]}}
RELIEF = {"tip_relief": {"amount": 12.0, "length": 1.5}, "crowning": {"amount": 4.0}}
SEATS = {
    "straddled": {"bearings": [{"position": p, **SUPPORT} for p in (0.0, 200.0)]},
    "overhung": {
        "gears": [{"gear": "pinion", "position": 160.0}],
        "bearings": [{"position": p, **SUPPORT} for p in (20.0, 120.0)],
    },
}


def on_shafts(seat, helix, effects, **more):
    wheel = {"sections": [{"length": 100.0, "diameter": 60.0}], "bearings": [{"position": p, **SUPPORT} for p in (0.0, 100.0)]}  # fmt: skip  # noqa: E501
    return spur_scene(shafts(SEATS[seat], wheel), helix=helix, effects=effects, segments=15, **more)


@pytest.mark.parametrize("seat", ["straddled", "overhung"])
@pytest.mark.parametrize("relief", [{}, RELIEF], ids=["plain", "relieved"])
def test_slow_response_is_the_simulation(seat, relief):
    """At 1 % of the lowest natural frequency, transmission error and bearing forces are those of statics."""
    scene = on_shafts(seat, 15.0, TEETH | relief)
    lowest = Model(scene=scene).modes.frequency
    speed = 0.01 * lowest[lowest > 0][0] / (2 * np.pi) * 60 / scene.pair.pinion.teeth
    data, rest = response(scene, speed=speed), simulate(scene)
    name = "transmission_error"
    slow, static = (
        found[f"{of}{name}_amplitude"].values.ravel() * np.exp(1j * found[f"{of}{name}_phase"].values.ravel())
        for found, of in ((data, "dynamic_"), (rest, ""))
    )
    assert np.linalg.norm(slow - static) < 0.005 * np.linalg.norm(static)
    # the second bearing of the pinion by the balance of moments about the first: the force stands at its centroid in
    # the plane of action
    fine = replace(scene, resolution=replace(scene.resolution, segments=90))  # loads on cells are first order
    loaded = simulate(fine, outputs=("line_load",))
    meshing, phases = scene.pair.meshing, Phases.of_dataset(loaded)
    beta = meshing.beta_b
    force = (loaded["line_load"] * loaded["segment_length"]).values * np.cos(beta)
    u, y = loaded["path_position"].values, loaded["face_position"].values
    moment = (force * (y + (u - meshing.pitch_point) * np.tan(beta))).sum(axis=(1, 2))
    first, second = (item["position"] for item in SEATS[seat]["bearings"])
    expected = np.abs(2 * fourier_matrix(phases, 10) @ moment) / (second - first)
    forces = data["bearing_force_amplitude"].sel(bearing="input 2", direction=["x", "y"]).values[0, 0]
    assert_allclose(np.linalg.norm(forces), np.linalg.norm(expected), rtol=0.01)
    assert expected.max() > 1e-3 * scene.F_bt
