"""Robustness of a scene: its response to many random manufacturing errors."""

from __future__ import annotations

import logging
import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import MEASURED
from gearbench.contact.assemble import assemble, mesh_phases, scene_lines
from gearbench.contact.batch import Batch, BatchSolution, chunks, on_threads, prepare, solve_one_chunk
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.errors import InputError
from gearbench.outputs import MICROMETRES, Solved, cycle_numbers
from gearbench.robustness.dataset import robust_dataset
from gearbench.robustness.sampling import Sampler, unit_samples
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

_LOG = logging.getLogger(__name__)

#: Error samples unless told otherwise.
SAMPLES = 1000


@dataclass(frozen=True, kw_only=True)
class RobustProblem:
    """A scene prepared for many error samples.

    Parameters
    ----------
    scene, errors
        The scene and its random errors.
    batch
        The contact problem at the mean errors and the gap of each error.
    mean
        Mean of each error, (error,) [µm].
    weight
        Weights of the mesh phases, (position,).
    """

    scene: Scene
    errors: ManufacturingErrors
    batch: Batch
    mean: NDArray
    weight: NDArray

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the errors."""
        return tuple(mode.name for mode in self.errors.error_modes(self.scene.pair))

    def draw(self, samples: int, seed: int, sampler: Sampler, start: int = 0) -> NDArray:
        """Errors of the samples ``start`` … ``samples`` − 1, (sample, error) [µm]."""
        return self.errors.draw(unit_samples(sampler, samples, len(self.names), seed, start=start), self.scene.pair)


def prepare_scene(scene: Scene, solved: Solved | None = None) -> RobustProblem:
    """Everything about ``scene`` that does not depend on the sample; ``solved`` is the scene where it was solved.

    Raises
    ------
    InputError
        If the scene has no random errors.
    """
    return prepare_phases(scene, *mesh_phases(scene), solved)


def prepare_phases(scene: Scene, phase: NDArray, weight: NDArray, solved: Solved | None = None) -> RobustProblem:
    """As ``prepare_scene``, at the mesh phases and weights given, (position,)."""
    errors = scene.effect("manufacturing_errors")
    if not isinstance(errors, ManufacturingErrors):
        raise InputError("effects", "no manufacturing_errors", "robustness needs [effects.manufacturing_errors]")
    lines = solved.lines if solved else scene_lines(scene, phase)
    problem = solved.problem if solved else assemble(scene, lines)
    positions, pairs, segments = lines.shape
    modes = (errors.modes(lines) / np.expand_dims(lines.lever, -1)).reshape(positions, pairs * segments, -1)
    return RobustProblem(
        scene=scene, errors=errors, batch=prepare(problem, modes), mean=errors.mean(scene.pair), weight=weight
    )


@dataclass(frozen=True, kw_only=True)
class Responses:
    """What each sample answers, (sample,): STE [µm] and stiffness [N/µm or %]."""

    transmission_error_mean: NDArray
    transmission_error_rms: NDArray
    mesh_stiffness_mean: NDArray
    mesh_stiffness_rms: NDArray
    rescued: int

    def __len__(self) -> int:
        return len(self.transmission_error_rms)

    @classmethod
    def of(cls, numbers: NDArray, rescued: int) -> Responses:
        """From ``numbers``."""
        return cls(**dict(zip(MEASURED, numbers, strict=True)), rescued=rescued)

    @property
    def numbers(self) -> NDArray:
        """All of them in the order of ``accuracy.measure.MEASURED``, (4, sample)."""
        return np.array([getattr(self, name) for name in MEASURED])


def respond(
    problem: RobustProblem, errors: NDArray, threads: int = 1, progress: Callable[[int], None] = lambda _: None
) -> tuple[Responses, bool]:
    """Responses to the ``errors`` (sample, error) [µm], and whether all of them were computed.

    An interruption (Ctrl-C) ends the run early; what was computed until then is returned. ``progress`` is called with
    the number of samples done so far.
    """
    done: list[Responses] = []
    complete = True
    solutions = on_threads(partial(solve_one_chunk, problem.batch), chunks(errors - problem.mean), threads)
    try:
        for solution in solutions:
            done.append(_reduce(problem, solution))
            progress(min(sum(map(len, done)), len(errors)))
    except KeyboardInterrupt:
        complete = False
    return _join(done, len(errors)), complete


def _reduce(problem: RobustProblem, solution: BatchSolution) -> Responses:
    """RMS values and means of one chunk; the fields over the mesh cycle are not kept."""
    cos_b = math.cos(problem.scene.pair.base_helix_angle)
    ste = MICROMETRES / cos_b * solution.approach.T
    k = cos_b**2 / MICROMETRES * solution.stiffness.T
    return Responses.of(cycle_numbers(ste, k, problem.weight), solution.rescued)


def response_means(responses: Responses) -> NDArray:
    """Means over the samples of mean and RMS of STE and stiffness, (4,): see ``accuracy.measure``."""
    return responses.numbers.mean(axis=1)


def _join(parts: list[Responses], count: int) -> Responses:
    numbers = np.concatenate([np.empty((len(MEASURED), 0)), *(part.numbers for part in parts)], axis=1)
    return Responses.of(numbers[:, :count], sum(part.rescued for part in parts))


def robust(
    scene: Scene,
    *,
    samples: int | None = None,
    seed: int = 0,
    sampler: Sampler = "sobol",
    threads: int | None = None,
    progress: Callable[[int], None] = lambda _: None,
) -> xr.Dataset:
    """Response of ``scene`` to random manufacturing errors.

    Parameters
    ----------
    scene
        With the effect ``manufacturing_errors``.
    samples, seed, sampler
        Number of samples (1000 by default, or chosen where the scene gives ``resolution.accuracy``) and how they are
        drawn; sample i is the same whatever the number of threads.
    threads
        Number of threads; as many as there are processors by default.
    progress
        Called with the number of samples done so far.

    Returns
    -------
    Dataset over the samples: RMS values and means of STE and mesh stiffness, the errors drawn, means, standard
    deviations and maxima with standard errors, and the share of each error in the variance. After Ctrl-C it holds the
    samples finished until then, and says so in the attribute ``complete``.

    Raises
    ------
    InputError
        If the scene has no random errors, or ``samples`` is not positive, or given beside an accuracy.

    Examples
    --------
    >>> from gearbench import load_scene
    >>> dataset = robust(load_scene("examples/gear55_robust.toml"), samples=64, seed=1)
    >>> dict(dataset.sizes)["sample"], dataset["mesh_stiffness_rms"].dims
    (64, ('sample',))
    >>> bool(dataset["transmission_error_rms_max"] >= dataset["transmission_error_rms_mean"])
    True
    """
    start = time.perf_counter()
    if samples is not None and samples < 1:
        raise InputError("samples", samples, "must be at least 1")
    chosen: dict[str, Any] = {}
    if scene.resolution.accuracy is not None:
        from gearbench.robustness.adaptive import choose_robust

        if samples is not None:
            raise InputError("samples", samples, "conflicts with accuracy, which chooses it")
        choice, samples = choose_robust(scene, seed=seed, sampler=sampler, threads=threads or default_threads())
        scene, chosen = choice.scene, choice.attrs
    problem, threads = prepare_scene(scene), threads or default_threads()
    errors = problem.draw(samples or SAMPLES, seed, sampler)
    responses, complete = respond(problem, errors, threads, progress)
    _LOG.info("%d samples of %d errors on %d threads, %d rescued", *errors.shape, threads, responses.rescued)
    run = {"complete": complete, "sampler": sampler, "seed": seed, "wall_time": time.perf_counter() - start}
    return robust_dataset(problem, errors, responses, **run).assign_attrs(chosen)


def default_threads() -> int:
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
