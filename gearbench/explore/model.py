"""Results for a picked gear: curves over the mesh cycle, orders, contact pressure on the flank, scatter.

This module does not depend on the page.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.results import flank
from gearbench.results.cycle import coefficients, curves
from gearbench.results.flank_map import over_flank
from gearbench.results.responses import response
from gearbench.results.solved import Solved
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.scene import Resolution, Scene
from gearbench.solution import solve_scene
from gearbench.threads import default_threads

#: Pixels of the flank map, across and up.
SIZE = (48, 72)


def flank_range(solved: Solved) -> tuple[float, float]:
    """Range of u [mm] of a flank map: the path of contact, extended to contact lines that reach beyond it."""
    lines, meshing = solved.lines, solved.scene.pair.meshing
    u = lines.u[lines.active]
    return min(meshing.path_start, float(u.min())), max(meshing.path_end, float(u.max()))


def flank_map(solved: Solved, values: NDArray, size: tuple[int, int] = SIZE) -> NDArray:
    """Interpolate ``values`` (position, pair, segment) onto y = 0 … b and u in ``flank_range``, (up, across).

    Pixels without a contact line nearby are NaN.
    """
    lines, meshing = solved.lines, solved.scene.pair.meshing
    active = lines.active
    order = np.argsort((lines.mesh_phase[:, None] + lines.index)[active])
    u, y, length, own = (each[active][order] for each in (lines.u, lines.y, lines.length, values))
    (first, last), (across, up) = flank_range(solved), size
    path = first + (np.arange(up) + 0.5) / up * (last - first)
    face = (np.arange(across) + 0.5) / across * meshing.face_width
    return over_flank(u, y, length * math.cos(meshing.beta_b), own, path, face)


#: Number of error samples, and of mesh orders in the spectra.
SAMPLES, ORDERS = 256, 10


@dataclass(frozen=True, kw_only=True)
class CycleCurve:
    """Curve of a quantity over the mesh cycle.

    Parameters
    ----------
    phase, values
        Curve over one mesh period, (point,).
    amplitude
        Amplitudes of the mesh orders 1 … ``ORDERS``, (order,).
    mean, rms, peak_to_peak
        Values over the cycle; ``rms`` of the stiffness is relative to its mean [%].
    """

    phase: NDArray
    values: NDArray
    amplitude: NDArray
    mean: float
    rms: float
    peak_to_peak: float


@dataclass(frozen=True, kw_only=True)
class RmsSamples:
    """RMS values of STE [µm] and of mesh stiffness [%] for every error sample, (sample,)."""

    transmission_error: NDArray
    mesh_stiffness: NDArray


@dataclass(frozen=True, kw_only=True)
class Picture:
    """All results shown for one gear.

    Parameters
    ----------
    scene
        The scene that was solved.
    transmission_error, mesh_stiffness
        STE [µm] and stiffness [N/µm] with every error at its mean.
    pressure
        Hertz pressure on the flank, see ``flank_map`` [MPa].
    pressure_range
        Range of u [mm] that the map covers.
    scatter
        RMS values of the error samples; None if the scene has no random errors, or if they are not computed yet.
    seconds
        Wall time.
    """

    scene: Scene
    transmission_error: CycleCurve
    mesh_stiffness: CycleCurve
    pressure: NDArray
    pressure_range: tuple[float, float]
    scatter: RmsSamples | None
    seconds: float

    @property
    def unfinished(self) -> bool:
        """Whether the scatter still has to be computed."""
        return self.scatter is None and isinstance(self.scene.effect("manufacturing_errors"), ManufacturingErrors)


def picture(scene: Scene, samples: int = SAMPLES) -> Picture:
    """Compute all results shown for ``scene``; raises as ``outline``."""
    return scattered(*outline(scene), samples)


def outline(scene: Scene) -> tuple[Picture, Solved]:
    """Compute all results but the scatter; also return the solution, from which the scatter is computed.

    The default resolution replaces a requested accuracy, and the greatest load replaces several loads.

    Raises
    ------
    InputError
        If the scene has several meshes, as planetary sets do.
    GearbenchError
        If the contact problem cannot be solved.
    """
    start, scene = time.perf_counter(), scene.one_mesh
    if scene.resolution.accuracy is not None:
        scene = replace(scene, resolution=Resolution())
    scene = scene.under(scene.load) if scene.loads else scene
    solved = solve_scene(scene)
    found = Picture(
        scene=scene,
        transmission_error=_cycle(solved, "transmission_error"),
        mesh_stiffness=_cycle(solved, "mesh_stiffness"),
        pressure=flank_map(solved, flank.pressure(solved)),
        pressure_range=flank_range(solved),
        scatter=None,
        seconds=time.perf_counter() - start,
    )
    return found, solved


def scattered(picture: Picture, solved: Solved, samples: int = SAMPLES) -> Picture:
    """Add the scatter to ``picture`` if the scene has random errors."""
    start = time.perf_counter()
    scatter = _scatter(solved, samples) if picture.unfinished else None
    return replace(picture, scatter=scatter, seconds=picture.seconds + time.perf_counter() - start)


def _cycle(solved: Solved, name: str) -> CycleCurve:
    phases, values = solved.cycle.phases, getattr(solved.cycle, name)
    parts = curves(phases, values, 12)
    return CycleCurve(
        phase=np.concatenate([x for x, _ in parts]),
        values=np.concatenate([y for _, y in parts]),
        amplitude=2 * np.abs(coefficients(phases, values, ORDERS)),
        **{part: float(response(f"{name}_{part}").reduce(solved.cycle)) for part in ("mean", "rms", "peak_to_peak")},
    )


def _scatter(solved: Solved, samples: int) -> RmsSamples | None:
    scene = solved.scene
    if not isinstance(scene.effect("manufacturing_errors"), ManufacturingErrors):
        return None
    # prepared from the solved scene, so lines, gaps and compliance are the same
    problem = prepare_scene(scene)
    answer, complete = respond(problem, problem.draw(samples, 0, "sobol"), default_threads())
    if not complete:
        raise KeyboardInterrupt
    return RmsSamples(transmission_error=answer["transmission_error_rms"], mesh_stiffness=answer["mesh_stiffness_rms"])


def density(values: NDArray, points: int = 120) -> tuple[NDArray, NDArray]:
    """Gaussian kernel density on a grid: points and density, (point,); width by Scott's rule.

    If all values are equal, the result is a single peak.
    """
    spread = float(values.std(ddof=1)) if len(values) > 1 else 0.0
    centre = float(values.mean())
    if spread <= 1e-9 * abs(centre):
        return np.array([centre, centre]), np.array([0.0, 1.0])
    width = spread * len(values) ** -0.2
    x = np.linspace(values.min() - 3 * width, values.max() + 3 * width, points)
    t = (x[:, None] - values) / width
    return x, np.exp(-(t**2) / 2).mean(axis=1) / (width * np.sqrt(2 * np.pi))
