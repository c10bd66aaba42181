"""Scatter of the response over random manufacturing errors: percentiles of the fluctuating mesh force over speed."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.budget import require_each, sample_memory, speed_memory
from gearbench.contact.batch import BatchSolution, chunks, on_threads, solve_one_chunk
from gearbench.dynamics.analysis import (
    GROWTH_TOLERANCE,
    HARMONICS,
    check_harmonics,
    check_speeds,
    growth,
    only_excited_by,
    response_dataset,
    spans,
)
from gearbench.dynamics.balance import Excitation
from gearbench.dynamics.loaded_mesh import LoadedMesh, order_rows
from gearbench.dynamics.model import Group, LinearModel, Model
from gearbench.dynamics.sample_balance import SampleBalance
from gearbench.dynamics.train_model import TrainModel, train_model
from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.results.responses import STATISTICS
from gearbench.robustness.montecarlo import SAMPLES, RobustProblem, prepare_problem, require_errors
from gearbench.robustness.sampling import Sampler
from gearbench.scene import Scene
from gearbench.threads import default_threads, single_threaded_blas
from gearbench.trains.scatter import sampled_train

#: Percentiles of the mesh force at each speed.
PERCENTILES = (5.0, 25.0, 50.0, 75.0, 95.0, 99.0)
#: Condition on the pair whose mesh force over speed is computed.
OWN_FREQUENCY = "the force over speed needs a pair whose mesh frequency no other mesh shares"
#: Number of speeds solved together.
BLOCK = 200


def sample_problem(model: Model) -> RobustProblem:
    """Contact problem of the scene's own pair under random errors, on the shafts if there are any.

    Raises
    ------
    InputError
        If the scene has no random errors, or errors of the centre distance.
    """
    mesh = model.loaded_meshes[0]
    if require_errors(mesh.scene).centre_distance is not None:
        raise InputError("effects.manufacturing_errors.centre_distance", "given", "only the command robust supports it")
    phases = mesh.cycle.phases
    scene = replace(mesh.scene, resolution=replace(mesh.scene.resolution, gauss_points=phases.size))
    return prepare_problem(scene, mesh.solved.lines, phases.weight, mesh.solved.problem)


def pair_excitations(
    model: Model, harmonics: int, *, samples: int, seed: int, sampler: Sampler, threads: int
) -> list[Excitation]:
    """Excitation by random samples of ``sample_problem``, in chunks (sample, row, …).

    Raises
    ------
    InputError
        As ``sample_problem``.
    """
    problem, mesh = sample_problem(model), model.loaded_meshes[0]
    amounts = problem.expansion.amounts(problem.draw(samples, seed, sampler))

    def of_chunk(chunk: NDArray) -> Excitation:
        solution = solve_one_chunk(problem.batch, chunk, segments=mesh.rows > 1)
        return excitation(mesh, problem, solution, harmonics)

    return _without_padding(on_threads(of_chunk, chunks(amounts), threads), samples)


def excitation(mesh: LoadedMesh, problem: RobustProblem, solution: BatchSolution, harmonics: int) -> Excitation:
    """Excitation (sample, row, …) by a chunk of samples; for several rows a mesh, ``solution`` needs segment forces."""
    flanks = mesh.samples(problem.batch, problem.lines, solution)
    return flanks.excitation(order_rows(problem.phases, 2 * harmonics))


def train_excitations(
    model: TrainModel, harmonics: int, *, samples: int, seed: int, sampler: Sampler, threads: int
) -> list[Excitation]:
    """Excitation by random samples of a train, in chunks (sample, row, …).

    Raises
    ------
    InputError
        As ``sampled_train``.
    """
    train, (group,) = sampled_train(model.scene, model.solved), model.groups
    errors = train.draw(samples, seed, sampler)

    def of_chunk(chunk: NDArray) -> Excitation:
        motion, force, stiffness = train.balance(chunk)
        return model.excitation_by(group, harmonics, model.approach(motion), force, stiffness)

    return _without_padding(on_threads(of_chunk, train.chunks(errors), threads), samples)


def _without_padding(chunks: Iterable[Excitation], samples: int) -> list[Excitation]:
    """Drop the samples that ``batch.chunks`` repeats in the last chunk, so that ``samples`` remain in all."""
    *full, last = chunks
    return [*full, last.part(slice(samples - sum(len(chunk.motion) for chunk in full)))]


def force_rms(
    model: LinearModel, group: Group, samples: Sequence[Excitation], speed: NDArray, threads: int = 1
) -> NDArray:
    """RMS of the fluctuating mesh force (speed, sample) [N] by harmonic balance, for chunks of ``samples``.

    Of several meshes, it is the largest RMS. The balance is (D5) of docs/theory.md, about the mean excitation of the
    first chunk.
    """
    rows = model.rows_of(group.meshes)
    h = model.receptances(group, speed, samples[0].orders)
    # the first row of each mesh is its approach
    approach = range(0, len(rows), len(rows) // len(group.meshes))
    balance = SampleBalance.of(samples[0], h, model.stiffness_of(group.meshes), approach)

    def rms(chunk: Excitation) -> NDArray:
        by_mesh = balance.forces(chunk).astype(float).reshape(len(speed), len(group.meshes), -1, len(chunk.motion))
        return math.sqrt(2) * np.linalg.norm(by_mesh, axis=2).max(axis=1)

    return np.concatenate([*on_threads(rms, samples, threads)], axis=1)


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

    Contact is solved as for ``robust``, at the mesh phases of the scene without errors. Compared with ``response`` of
    one scene for each sample, the mean over samples and speeds differs by 1 %, or by 2 % if the gears are on shafts or
    have no relief; single samples differ by 5 %, on shafts by 20 %. The notes of the result repeat this, and
    name the speeds at which the RMS of a sample exceeds the mean force. Flanks separate at a lower RMS already: under a
    sinusoidal force, at 0.71 times the mean force.

    Parameters
    ----------
    scene
        A scene with ``[system]`` and the effect ``manufacturing_errors``, or a train whose meshes are one contact
        problem with random errors as for ``robust``.
    speed
        Speeds of the pinion, or of the member that ``response`` names [1/min].
    samples, seed, sampler
        As for ``robust``.
    harmonics
        Number of orders of the mesh frequency.
    threads
        Number of threads; by default the number of processors.

    Returns
    -------
    Dataset with the RMS of the fluctuating mesh force at each speed, of several meshes the largest:
    ``mesh_force_percentile`` (speed, percentile), mean, standard deviation and maximum. ``mesh_force`` (sample,) is the
    RMS of each sample over all speeds, with its statistics ``…_mean``, ``…_std`` and ``…_max`` over the samples.

    Raises
    ------
    InputError
        If the scene has no system or no random errors, or a second mesh shares the mesh frequency.
    """
    start = time.perf_counter()
    speeds = check_speeds(speed)
    check_harmonics(harmonics)
    if samples < 2:
        raise InputError("samples", samples, "must be at least 2")
    model = train_model(scene.single_load) if scene.coupled else Model(scene=scene)
    group, workers = model.groups[0], threads or default_threads()
    if isinstance(model, Model) and len(group.meshes) > 1:
        raise InputError("system.meshes", "several of one mesh frequency", OWN_FREQUENCY)
    orders, rows, block = len(group.orders(harmonics)) - 1, len(model.rows_of(group.meshes)), min(BLOCK, len(speeds))
    size = f"{orders} orders and {block} speeds at a time"
    require_each(sample_memory(orders, block, rows), samples, "sample", size)
    require_each(speed_memory(orders, rows, 0), len(speeds), "speed", f"{orders} orders")
    drawn: Any = {"samples": samples, "seed": seed, "sampler": sampler, "threads": workers}
    if isinstance(model, Model):
        excitations = pair_excitations(model, harmonics, **drawn)
    else:
        excitations = train_excitations(model, harmonics, **drawn)
    over_speed, overall = _statistics(model, group, excitations, speeds, workers)
    variables = over_speed | {"mesh_force": (("sample",), overall)}
    variables |= {f"mesh_force_{name}": ((), np.asarray(f(overall))) for name, (f, _) in STATISTICS.items()}
    lines = only_excited_by(model, group.meshes)
    lines += remarks(model, group, harmonics, speeds, over_speed["mesh_force_rms_max"][1])
    return response_dataset(model, speeds, variables, lines, start, scene, seed, percentile=list(PERCENTILES))


