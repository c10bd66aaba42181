"""BLAS is held to one thread while gearbench computes, and given back as it was."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from threading import Barrier, get_ident
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import pytest
from threadpoolctl import ThreadpoolController

from gearbench import nonlinear_response, response, revolution_response, robust_response, simulate
from gearbench.library.garambois2017 import case
from gearbench.scene import Resolution
from gearbench.threads import lazy, processors_taken, side_by_side, single_threaded_blas
from tests.systems import spur_scene

if TYPE_CHECKING:
    from gearbench.optimisation.study import OptimisationStudy


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

    seen, own = [], assembling.total_gap
    monkeypatch.setattr(assembling, "total_gap", lambda *a: (seen.append(threads()), own(*a))[1])
    scene = case(1, Resolution(positions=4))
    assembling.assemble(scene, assembling.scene_lines(scene, assembling.mesh_phases(scene)[0]))
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


def test_both_gears_are_worked_on_at_the_same_time(monkeypatch):
    """In order; each waits for the other, which one thread could not."""
    monkeypatch.setattr("gearbench.threads.default_threads", lambda: 2)
    both = Barrier(2)

    def work(item: int) -> int:
        both.wait(timeout=30)
        return 10 * item

    assert side_by_side(work, [1, 2]) == [10, 20]


@pytest.mark.parametrize("processors", [1, 2])
def test_no_threads_are_started_where_there_are_no_processors(processors, monkeypatch):
    monkeypatch.setattr("gearbench.threads.default_threads", lambda: processors)
    with processors_taken() if processors > 1 else nullcontext():
        assert side_by_side(lambda _: get_ident(), [1, 2]) == [get_ident()] * 2
    assert side_by_side(lambda item: item, [1]) == [1]


def test_an_error_of_either_thread_is_raised(monkeypatch):
    monkeypatch.setattr("gearbench.threads.default_threads", lambda: 2)
    for items in ([0, 1], [1, 0]):
        with pytest.raises(ZeroDivisionError):
            side_by_side(lambda item: 1 / item, items)


def test_designs_of_a_search_start_no_threads_of_their_own(monkeypatch):
    """Their engines keep the processors busy."""
    import gearbench.optimisation.engine as engine

    monkeypatch.setattr("gearbench.threads.default_threads", lambda: 2)
    seen: list[list[int]] = []

    def evaluate(*_: object) -> Any:
        seen.append([*side_by_side(lambda _: get_ident(), [1, 2]), get_ident()])
        return SimpleNamespace(feasible=True, violation=0.0)

    monkeypatch.setattr(engine, "evaluate", evaluate)
    monkeypatch.setattr(engine, "by_geometry", lambda study, designs: designs)
    study, designs = cast("OptimisationStudy", None), [cast("Any", (1,)), cast("Any", (2,))]
    assert len(list(engine.Threads(2).evaluate(study, designs))) == 2
    assert len(seen) == 2
    assert all(len(set(idents)) == 1 for idents in seen)


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
