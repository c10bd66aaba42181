"""Forces that wander over the face: the limit of slow speed, statics of the bearings, a model of many slices."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import simulate
from gearbench.dynamics.analysis import response
from gearbench.dynamics.balance import Excitation, solve
from gearbench.dynamics.model import Model
from gearbench.dynamics.modes import modes
from gearbench.effects.base import ComplianceEffect, LineLaw
from gearbench.effects.shafts import factor
from gearbench.results.cycle import Phases, fourier_matrix
from gearbench.system.gearbox import FACE_POINTS
from gearbench.system.mechanics import mechanics, static_equilibrium
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
    # mean loads: −F t at its mean place on the face, t along the line of action, and F tan β_b at the pitch point
    alpha = meshing.alpha_wt
    t, across = np.array([np.sin(alpha), np.cos(alpha)]), scene.pair.gears[0].base_radius / np.cos(alpha)
    place = scene.system.shafts[0].gears[0].position - meshing.face_width / 2 + phases.weight @ moment / scene.F_bt
    on_second = -scene.F_bt * ((place - first) * t + [np.tan(beta) * across, 0.0]) / (second - first)
    carried = data["bearing_load"].sel(bearing=["input 1", "input 2"], direction=["x", "y"]).values
    assert_allclose(carried, [-scene.F_bt * t - on_second, on_second], atol=1e-3 * scene.F_bt)


@dataclass(frozen=True, kw_only=True)
class SoftTeeth(ComplianceEffect):
    """Slices of teeth that yield by themselves, by a linear law."""

    stiffness: float = 14e3
    name: ClassVar[str] = "hertz"
    summary: ClassVar[str] = ""
    source: ClassVar[str] = ""

    def compliance(self, lines, beside):
        return LineLaw(a=np.full(lines.shape, 1 / self.stiffness), h=np.zeros(lines.shape))


@pytest.mark.parametrize("helix", [0.0, 15.0])
def test_bearing_forces_are_those_of_many_slices(helix):
    """32 slices of teeth, each with its own spring k(t) between the shafts and with no resultants, over the speeds."""
    scene = on_shafts("straddled", helix, TEETH)
    scene = replace(scene, effects=(SoftTeeth(),), resolution=replace(scene.resolution, segments=32))
    speeds, H = np.linspace(60, 8000, 24), 6
    model = Model(scene=scene)
    data = response(scene, speed=speeds, harmonics=H)
    box, (η, weight) = scene.gearbox, FACE_POINTS
    system = mechanics(box, static_equilibrium(box), [np.eye(len(η))])
    # length of all lines in each slice, over the phases
    meshing, tau = scene.pair.meshing, (np.arange(512) + 0.5) / 512
    b, pairs = meshing.face_width, np.arange(-4, 6)
    y = b * (η + 1) / 2
    u = meshing.path_start + np.add.outer(tau, pairs)[..., None] * meshing.base_pitch + y * np.tan(meshing.beta_b)
    touching = ((u >= meshing.path_start) & (u <= meshing.path_end)).sum(axis=1)
    k = SoftTeeth().stiffness * np.cos(meshing.beta_b) * touching * b / 2 * weight
    # at rest at each phase: the slices on the compliance of the shafts, their spins held
    mean = np.diag(k.mean(axis=0))
    found = modes(system, mean, scene.system.damping_ratio)
    omega = 2 * np.pi / 60 * scene.pair.pinion.teeth * np.outer(speeds, np.arange(H + 1))
    h = found.mesh_receptance(omega, np.arange(len(η)))
    # rigid teeth of rigid slices have no error: all that moves them is that k varies under the mean force
    wave = np.exp(-2j * np.pi * np.outer(np.arange(2 * H + 1), tau)) / len(tau)
    gears = model.loaded_meshes[0].on_shafts.gears
    psi = [factor((gear,), [box.face_rows("pair", gear.gear, gear.model)]) for gear in gears]
    C = sum(part @ part.T for part in psi)
    force = np.array([np.linalg.solve(C + np.diag(1 / each), np.ones(len(η))) for each in k])
    force *= scene.F_bt / force.sum(axis=1, keepdims=True)
    assert force.min() > 0
    motion = force / k
    drive = Excitation(
        stiffness=np.einsum("nt,ti,ij->ijn", wave, k, np.eye(len(η))),
        motion=(wave[: H + 1] @ motion).T,
        force=(wave[: H + 1] @ force).T,
    )
    x, f = solve(drive, h, mean)
    push = np.moveaxis((f - mean @ x)[..., 1:], 1, -1)
    felt = np.moveaxis(found.response_to_forces(omega[:, 1:], push, found.mesh)[2], 1, -1)
    ours = data["bearing_force_amplitude"].values[:, 0, :, :2]
    theirs = 2 * np.abs(felt[:, :, :2])
    for name, one, other in zip(data["bearing"].values, *(np.sqrt((v**2).sum(axis=(0, 2, 3))) for v in (ours, theirs)), strict=True):  # fmt: skip  # noqa: E501
        assert_allclose(one, other, rtol=0.05, err_msg=str(name))
