"""What a run takes: wall and processor time, memory; and pairs that nothing was kept for."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from statistics import median

from gearbench.scene import Scene


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
