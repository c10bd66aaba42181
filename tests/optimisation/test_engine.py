"""Engines: which thread evaluates the first designs, and a scheduler that is asked again."""

from __future__ import annotations

import threading
from itertools import count
from types import SimpleNamespace

import pytest

from gearbench.optimisation import engine, scheduler
from gearbench.optimisation.engine import ALONE, Threads
from gearbench.optimisation.problem import NO_GEAR, Evaluation
from gearbench.optimisation.scheduler import ANSWERS, persistently
from tests.optimisation.test_kills import STUDY


def by_first_code(violation: dict[int, float]):
    """Evaluations with these violations, and the threads that made them."""
    seen: list[tuple[int, bool]] = []

    def evaluated(study, design, rivals=None) -> Evaluation:
        seen.append((design[0], threading.current_thread() is threading.main_thread()))
        return Evaluation(violation=violation.get(design[0], 0.0), reason="", constraints=(), statistics=())

    return evaluated, seen


@pytest.mark.parametrize(
    ("violation", "alone"),
    [
        ({}, 1),
        ({0: NO_GEAR, 1: 0.3}, 3),
        (dict.fromkeys(range(30), 0.3), ALONE),
        (dict.fromkeys(range(15), NO_GEAR) | dict.fromkeys(range(15, 30), 1.0), 15 + ALONE),
    ],
)
def test_the_first_designs_are_evaluated_where_ctrl_c_is_heard(monkeypatch, violation, alone):
    """Until one is feasible, and all kernels are compiled; gears that do not exist cost nothing."""
    evaluated, seen = by_first_code(violation)
    monkeypatch.setattr(engine, "evaluate", evaluated)
    monkeypatch.setattr(engine, "by_geometry", lambda study, designs: designs)
    designs = [(i, 0, 0, 0, 0, 0) for i in range(30)]
    with Threads(2) as threads:
        assert {design for design, _ in threads.evaluate(STUDY, designs)} == {*designs}
        assert [main for _, main in seen] == [True] * alone + [False] * (30 - alone)
        assert {design for design, _ in threads.evaluate(STUDY, designs)} == {*designs}
        assert not any(main for _, main in seen[30:])


# -- a scheduler that is asked again -----------------------------------------------------------------------------------
@pytest.fixture
def clock(monkeypatch):
    """Seconds of the steady clock, which sleeping alone moves."""
    now = [0.0]
    monkeypatch.setattr(scheduler.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(scheduler.time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    return now


def test_a_scheduler_is_asked_again_for_as_long_as_it_may_take(clock):
    asked = count()

    def ask() -> int:
        if (number := next(asked)) < 5:
            raise OSError("Timed out trying to connect")
        return number

    assert persistently(ask) == 5

    def never() -> None:
        raise OSError("nobody")

    began = clock[0]
    with pytest.raises(OSError, match=r"^nobody$"):
        persistently(never)
    assert ANSWERS < clock[0] - began < 1.1 * ANSWERS


def test_a_scheduler_that_is_lost_is_not_asked_again(clock):
    client = SimpleNamespace(status="running")

    def ask() -> None:
        if clock[0] > 1:
            client.status = "connecting"
        raise OSError("gone")

    with pytest.raises(OSError, match=r"^gone$"):
        persistently(ask, client)
    assert 1 < clock[0] < 1.2
