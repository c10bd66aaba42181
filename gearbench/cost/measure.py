"""Time and memory of a run, and what it answers."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass

from numpy.typing import NDArray

from gearbench.effects.fe_compliance import FeCompliance
from gearbench.effects.solids import gear_body, solid_tooth
from gearbench.effects.tooth_bending import plate_tooth
from gearbench.errors import GearbenchError
from gearbench.scene import Scene
from gearbench.simulation import cycle_values
from gearbench.stopwatch import peak_megabytes, times, unseen


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
        return _with_finite_elements(scene, values)
    fresh = iter([unseen(scene, i + 1) if prepares else scene for i in range(repeats + 1)])

    def run() -> None:
        if prepares:
            for kept in (plate_tooth, solid_tooth, gear_body):
                kept.cache_clear()  # also because teeth of high order that are kept would fill the memory
        cycle_values(next(fresh))

    return Run(values=values, megabytes=peak_megabytes(run), **times(run, repeats))


def _with_finite_elements(scene: Scene, values: NDArray) -> Run:
    """Finite elements are kept on disk: a process of its own, which finds nothing there, runs them once more."""
    command = [sys.executable, "-c", _IN_A_PROCESS]
    done = subprocess.run(command, input=scene.to_toml(), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise GearbenchError(f"finite elements in a process of their own: {done.stderr.strip().splitlines()[-1]}")
    seconds, processor, kibibytes = (float(word) for word in done.stdout.split()[-3:])
    return Run(values=values, seconds=seconds, processor_seconds=processor, megabytes=kibibytes * 1024 / 1e6)


_IN_A_PROCESS = """
import os, resource, sys, tempfile, time, tomllib

def most():
    try:  # the largest resident set of this program; ru_maxrss may still be that of the one which started it
        with open("/proc/self/status") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

with tempfile.TemporaryDirectory() as folder:
    os.environ["GEARBENCH_CACHE"] = folder
    import gmsh, skfem, fem_reference.refinement
    from gearbench.scene_file import parse_scene
    from gearbench.simulation import cycle_values

    scene = parse_scene(tomllib.loads(sys.stdin.read()))
    memory, wall, processor = most(), time.perf_counter(), time.process_time()
    cycle_values(scene)
    print(time.perf_counter() - wall, time.process_time() - processor, most() - memory)
"""
