"""Growth of run time with segments, samples, pairs in contact, and workers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gearbench.accuracy.settings import with_resolution
from gearbench.effort.clock import times
from gearbench.effort.curves import values_of
from gearbench.lazy import xr
from gearbench.library.garambois2017 import case, gear
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.robustness.sampling import unit_samples
from gearbench.scene import Scene
from gearbench.threads import default_threads

SEGMENTS, SAMPLES, WIDTHS = (2, 4, 8, 16, 32, 64, 128, 256, 512), (64, 256, 1024, 4096, 16384), (1, 2, 4, 8, 16)
#: Number of samples of the run that is distributed over workers.
SHARED = 4096
#: Quantities over which run time is measured.
DIMENSIONS = ("segments", "samples", "pairs", "workers")


def scaling(repeats: int, *, quick: bool = False) -> xr.Dataset:
    """Measure wall and processor time [s] over ``size`` for all ``DIMENSIONS``, with one entry of ``run`` per size."""
    rows: list[tuple[str, float, float, float]] = []

    def add(name: str, size: float, work: Callable[[], object]) -> None:
        work()
        taken = times(work, repeats)
        rows.append((name, size, taken.seconds, taken.processor_seconds))

    helical, most = case(2), 4 if quick else 99
    for n in SEGMENTS[:most]:
        cut = with_resolution(helical, segments=n)
        add("segments", n, lambda s=cut: values_of(s))
    for factor in WIDTHS[:most]:
        wide = _wider(helical, factor)
        add("pairs", wide.pair.meshing.total_contact_ratio, lambda s=wide: values_of(s))
    problem = prepare_scene(gear("55").scene(errors=True))
    unit = unit_samples("sobol", SAMPLES[-1], len(problem.names), 0)
    errors = problem.errors.draw(unit, problem.scene.pair)
    for n in SAMPLES[: most - 2]:
        add("samples", n, lambda n=n: respond(problem, errors[:n]))
    for n in sorted({1, *(2**i for i in range(8) if 2**i <= default_threads()), default_threads()}):
        add("workers", n, lambda n=n: respond(problem, errors[: SHARED // (8 if quick else 1)], n))
    names, *columns = zip(*rows, strict=True)
    data = dict(zip(("size", "seconds", "processor_seconds"), (("run", np.array(c)) for c in columns), strict=True))
    return xr.Dataset(data, coords={"grows": ("run", list(names))})


def _wider(scene: Scene, factor: float) -> Scene:
    """Multiply face width and torque by a factor: more pairs in contact at the same line load."""
    pair = replace(scene.pair, face_width=factor * scene.pair.face_width)
    return replace(scene, pair=pair, load=replace(scene.load, torque=factor * scene.load.torque))


def exponent(dataset: xr.Dataset, name: str, points: int = 3) -> float:
    """Slope of log processor time over log size at the large end."""
    rows = dataset.isel(run=dataset["grows"].values == name)
    x, y = (np.log(rows[v].values[-points:]) for v in ("size", "processor_seconds"))
    return float(np.polyfit(x, y, 1)[0])


def speed_up(dataset: xr.Dataset) -> float:
    """Ratio of the wall time with one worker to that with all workers."""
    rows = dataset.isel(run=dataset["grows"].values == "workers")
    return float(rows["seconds"].values[0] / rows["seconds"].values[-1])
