"""Scatter of the response over random manufacturing errors: percentiles of the mesh force over speed."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.budget import require_each, sample_memory, speed_memory
from gearbench.contact.assemble import assemble
from gearbench.contact.batch import chunks, on_threads, solve_one_chunk
from gearbench.dynamics.analysis import GROWTH, HARMONICS, check_harmonics, check_speeds, growth, spans
from gearbench.dynamics.balance import convolution, real
from gearbench.dynamics.loaded_mesh import PER_MICROMETRE, LoadedMesh, order_rows
from gearbench.dynamics.model import Group, Model
from gearbench.errors import InputError
from gearbench.results.cycle import MICROMETRES, MeshCycle
from gearbench.results.origin import keeping
from gearbench.results.provenance import provenance
from gearbench.results.responses import STATISTICS, described
from gearbench.robustness.montecarlo import SAMPLES, RobustProblem, prepare_problem, require_errors
from gearbench.robustness.sampling import Sampler
from gearbench.scene import Scene
from gearbench.threads import default_threads, single_threaded_blas

if TYPE_CHECKING:
    import xarray as xr

#: Percentiles of the mesh force at each speed.
PERCENTILES = (5.0, 25.0, 50.0, 75.0, 95.0, 99.0)


#: Speeds solved together.
BLOCK = 50


@dataclass(frozen=True, kw_only=True)
class SampleCycles:
    """Orders of stiffness (sample, 2H + 1) [N/mm] and transmission error (sample, H + 1) [mm] of error samples.

    The stiffness is that without the shafts.
    """

    stiffness: NDArray
    error: NDArray

    @classmethod
    def of(cls, cycle: MeshCycle, mesh: LoadedMesh, harmonics: int) -> SampleCycles:
        """Orders of the curves (sample, position) of a cycle of ``mesh`` on its shafts, 2H of the stiffness."""
        phases, δ, k = cycle.phases, cycle.transmission_error / MICROMETRES, PER_MICROMETRE * cycle.mesh_stiffness
        rows = order_rows(phases, 2 * harmonics)
        return cls(stiffness=(k / (1 - k * mesh.compliance[0, 0])) @ rows.T, error=δ @ rows[: harmonics + 1].T)


def sample_problem(model: Model) -> RobustProblem:
    """Contact of the scene's own pair under random errors, on its shafts if there are any.

    Raises
    ------
    InputError
        If the scene has no random errors.
    """
    cycle = model.cycles[0]
    if require_errors(cycle.scene).centre_distance is not None:
        raise InputError(
            "effects.manufacturing_errors.centre_distance", "given", "is for robust: here axes keep theirs"
        )
    phases = cycle.cycle.phases
    scene = replace(cycle.scene, resolution=replace(cycle.scene.resolution, gauss_points=phases.size))
    return prepare_problem(scene, cycle.lines, phases.weight, assemble(scene, cycle.lines, cycle.effects))


def sample_cycles(
    model: Model, harmonics: int, *, samples: int, seed: int, sampler: Sampler, threads: int
) -> SampleCycles:
    """Orders of stiffness and transmission error of the samples of ``sample_problem``; raises as that."""
    problem = sample_problem(model)
    drawn, parts = problem.expansion.amounts(problem.draw(samples, seed, sampler)), []
    for solution in on_threads(partial(solve_one_chunk, problem.batch), chunks(drawn), threads):
        cycle = MeshCycle.of(problem.scene, problem.phases, solution.approach.T, solution.stiffness.T)
        parts.append(SampleCycles.of(cycle, model.cycles[0], harmonics))
    whole = {name: np.concatenate([getattr(part, name) for part in parts])[:samples] for name in ("stiffness", "error")}
    return SampleCycles(**whole)


def force_rms(model: Model, group: Group, cycles: SampleCycles, speed: NDArray, threads: int) -> NDArray:
    """RMS of the mesh force (speed, sample) [N], by harmonic balance (D5).

    The matrix of a sample, K, is assembled once, with order 0 eliminated; each speed adds its dynamic stiffness to the
    blocks of the other orders.
    """
    from gearbench.dynamics._kernels import LANES, force_squares

    harmonics = cycles.error.shape[-1] - 1
    h = model.receptances(group, speed, harmonics)[:, 1:, 0, 0]
    dynamic = 1 / h - model.stiffness[group.meshes[0], group.meshes[0]]
    out = np.empty((len(speed), len(cycles.error)))

    def some(first: int) -> None:
        """The samples from number ``first`` on, as many as the kernel takes at once."""
        here = slice(first, first + LANES)
        K = convolution(cycles.stiffness[here])
        drive = np.einsum("sab,sb->sa", K, real(cycles.error[here]))
        held = K[:, 1:, 0] / K[:, :1, 0]
        left, load = K[:, 1:, 1:] - held[:, :, None] * K[:, :1, 1:], drive[:, 1:] - held * drive[:, :1]
        matrix, right = (np.ascontiguousarray(np.moveaxis(part, 0, -1)) for part in (left, load))
        out[:, here] = np.sqrt(2 * force_squares(matrix, right, dynamic))

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(some, range(0, len(cycles.error), LANES)))
    return out


@single_threaded_blas()
def robust_response(
    scene: Scene,
    *,
    speed: ArrayLike,
    samples: int = SAMPLES,
    seed: int = 0,
    sampler: Sampler = "sobol",
    harmonics: int = HARMONICS,
    threads: int | None = None,
) -> xr.Dataset:
    """Mesh force over speed under random manufacturing errors.

    Percentiles are good to 1 % on the mean over speed, to 2 % without relief. Gears on shafts tilt without inertia,
    which makes the percentiles about 5 % too low.

    Parameters
    ----------
    scene
        With ``[system]`` and the effect ``manufacturing_errors``.
    speed
        Of the pinion [1/min].
    samples, seed, sampler
        As ``robust``.
    harmonics
        Orders of the mesh frequency.
    threads
        As many as there are processors by default.

    Returns
    -------
    Dataset with ``mesh_force_percentile`` (speed, percentile), mean, standard deviation and maximum of the RMS of the
    mesh force at each speed, and of each sample its RMS over all speeds, the response ``mesh_force`` (sample,), with
    its statistics ``…_mean``, ``…_std`` and ``…_max`` over the samples.

    Raises
    ------
    InputError
        If the scene has no system or no random errors, or a second mesh shares the mesh frequency.
    """
    import xarray as xr

    start = time.perf_counter()
    speeds = check_speeds(speed)
    check_harmonics(harmonics)
    if samples < 2:
        raise InputError("samples", samples, "must be at least 2")
    model, workers = Model(scene=scene, rows=1), threads or default_threads()
    group = model.groups[0]
    if len(group.meshes) > 1:
        raise InputError("system.meshes", "of the same mesh frequency", "scatter is for a pair of its own frequency")
    block = min(BLOCK, len(speeds))
    require_each(sample_memory(harmonics, block), samples, "sample", f"{harmonics} orders and {block} speeds at a time")
    require_each(speed_memory(harmonics, 1, 0), len(speeds), "speed", f"{harmonics} orders")
    cycles = sample_cycles(model, harmonics, samples=samples, seed=seed, sampler=sampler, threads=workers)
    over_speed, overall = _statistics(model, group, cycles, speeds, workers)
    variables = over_speed | {"mesh_force": (("sample",), overall)}
    variables |= {f"mesh_force_{name}": ((), np.asarray(f(overall))) for name, (f, _) in STATISTICS.items()}
    coords = {"speed": ("speed", speeds), "percentile": ("percentile", list(PERCENTILES))}
    lines = remarks(model, group, harmonics, speeds, over_speed["mesh_force_rms_max"][1])
    attrs = provenance(scene, wall_time=time.perf_counter() - start, seed=seed) | {"notes": "\n".join(lines)}
    return keeping(xr.Dataset(described(variables), coords=described(coords), attrs=attrs), scene)


def remarks(model: Model, group: Group, harmonics: int, speeds: NDArray, largest: NDArray) -> list[str]:
    """Notes for the reader of the scatter, one line each; ``largest`` RMS of all samples at each speed (speed,)."""
    lines = []
    if (grows := growth(model, group, speeds, harmonics) > 1 + GROWTH).any():
        lines.append(f"parametric instability without scatter at {spans(speeds, grows)} 1/min: no steady response")
    parts = largest > model.force[group.meshes[0]]
    if parts.any():
        where = spans(speeds, parts)
        lines.append(f"flanks part: the RMS of samples exceeds the mean force, not theirs any more, at {where} 1/min")
    return lines


def _statistics(
    model: Model, group: Group, cycles: SampleCycles, speeds: NDArray, workers: int
) -> tuple[dict[str, tuple[tuple[str, ...], NDArray]], NDArray]:
    """Variables over speed, and of each sample its RMS over all speeds (sample,) [N]."""
    squares = np.zeros(len(cycles.error))
    table, moments = np.empty((len(speeds), len(PERCENTILES))), np.empty((3, len(speeds)))
    # block by block of speeds: memory does not grow with speeds times samples
    for first in range(0, len(speeds), BLOCK):
        here = slice(first, first + BLOCK)
        values = force_rms(model, group, cycles, speeds[here], workers)
        squares += (values**2).sum(axis=0) / len(speeds)
        table[here] = np.percentile(values, PERCENTILES, axis=1).T
        moments[:, here] = values.mean(axis=1), values.std(axis=1, ddof=1), values.max(axis=1)
    variables = {
        f"mesh_force_rms_{name}": (("speed",), m) for name, m in zip(("mean", "std", "max"), moments, strict=True)
    }
    return variables | {"mesh_force_percentile": (("speed", "percentile"), table)}, np.sqrt(squares)