def remarks(model: LinearModel, group: Group, harmonics: int, speeds: NDArray, largest: NDArray) -> list[str]:
    """Notes for the reader of the scatter, one line each, from the ``largest`` RMS of all samples (speed,) [N]."""
    on_shafts = isinstance(model, Model) and model.loaded_meshes[0].rows > 1
    mean, single = ("2 %", 20) if on_shafts else ("1 % (2 % without relief)", 5)
    lines = [f"the mean over samples and speeds is accurate to {mean}, single samples to {single} %"]
    if len(group.meshes) > 1:
        lines.append("at each speed the RMS is that of the mesh where it is largest")
    if (grows := growth(model, group, speeds, harmonics) > 1 + GROWTH_TOLERANCE).any():
        lines.append(
            f"parametric instability of the scene without errors at {spans(speeds, grows)} 1/min: no steady response"
        )
    # flanks separate at a lower RMS already, but only RMS values of samples are known, not peaks
    separated = largest > model.force[group.meshes].min()
    if separated.any():
        at_speeds = spans(speeds, separated)
        lines.append(
            f"flanks separate: the RMS of samples exceeds the mean force, results do not hold at {at_speeds} 1/min"
        )
    return lines


def _statistics(
    model: LinearModel, group: Group, excitations: Sequence[Excitation], speeds: NDArray, threads: int
) -> tuple[dict[str, tuple[tuple[str, ...], NDArray]], NDArray]:
    """Variables over speed, and the RMS of each sample over all speeds (sample,) [N]."""
    squares = np.zeros(sum(len(chunk.motion) for chunk in excitations))
    percentiles, moments = np.empty((len(speeds), len(PERCENTILES))), np.empty((3, len(speeds)))
    # speeds are solved in blocks, so that memory does not grow with speeds times samples
    for first in range(0, len(speeds), BLOCK):
        block = slice(first, first + BLOCK)
        values = force_rms(model, group, excitations, speeds[block], threads)
        squares += (values**2).sum(axis=0) / len(speeds)
        percentiles[block] = np.percentile(values, PERCENTILES, axis=1).T
        moments[:, block] = values.mean(axis=1), values.std(axis=1, ddof=1), values.max(axis=1)
    variables = {
        f"mesh_force_rms_{name}": (("speed",), m) for name, m in zip(("mean", "std", "max"), moments, strict=True)
    }
    return variables | {"mesh_force_percentile": (("speed", "percentile"), percentiles)}, np.sqrt(squares)
