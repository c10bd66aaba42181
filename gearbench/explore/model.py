"""Results that the pages show for one scene: curves over the mesh cycle, orders, pressure or load sharing, scatter.

The scene is a pair, or a train whose meshes are one contact problem. Of a gearbox on shafts the first mesh is shown.
This module does not depend on the pages.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.results import flank
from gearbench.results.cycle import MeshCycle, coefficients, curves
from gearbench.results.flank_map import over_flank
from gearbench.results.responses import response
from gearbench.results.solved import Solved
from gearbench.results.train_cycle import TrainCycle
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.scene import Resolution, Scene
from gearbench.solution import solve_scene
from gearbench.threads import default_threads, single_threaded_blas
from gearbench.trains.revolution import revolution_columns
from gearbench.trains.scatter import sampled_train
from gearbench.trains.solve import SolvedTrain, solve_train

#: Pixels of the flank map, over the face width and along the path of contact.
SIZE = (48, 72)
#: Points drawn on each smooth piece of a curve over the mesh cycle.
POINTS = 12
#: Number of error samples.
SAMPLES = 256


def flank_range(solved: Solved) -> tuple[float, float]:
    """Range of u [mm] of a flank map: the path of contact, extended to contact lines that reach beyond it."""
    lines, meshing = solved.lines, solved.scene.pair.meshing
    u = lines.u[lines.active]
    return min(meshing.path_start, float(u.min())), max(meshing.path_end, float(u.max()))


def flank_map(solved: Solved, values: NDArray, size: tuple[int, int] = SIZE) -> NDArray:
    """Interpolate ``values`` (position, pair, segment) onto y = 0 … b and u in ``flank_range``.

    Returns the pixels (along u, along y); those without a contact line nearby are NaN.
    """
    lines, meshing = solved.lines, solved.scene.pair.meshing
    active = lines.active
    # `over_flank` needs the lines in the order in which they pass over the flank
    order = np.argsort((lines.mesh_phase[:, None] + lines.index)[active])
    u, y, length, flank_values = (each[active][order] for each in (lines.u, lines.y, lines.length, values))
    (start, end), (columns, rows) = flank_range(solved), size
    path = start + (np.arange(rows) + 0.5) / rows * (end - start)
    face = (np.arange(columns) + 0.5) / columns * meshing.face_width
    return over_flank(u, y, length * math.cos(meshing.beta_b), flank_values, path, face)


@dataclass(frozen=True, kw_only=True)
class CycleCurve:
    """Curve of a quantity over the mesh cycle.

    Parameters
    ----------
    phase, values
        Mesh phase [mesh periods] and value at points of the curve, (point,).
    length
        Number of mesh periods in the cycle.
    orders, amplitude
        Mesh orders (``Phases.orders``) and their amplitudes, (order,).
    mean, rms, peak_to_peak
        Values over the cycle; ``rms`` of the stiffness is relative to its mean [%].
    """

    phase: NDArray
    values: NDArray
    length: int
    orders: NDArray
    amplitude: NDArray
    mean: float
    rms: float
    peak_to_peak: float


@dataclass(frozen=True, kw_only=True)
class FlankPressure:
    """Hertz pressure on the flank of a pair.

    Parameters
    ----------
    values
        Pressure [MPa], with the shape of ``flank_map``.
    range
        Range of u [mm] that the map covers.
    """

    values: NDArray
    range: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Sharing:
    """Load sharing of a train.

    Parameters
    ----------
    cycle
        Forces and motions over the mesh cycle.
    turns, over_turns
        Positions of the carrier relative to the ring [revolutions], (turn,), and the largest load of each mesh there,
        relative to equal sharing, (mesh, turn); without eccentric members both are empty, (0,).
    """

    cycle: TrainCycle
    turns: NDArray
    over_turns: NDArray

    @property
    def mesh_load_factor(self) -> float:
        """K_γ [–]: largest load relative to equal sharing, over the mesh cycle and a revolution of the carrier."""
        return float(max(self.cycle.sharing.max(), self.over_turns.max(initial=0.0)))


@dataclass(frozen=True, kw_only=True)
class ShownResults:
    """All results shown for one pair, or for a train whose meshes are one contact problem.

    Parameters
    ----------
    scene
        The scene that was solved.
    transmission_error, mesh_stiffness
        STE [µm] and stiffness [N/µm] of the pair or the whole train with every error at its mean.
    load
        Pressure on the flank of a pair, or load sharing of a train.
    scatter
        Response → its values for the error samples, (sample,): RMS values, K_γ of a train. None if the scene has no
        random errors, or if they are not computed yet.
    seconds
        Wall time of the computation [s].
    """

    scene: Scene
    transmission_error: CycleCurve
    mesh_stiffness: CycleCurve
    load: FlankPressure | Sharing
    scatter: Mapping[str, NDArray] | None
    seconds: float

    @property
    def unfinished(self) -> bool:
        """Whether the scatter still has to be computed."""
        return self.scatter is None and self.scene.has_random_errors


def shown_results(scene: Scene, samples: int = SAMPLES) -> ShownResults:
    """Compute all results shown for ``scene``; raises as ``without_scatter``."""
    return with_scatter(*without_scatter(scene), samples)


def without_scatter(scene: Scene) -> tuple[ShownResults, Solved | SolvedTrain]:
    """Compute all results but the scatter; also return the solution, from which the scatter is computed.

    The default resolution replaces a requested accuracy, and the greatest load replaces several loads.

    Raises
    ------
    InputError
        If the scene has several meshes that are not one contact problem.
    GearbenchError
        If the contact problem cannot be solved.
    """
    start, scene = time.perf_counter(), scene if scene.coupled else scene.one_pair
    if scene.resolution.accuracy is not None:
        scene = replace(scene, resolution=Resolution())
    scene = scene.under(scene.load) if scene.loads else scene
    solved, cycle, load = _train(scene) if scene.coupled else _pair(scene)
    results = ShownResults(
        scene=scene,
        transmission_error=_curve(cycle, "transmission_error"),
        mesh_stiffness=_curve(cycle, "mesh_stiffness"),
        load=load,
        scatter=None,
        seconds=time.perf_counter() - start,
    )
    return results, solved


def _pair(scene: Scene) -> tuple[Solved, MeshCycle, FlankPressure]:
    """Solve a pair: solution, mesh cycle and pressure."""
    solved = solve_scene(scene)
    pressure = FlankPressure(values=flank_map(solved, flank.pressure(solved)), range=flank_range(solved))
    return solved, solved.cycle, pressure


def _train(scene: Scene) -> tuple[SolvedTrain, MeshCycle, Sharing]:
    """Solve a train: solution, mesh cycle of the whole train, and load sharing."""
    solved = solve_train(scene)
    error = solved.cycle.transmission_error
    cycle = MeshCycle(phases=solved.phases, transmission_error=error, mesh_stiffness=solved.stiffness)
    coords, variables = revolution_columns(solved)
    turns = over_turns = np.empty(0)
    if variables:  # the planetary set has eccentric members
        turns, over_turns = coords["revolution"][1], variables["load_sharing_over_revolution"][1]
    return solved, cycle, Sharing(cycle=solved.cycle, turns=turns, over_turns=over_turns)


def with_scatter(
    results: ShownResults,
    solved: Solved | SolvedTrain,
    samples: int = SAMPLES,
    progress: Callable[[int, int], None] = lambda _done, _of: None,
) -> ShownResults:
    """Add the scatter to ``results`` if the scene has random errors.

    ``progress`` is called from time to time with the number of samples done and of all samples; it may raise to abort.
    """
    start = time.perf_counter()
    scatter = _scatter(solved, samples, progress) if results.unfinished else results.scatter
    return replace(results, scatter=scatter, seconds=results.seconds + time.perf_counter() - start)


def _curve(cycle: MeshCycle, name: str) -> CycleCurve:
    """Curve, orders and metrics of the quantity ``name`` of a mesh cycle."""
    phases, values = cycle.phases, getattr(cycle, name)
    pieces = curves(phases, values, POINTS)
    return CycleCurve(
        phase=np.concatenate([x for x, _ in pieces]),
        values=np.concatenate([y for _, y in pieces]),
        length=phases.length,
        orders=np.array(phases.orders),
        amplitude=2 * np.abs(coefficients(phases, values)),
        **{kind: float(response(f"{name}_{kind}").reduce(cycle)) for kind in ("mean", "rms", "peak_to_peak")},
    )


@single_threaded_blas()
def _scatter(solved: Solved | SolvedTrain, samples: int, progress: Callable[[int, int], None]) -> Mapping[str, NDArray]:
    """Responses to the error samples, response → (sample,)."""
    # prepared from the solved scene, so lines, gaps and compliance are the same
    of_train = isinstance(solved, SolvedTrain)
    problem = sampled_train(solved.scene, solved) if of_train else prepare_scene(solved.scene)
    errors, advance = problem.draw(samples, seed=0, sampler="sobol"), lambda done: progress(done, samples)
    answer, complete = respond(problem, errors, default_threads(), advance, problem.studied)
    if not complete:
        raise KeyboardInterrupt  # only Ctrl-C ends `respond` early
    return answer.values


def density(values: NDArray, points: int = 120) -> tuple[NDArray, NDArray]:
    """Gaussian kernel density on a grid: points and density, (point,) each; width by Scott's rule.

    If all values agree to nine digits, the result is a vertical line of height 1.
    """
    spread = float(values.std(ddof=1)) if len(values) > 1 else 0.0
    centre = float(values.mean())
    if spread <= 1e-9 * abs(centre):
        return np.array([centre, centre]), np.array([0.0, 1.0])
    width = spread * len(values) ** -0.2
    x = np.linspace(values.min() - 3 * width, values.max() + 3 * width, points)
    t = (x[:, None] - values) / width
    return x, np.exp(-(t**2) / 2).mean(axis=1) / (width * np.sqrt(2 * np.pi))
