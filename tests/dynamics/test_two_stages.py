"""A gearbox of two unequal stages: each mesh feels what the other excites, held to time integration of both."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from gearbench.cli.summary import first_mesh
from gearbench.dynamics.analysis import only_excited_by, response
from gearbench.dynamics.model import Model
from tests.support.systems import series, spur_scene, two_stages

TEETH = {
    "hertz": {},
    "tooth_bending": {"model": "plate", "order": [3, 3]},
    "tip_relief": {"amount": 8.0, "length": 1.0},
}


def gearbox(folder):
    one, two = (spur_scene(width=w, torque=T, effects=TEETH, segments=12) for w, T in ((30.0, 200.0), (40.0, 320.0)))
    # frequencies of which no two orders are one
    teeth = replace(two.pair, pinion=replace(two.pair.pinion, teeth=23), wheel=replace(two.pair.wheel, teeth=42))
    return two_stages(folder, one, replace(two, pair=teeth))


@pytest.mark.slow
def test_forces_of_both_meshes_against_time_integration(tmp_path):
    """Peaks, RMS values, orders of both frequencies and their combinations within 2 %."""
    scene, speed, H = gearbox(tmp_path), 3700.0, 16
    model = Model(scene=scene)
    data = response(scene, speed=speed, harmonics=H)
    system, K = model.mechanics, model.stiffness
    a, R = system.mesh, len(K)
    values, vectors = eigh(system.stiffness + a.T @ K @ a, system.mass)
    keep = (values > 1.0) & (values < (2 * np.pi * 200e3) ** 2)
    φ, ω, ζ = vectors[:, keep], np.sqrt(values[keep]), scene.system.damping_ratio
    b = a @ φ
    rates = [2 * np.pi * speed / 60 * group.rate for group in model.groups]
    assert len(rates) == 2
    drives = [model.excitation(group, H) for group in model.groups]
    rows = [model.rows_of(group.meshes) for group in model.groups]

    def at(t):
        """K(t), f_s(t) and x_s(t) of all rows at the times."""
        k, rest, motion = np.zeros((len(t), R, R)), np.zeros((len(t), R)), np.zeros((len(t), R))
        for omega, drive, here in zip(rates, drives, rows, strict=True):
            for i, row in enumerate(here):
                rest[:, row], motion[:, row] = (series(of[i], omega, t) for of in (drive.force, drive.motion))
                for j, other in enumerate(here):
                    k[:, row, other] = series(drive.stiffness[i, j], omega, t)
        return k, rest, motion

    # constant forces and motions hold the mean: what fluctuates about them is left, f − K̄ x moves the modes
    mean = [np.concatenate([drive.force[:, 0].real for drive in drives]), np.concatenate([d.motion[:, 0].real for d in drives])]  # fmt: skip  # noqa: E501
    dt, settle, last = 0.8e-6, 0.1, 0.4
    fade, turn = np.exp(-ζ * ω * dt), ω * np.sqrt(1 - ζ**2) * dt
    pp, pv = fade * (np.cos(turn) + ζ * ω * dt / turn * np.sin(turn)), fade * np.sin(turn) / turn * dt
    vp, vv = -(ω**2) * pv, fade * (np.cos(turn) - ζ * ω * dt / turn * np.sin(turn))
    p, v, forces, times = np.zeros(len(ω)), np.zeros(len(ω)), [], []
    for first in np.arange(0, round(last / dt), 5000):
        t = (first + np.arange(5000)) * dt
        k, rest, motion = at(t)
        for i in range(len(t)):
            x = mean[1] - b @ p
            f = rest[i] + k[i] @ (x - motion[i])
            v = v + dt * (b.T @ (f - mean[0] - K @ (x - mean[1])))
            p, v = pp * p + pv * v, vp * p + vv * v
            if t[i] >= settle and i % 5 == 0:
                forces.append(f[:: R // 2])
                times.append(t[i])
    f, t = np.array(forces), np.array(times)
    window = np.hanning(len(t)) / np.hanning(len(t)).sum()
    own, passed = data["mesh_force_amplitude"].values[0], data["mesh_force_by_source_amplitude"].values[0]
    largest = own.max(axis=1)
    for mesh in range(2):
        fluctuation = f[:, mesh] - f[:, mesh].mean()
        assert_allclose(float(data["mesh_force_rms"][0, mesh]), fluctuation.std(), rtol=0.02)
        peak = float(data["dynamic_factor"][0, mesh]) * float(data["mean_force"][mesh])
        assert_allclose(peak, f[:, mesh].max(), rtol=0.02)
        for source, omega in enumerate(rates):
            for n in range(1, H + 1):
                seen = 2 * abs((window * fluctuation) @ np.exp(-1j * n * omega * t))
                assert abs(passed[source, mesh, n - 1] - seen) < 0.02 * largest[mesh]
        both = data["mesh_force_combination_amplitude"].values[0, mesh]
        for frequency, value in zip(data["combination_frequency"].values[0], both, strict=True):
            seen = 2 * abs((window * fluctuation) @ np.exp(-2j * np.pi * frequency * t))
            assert abs(value - seen) < 0.02 * largest[mesh]
        assert both.max() > 0.03 * largest[mesh]
    # the second stage shakes the first by more than all its tolerances
    assert passed[1, 0].max() > 0.05 * largest[0] or passed[0, 1].max() > 0.05 * largest[1]


def test_results_of_one_mesh_of_several_say_so(tmp_path):
    scene = gearbox(tmp_path)
    assert first_mesh(scene) == ["note: of mesh pair; second only load the shafts"]
    assert first_mesh(replace(scene, system=None, further=())) == []
    of_two = SimpleNamespace(names=scene.mesh_names)
    assert only_excited_by(of_two, np.array([0])) == ["excited by mesh pair alone: second with mean stiffness"]
    assert only_excited_by(of_two, np.array([0, 1])) == []
