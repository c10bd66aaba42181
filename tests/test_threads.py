"""BLAS is held to one thread while gearbench computes, and given back as it was."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Barrier

import pytest

# the BLAS of compiled kernels: loaded later it would begin with the number of threads of the environment
import scipy.linalg.cython_blas  # noqa: F401
from threadpoolctl import ThreadpoolController

from gearbench import nonlinear_response, response, revolution_response, robust_response, simulate
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.tooth_bending import ToothBending
from gearbench.library.garambois2017 import case
from gearbench.scene import Resolution
from gearbench.threads import lazy, single_threaded_blas
from tests.support.systems import spur_scene


def blas() -> ThreadpoolController:
    return ThreadpoolController().select(internal_api="openblas")


def threads() -> set[int]:
    return {library["num_threads"] for library in blas().info()}


@pytest.fixture(autouse=True)
def two_threads():
    """The user's own setting, which is not one thread."""
    with blas().limit(limits=2):
        yield
        assert threads() == {2}


def test_simulate_computes_on_one_thread(monkeypatch):
    import gearbench.solution as solution

    seen, assemble = [], solution.assemble
    monkeypatch.setattr(solution, "assemble", lambda *a: (seen.append(threads()), assemble(*a))[1])
    simulate(case(1, Resolution(positions=4)))
    assert seen == [{1}]
    assert threads() == {2}


def test_compliance_by_itself_is_computed_on_one_thread(monkeypatch):
    import gearbench.contact.assemble as assembling

    seen, own = [], assembling.gap_and_variation
    monkeypatch.setattr(assembling, "gap_and_variation", lambda *a: (seen.append(threads()), own(*a))[1])
    scene = case(1, Resolution(positions=4))
    assembling.assemble(scene, scene_lines(scene, mesh_phases(scene)[0]))
    assert seen == [{1}]


@pytest.mark.parametrize("run", [response, nonlinear_response, robust_response, revolution_response])
def test_response_computes_on_one_thread(run, monkeypatch):
    """``modes`` is the largest product of matrices of them all."""
    import gearbench.dynamics.model as model

    seen, own = [], model.modes
    monkeypatch.setattr(model, "modes", lambda *a: (seen.append(threads()), own(*a))[1])
    errors = {"manufacturing_errors": {"preset": "garambois2017"}, "pitch_errors": {"pinion": [0.0, 1.0] * 12 + [0.0]}}
    names = {robust_response: ["manufacturing_errors"], revolution_response: ["pitch_errors"]}
    effects = {"hertz": {"law": "yang_sun"}, **{name: errors[name] for name in names.get(run, [])}}
    more = {"samples": 2} if run is robust_response else {}
    run(spur_scene({}, effects=effects, segments=4, gauss_points=2), speed=900.0, harmonics=1, **more)
    assert seen == [{1}]
    assert threads() == {2}


def test_both_teeth_on_two_threads_are_those_of_one(monkeypatch):
    import gearbench.effects.teeth as teeth

    scene = case(2, Resolution(positions=3, segments=5))
    scene = replace(scene, effects=(ToothBending(model="solid", order=(3, 4, 4)), *scene.effects[1:]))
    found = []
    for count in (1, 2):
        monkeypatch.setattr(teeth, "default_threads", lambda count=count: count)
        teeth.clear_tooth_cache()
        found.append(simulate(scene).transmission_error.values)
    assert found[0].tolist() == found[1].tolist()


def test_errors_give_the_setting_back():
    @single_threaded_blas()
    def fails() -> None:
        raise RuntimeError(str(threads()))

    with pytest.raises(RuntimeError, match=r"\{1\}"):
        fails()
    assert threads() == {2}


def test_computations_on_threads_end_in_any_order():
    both, first_left = Barrier(2, timeout=30), Barrier(2, timeout=30)

    def compute(leaves_first: bool) -> set[int]:
        with single_threaded_blas():
            both.wait()
            if not leaves_first:
                first_left.wait()
            found = threads()
        if leaves_first:
            first_left.wait()
        return found

    with single_threaded_blas(), ThreadPoolExecutor(2) as pool:
        assert list(pool.map(compute, (True, False))) == [{1}, {1}]
        assert threads() == {1}
    assert threads() == {2}


def test_lazy_values_are_computed_once_and_without_a_common_lock():
    """Two objects of a class at the same time, which ``cached_property`` does not allow in Python 3.11."""
    both, calls = Barrier(2), []

    class Part:
        @lazy
        def value(self) -> int:
            """Docstring."""
            both.wait(timeout=30)
            calls.append(self)
            return len(calls)

    parts = [Part(), Part()]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda part: part.value, parts))
    assert sorted(found) == [1, 2]
    assert [part.value for part in parts] == found
    assert Part.value.__doc__ == "Docstring."
