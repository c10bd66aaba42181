"""Meshes that bend each other's shafts, solved by turns, against one contact problem."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import robust, simulate
from gearbench.contact import mesh_loads
from gearbench.contact.gaps import total_gap
from gearbench.contact.solver import ConvergenceError
from gearbench.dynamics.model import Model
from gearbench.effects.shafts import factor
from gearbench.geometry.action import contact_lines
from gearbench.solution import solve_scene
from tests.support.systems import spur_scene, two_stages

E, NU = 210e3, 0.3
PHASES, OTHER_PHASES = 5, 24


def gearbox(folder, slope, **more):
    """Two stages with linear contact; the second has a helix slope [µm]."""
    law, error = {"hertz": {"law": "yang_sun"}}, {"helix_slope": {"pinion": slope}} if slope else {}
    one = spur_scene(torque=200.0, effects=law | more, positions=PHASES, segments=40)
    two = spur_scene(torque=320.0, effects=law | error, positions=PHASES, segments=40)
    return two_stages(folder, one, two, diameter=35.0)


def alone(scene, phases):
    """The seats of a mesh; of its loaded points at each phase, rows on the shafts, compliance and gap."""
    lines = contact_lines(scene.pair, (np.arange(phases) + 0.5) / phases, 16)
    gears = next(effect for effect in scene.acting_effects if effect.name == "shafts").gears
    rows = [gear.rows(lines) for gear in gears]
    psi = np.concatenate([factor((gear,), [on]) for gear, on in zip(gears, rows, strict=True)], axis=-1)
    law = 4 * (1 - NU**2) / (np.pi * E)  # Yang and Sun, per line load
    gap, found = total_gap(scene.flank_effects, lines), []
    for p, on in enumerate(lines.length > 0):
        H = psi[p][on] @ psi[p][on].T + np.diag(law / lines.length[p][on])
        found.append(([row[p][on] for row in rows], H, gap[p][on]))
    return gears, found


def approaches(H, gap, B, force):
    """δ with H P + e = Bᵀ δ where P > 0 and B P = F."""
    on, meshes = np.ones(len(gap), dtype=bool), len(force)
    while True:
        K = np.block([[H[np.ix_(on, on)], -B[:, on].T], [B[:, on], np.zeros((meshes, meshes))]])
        P, δ = np.split(np.linalg.solve(K, np.concatenate([-gap[on], force])), [on.sum()])
        if P.min() >= 0:
            return δ
        on[np.flatnonzero(on)[P < 0]] = False


def test_meshes_solved_by_turns_are_one_contact_problem(tmp_path):
    """Both meshes in one problem, at all phases of the other mesh: its helix slope moves the first by 2 %."""
    scene = gearbox(tmp_path, 40.0)
    first, second = scene, scene.seen_from("second")
    ((_, wheel), of_first), ((pinion, _), of_second) = alone(first, PHASES), alone(second, OTHER_PHASES)
    assert wheel.number == pinion.number
    G, force, one_problem = wheel.settled.compliance, np.array([first.F_bn, second.F_bn]), []
    for (_, on_wheel), own, gap in of_first:
        δ = []
        for (on_pinion, _), other, gap_of_other in of_second:
            across = on_wheel @ G @ on_pinion.T
            H, B = np.block([[own, across], [across.T, other]]), np.zeros((2, len(own) + len(other)))
            B[0, : len(own)], B[1, len(own) :] = 1.0, 1.0
            δ.append(approaches(H, np.concatenate([gap, gap_of_other]), B, force)[0])
        one_problem.append(1e3 * np.mean(δ))
    assert_allclose(simulate(scene)["transmission_error"], one_problem, rtol=5e-4)  # loads of coarse contacts
    without = simulate(gearbox(tmp_path, 0.0))["transmission_error"].values
    assert np.abs(one_problem / without - 1).min() > 0.015


@pytest.mark.slow
def test_samples_and_response_rest_on_the_same_loads(tmp_path):
    scatter = {"manufacturing_errors": {"profile_slope": {"amplitude": 1e-9}}}
    scene = gearbox(tmp_path, 40.0, **scatter)
    simulated = solve_scene(scene).cycle.transmission_error
    samples = robust(scene, samples=4)["transmission_error_mean"]
    assert_allclose(samples, simulated.mean(), rtol=2e-4)
    (first, _) = Model(scene=scene).loaded_meshes
    assert_allclose(first.cycle.transmission_error, simulated, rtol=1e-12)
    # the loads are the same if the other mesh comes first
    back = scene.seen_from("second").seen_from("pair")
    assert_allclose(solve_scene(back).cycle.transmission_error, simulated, rtol=1e-9)


def test_loads_that_do_not_settle_are_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_loads, "MAX_ROUNDS", 1)
    with pytest.raises(ConvergenceError, match="bend each other's shafts"):
        simulate(gearbox(tmp_path, 25.0))
