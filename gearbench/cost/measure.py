"""Time and memory of a run, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import NDArray

from gearbench.cost.apart import apart, most_megabytes, timed
from gearbench.effects.teeth import forget_fast_teeth
from gearbench.effects.tooth_bending import tooth_bending
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
    if prepares and tooth_bending(scene.effects_by_name, "finite_elements"):
        seconds, processor, megabytes = apart(finite_element_run, scene)  # here they are kept on disk
        return Run(values=values, seconds=seconds, processor_seconds=processor, megabytes=megabytes)
    fresh = iter([unseen(scene, i + 1) if prepares else scene for i in range(repeats + 1)])

    def run() -> None:
        if prepares:
            forget_fast_teeth()  # also because teeth of high order that are kept would fill the memory
        cycle_values(next(fresh))

    return Run(values=values, megabytes=peak_megabytes(run), **times(run, repeats))


def finite_element_run(scene: Scene) -> list[float]:
    """Wall and processor time [s] of a run, and the memory it takes beyond the libraries loaded [MB]."""
    import skfem  # noqa: F401  # what it takes to load is no part of the run

    from fem_reference.environment import import_gmsh

    import_gmsh()
    before = most_megabytes()
    _, wall, processor = timed(lambda: cycle_values(scene))
    return [wall, processor, most_megabytes() - before]
