"""Measurement of time and memory, with scenes that no cache knows, in this process or in a new one."""

from __future__ import annotations

import os
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

from gearbench.errors import GearbenchError
from gearbench.processes import Processes
from gearbench.scene import Scene
from gearbench.scene_file import scene_at


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Cost of a run.

    Parameters
    ----------
    seconds, processor_seconds
        Wall time, and processor time of all threads [s].
    megabytes
        Peak memory [MB]; NaN if it was not measured.
    """

    seconds: float
    processor_seconds: float
    megabytes: float = float("nan")


def timed(work: Callable[[], Any]) -> tuple[Any, Cost]:
    """Run ``work`` once; return its answer and its times."""
    wall, processor = time.perf_counter(), time.process_time()
    answer = work()
    return answer, Cost(seconds=time.perf_counter() - wall, processor_seconds=time.process_time() - processor)


def times(work: Callable[[], object], repeats: int) -> Cost:
    """Median wall and processor time of ``repeats`` runs."""
    costs = [timed(work)[1] for _ in range(repeats)]
    return Cost(
        seconds=median(cost.seconds for cost in costs),
        processor_seconds=median(cost.processor_seconds for cost in costs),
    )


def measured(work: Callable[[], object], repeats: int) -> Cost:
    """Peak memory of a first run, and median times of ``repeats`` further runs."""
    megabytes = peak_megabytes(work)
    return replace(times(work, repeats), megabytes=megabytes)


def quickest(works: Sequence[Callable[[], object]], repeats: int) -> list[float]:
    """Least processor time of this thread for each of ``works``, over ``repeats`` runs [s].

    The works take turns, so that a slow phase of the machine affects all of them. Other threads and programs are not
    counted.
    """
    least = [float("inf")] * len(works)
    for _ in range(repeats):
        for i, work in enumerate(works):
            start = time.thread_time()
            work()
            least[i] = min(least[i], time.thread_time() - start)
    return least


def peak_megabytes(work: Callable[[], object]) -> float:
    """Peak memory of arrays and Python objects during ``work`` [MB]."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


def most_megabytes() -> float:
    """Peak memory of this process so far [MB]."""
    try:  # peak resident set of this program; ru_maxrss may still include the program that started it
        with open("/proc/self/status", encoding="ascii") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) * 1024 / 1e6
    except OSError:
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024) / 1e6


def unseen(scene: Scene, i: int) -> Scene:
    """Scene with the face width enlarged by a relative i · 10⁻⁹, so that no cached result of its pair can be used.

    For a train the torque is enlarged; cached results that do not depend on the load can be used.
    """
    if scene.train is not None:
        return scene_at(scene, {"load.torque": scene.load.torque * (1 + 1e-9 * i)})
    return replace(scene, pair=replace(scene.pair, face_width=scene.pair.face_width * (1 + 1e-9 * i)))


def apart(work: Callable[..., Any], scene: Scene, *given: Any) -> Any:
    """Run ``work(scene, *given)`` in a new process, with an empty cache of finite elements.

    Its peak memory is then that of this work alone.

    Raises
    ------
    GearbenchError
        If the process dies.
    """
    try:
        with Processes(1) as process:
            return process.submit(_without_cache, work, scene, *given).result()
    except BrokenExecutor:
        raise GearbenchError("a process that measures has ended: too little memory?") from None


def _without_cache(work: Callable[..., Any], *given: Any) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        os.environ["GEARBENCH_CACHE"] = folder
        return work(*given)
