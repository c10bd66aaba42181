"""Wall and processor time of a piece of work, its memory, pairs that nothing is kept for, and work in a new process.

``python -m gearbench.effort.clock`` is that process: it finds no finite elements kept, and its largest memory is its
own. Its orders come in as JSON, its answer is the last line printed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from statistics import median
from typing import Any

from gearbench.errors import GearbenchError
from gearbench.interruption import raising
from gearbench.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Cost of a run.

    Parameters
    ----------
    seconds, processor_seconds
        Wall time, and processor time of all threads [s].
    megabytes
        Largest memory [MB]; NaN where it was not measured.
    """

    seconds: float
    processor_seconds: float
    megabytes: float = float("nan")


def timed(work: Callable[[], Any]) -> tuple[Any, Cost]:
    """Return the answer of one run of ``work``, and its times."""
    wall, processor = time.perf_counter(), time.process_time()
    answer = work()
    return answer, Cost(seconds=time.perf_counter() - wall, processor_seconds=time.process_time() - processor)


def medians(costs: Sequence[Cost]) -> Cost:
    """Median wall and processor time."""
    return Cost(
        seconds=median(cost.seconds for cost in costs),
        processor_seconds=median(cost.processor_seconds for cost in costs),
    )


def times(work: Callable[[], object], repeats: int) -> Cost:
    """Median times of ``repeats`` runs."""
    return medians([timed(work)[1] for _ in range(repeats)])


def measured(work: Callable[[], object], repeats: int) -> Cost:
    """Peak memory of a first run, and median times of ``repeats`` more."""
    megabytes = peak_megabytes(work)
    return replace(times(work, repeats), megabytes=megabytes)


def quickest(works: Sequence[Callable[[], object]], repeats: int) -> list[float]:
    """Least processor time [s] that each of the works takes on this thread alone.

    They take turns, so that all of them see the same machine; other threads and programs do not count.
    """
    least = [float("inf")] * len(works)
    for _ in range(repeats):
        for i, work in enumerate(works):
            start = time.thread_time()
            work()
            least[i] = min(least[i], time.thread_time() - start)
    return least


def peak_megabytes(work: Callable[[], object]) -> float:
    """Largest memory [MB] that arrays and objects take during the work."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


def most_megabytes() -> float:
    """Largest memory that this process has taken so far [MB]."""
    try:  # the largest resident set of this program; ru_maxrss may still be that of the one which started it
        with open("/proc/self/status", encoding="ascii") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) * 1024 / 1e6
    except OSError:
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024) / 1e6


def unseen(scene: Scene, i: int) -> Scene:
    """The same scene with a face width larger by i · 10⁻⁹, so that nothing kept for its pair serves it."""
    return replace(scene, pair=replace(scene.pair, face_width=scene.pair.face_width * (1 + 1e-9 * i)))


def apart(work: Callable[..., Any], scene: Scene, *given: Any) -> Any:
    """Answer of ``work(scene, *given)`` in a process of its own; words, numbers and lists of them only.

    Raises
    ------
    GearbenchError
        If it fails there; with its last line.
    """
    order = {"work": [work.__module__, work.__qualname__], "scene": scene.to_toml(), "given": given}
    command = [sys.executable, "-m", "gearbench.effort.clock"]
    with raising():
        done = subprocess.run(command, input=json.dumps(order), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise GearbenchError(f"in a process of its own: {(done.stderr.strip() or 'no answer').splitlines()[-1]}")
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Do the work that the standard input names, with nothing kept on disk."""
    import tomllib

    from gearbench.scene_file import parse_scene

    order = json.loads(sys.stdin.read())
    with tempfile.TemporaryDirectory() as folder:
        os.environ["GEARBENCH_CACHE"] = folder
        module, name = order["work"]
        answer = getattr(import_module(module), name)(parse_scene(tomllib.loads(order["scene"])), *order["given"])
    print(f"\n{json.dumps(answer)}")


if __name__ == "__main__":
    main()
