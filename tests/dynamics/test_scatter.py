"""Scatter of the mesh force: each sample is the response of its own scene; statistics; refusals."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import robust
from gearbench.dynamics.balance import Excitation, solve
from gearbench.dynamics.model import Model
from gearbench.dynamics.scatter import force_rms, robust_response, sample_cycles
from gearbench.dynamics.waves import rms
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.errors import InputError
from gearbench.robustness.montecarlo import prepare_phases, respond
from tests.support.systems import spur_scene

ERRORS = {"hertz": {}, "tooth_bending": {"basis": "paper"}, "manufacturing_errors": {"preset": "garambois2017"}}
SPEEDS = np.array([800.0, 2500.0, 6000.0])


def scene(helix=0.0, gauss_points=6):
    return spur_scene({"damping_ratio": 0.05}, helix=helix, effects=ERRORS, segments=12, gauss_points=gauss_points)


def test_each_sample_is_solved_as_by_itself():
    model = Model(scene=scene())
    cycles = sample_cycles(model, 8, samples=5, seed=3, sampler="sobol", threads=1)
    found = force_rms(model, model.groups[0], cycles, SPEEDS, 1)
    h = model.receptances(model.groups[0], SPEEDS, 8)
    for i in range(5):
        one = Excitation(
            stiffness=cycles.stiffness[i, None, None], motion=cycles.error[i, None], force=model.force * np.eye(1, 9)
        )
        _, force = solve(one, h, model.stiffness[:1, :1])
        assert_allclose([values[i] for values in found], rms(force)[:, 0], rtol=1e-9)


@pytest.mark.parametrize("more", [(), (OffLineContact(),)], ids=["on the line", "off the line"])
def test_samples_are_those_of_robust(more):
    """The orders of a sample give the RMS of its transmission error that ``robust`` finds."""
    base = scene(20.0)
    model = Model(scene=replace(base, effects=(*base.effects, *more)))
    cycles = sample_cycles(model, 240, samples=4, seed=1, sampler="sobol", threads=1)
    phases, name = model.cycles[0].cycle.phases, "transmission_error_rms"
    problem = prepare_phases(model.cycles[0].scene, phases.phase, phases.weight)
    found, _ = respond(problem, problem.draw(4, 1, "sobol"), names=(name,))
    assert_allclose(1e3 * rms(cycles.error), found[name], rtol=1e-5)  # orders above 240


def test_samples_on_fine_panels_are_those_of_robust():
    """``robust`` has panels of its own, the same for every sample: where they are fine both are the same."""
    fine = scene(20.0, gauss_points=24)
    cycles = sample_cycles(Model(scene=fine), 60, samples=4, seed=1, sampler="sobol", threads=1)
    data = robust(fine, samples=4, seed=1)
    assert_allclose(1e3 * rms(cycles.error), data["transmission_error_rms"], rtol=2e-4)


def test_statistics_are_those_of_the_samples():
    model = Model(scene=scene())
    cycles = sample_cycles(model, 10, samples=64, seed=0, sampler="sobol", threads=2)
    values = np.array(force_rms(model, model.groups[0], cycles, SPEEDS, 1))
    data = robust_response(scene(), speed=SPEEDS, samples=64)
    assert_allclose(data["mesh_force_percentile"].sel(percentile=50.0), np.median(values, axis=1), rtol=1e-9)
    assert_allclose(data["mesh_force_rms_std"], values.std(axis=1, ddof=1), rtol=1e-9)
    overall = np.sqrt((values**2).mean(axis=0))
    for name, number in (("mean", overall.mean()), ("std", overall.std(ddof=1)), ("max", overall.max())):
        assert_allclose(float(data[f"mesh_force_{name}"]), number, rtol=1e-9)


def test_scene_without_errors_is_refused():
    with pytest.raises(InputError, match="manufacturing_errors"):
        robust_response(spur_scene({}), speed=1000.0)


def test_memory_does_not_grow_with_speeds_times_samples(monkeypatch):
    """Ten times the speeds and the samples: what both together add is below a tenth of one number for each pair."""
    import tracemalloc

    from gearbench.dynamics import scatter

    def drawn(model, harmonics, *, samples, **_):
        rng = np.random.default_rng(0)
        k = np.zeros((samples, 2 * harmonics + 1), complex)
        k[:, 0] = model.stiffness[0, 0]
        error = 1e-3 * rng.normal(size=(samples, harmonics + 1)).astype(complex)
        tracemalloc.start()
        return scatter.SampleCycles(stiffness=k, error=error)

    def peak(speeds, samples):
        robust_response(scene(), speed=np.linspace(500, 6000, speeds), samples=samples, harmonics=1, threads=1)
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    robust_response(scene(), speed=[500.0], samples=2, harmonics=1)  # compiled, and loaded
    monkeypatch.setattr(scatter, "sample_cycles", drawn)
    sizes = {(s, n): peak(s, n) for s in (60, 600) for n in (32, 320)}
    both = sizes[600, 320] - sizes[600, 32] - sizes[60, 320] + sizes[60, 32]
    assert both < 0.1 * 8 * 540 * 288
