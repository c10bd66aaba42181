"""Time and memory of a run, and the error that its settings leave."""

from __future__ import annotations

import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import median

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.fe_compliance import FeCompliance
from gearbench.scene import Scene
from gearbench.simulation import cycle_values


@dataclass(frozen=True, kw_only=True)
class Run:
    """What a run answers and costs.

    Parameters
    ----------
    values
        See ``gearbench.accuracy.measure``, (4,).
    seconds, processor_seconds
        Wall time and processor time [s], medians of the repeats after a first run.
    megabytes
        Largest memory taken by arrays and objects during a run [MB].
    """

    values: NDArray
    seconds: float
    processor_seconds: float
    megabytes: float


def measure(scene: Scene, repeats: int, *, prepares: bool = False) -> Run:
    """Run ``scene`` some times: as a pair that was not seen before where ``prepares``, else with its teeth known."""
    values = cycle_values(scene)
    if scene.effect(FeCompliance.name) is not None:
        return _with_finite_elements(scene, values, repeats)
    fresh = iter([unseen(scene, i + 1) if prepares else scene for i in range(repeats + 1)])
    megabytes = peak_megabytes(lambda: cycle_values(next(fresh)))
    return Run(values=values, megabytes=megabytes, **times(lambda: cycle_values(next(fresh)), repeats))


def _with_finite_elements(scene: Scene, values: NDArray, repeats: int) -> Run:
    """Finite elements are kept on disk, with the time they took; their memory is that of a process of its own."""
    effect = scene.effect(FeCompliance.name)
    assert isinstance(effect, FeCompliance)
    taken = sum(float(effect.flank(scene.pair, k).attrs["seconds"]) for k in range(2))
    run = times(lambda: cycle_values(scene), repeats)
    return Run(values=values, megabytes=process_megabytes(scene), **{name: taken + t for name, t in run.items()})


def unseen(scene: Scene, i: int) -> Scene:
    """The same scene with a face width larger by i · 10⁻⁹, so that nothing kept for its pair serves it."""
    return replace(scene, pair=replace(scene.pair, face_width=scene.pair.face_width * (1 + 1e-9 * i)))


def times(work: Callable[[], object], repeats: int) -> dict[str, float]:
    """Medians over ``repeats`` of wall and processor time [s]."""
    wall, processor = [], []
    for _ in range(repeats):
        start = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - start[0])
        processor.append(time.process_time() - start[1])
    return {"seconds": median(wall), "processor_seconds": median(processor)}


def peak_megabytes(work: Callable[[], object]) -> float:
    """Largest memory [MB] that arrays and objects take during the work."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


_IN_A_PROCESS = """
import os, resource, sys, tempfile
with tempfile.TemporaryDirectory() as folder:
    os.environ["GEARBENCH_CACHE"] = folder
    import tomllib
    from gearbench.scene_file import parse_scene
    from gearbench.simulation import cycle_values
    import numba, skfem, fem_reference.refinement
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    cycle_values(parse_scene(tomllib.loads(sys.stdin.read())))
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


def process_megabytes(scene: Scene) -> float:
    """Resident memory [MB] that a process of its own takes for ``scene`` beyond its libraries; NaN if it fails."""
    command = [sys.executable, "-c", _IN_A_PROCESS]
    done = subprocess.run(command, input=scene.to_toml(), capture_output=True, text=True, check=False)
    return float(done.stdout) * 1024 / 1e6 if done.returncode == 0 else float(np.nan)
