"""Robustness run of a scene: choose, draw and solve the samples, and reduce them to a Dataset."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from typing import Any

from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.results.responses import check_responses
from gearbench.robustness.adaptive import choose_robust
from gearbench.robustness.dataset import Run, robust_dataset
from gearbench.robustness.montecarlo import SAMPLES, Sampled, prepare_scene, respond_with_usual
from gearbench.robustness.sampling import Sampler
from gearbench.scene import Scene, check_scene
from gearbench.threads import default_threads

_LOG = logging.getLogger(__name__)


def robust(
    scene: Scene,
    *,
    samples: int | None = None,
    seed: int = 0,
    sampler: Sampler = "sobol",
    threads: int | None = None,
    responses: Sequence[str] = (),
    shares: bool = True,
    progress: Callable[[int], None] = lambda _: None,
) -> xr.Dataset:
    """Response of ``scene`` to random manufacturing errors.

    Parameters
    ----------
    scene
        A scene with the effect ``manufacturing_errors``.
    samples
        Number of samples; by default 1000, or chosen if the scene gives ``resolution.accuracy``.
    seed, sampler
        Seed and method of drawing; sample i does not depend on the number of threads.
    threads
        Number of threads; by default the number of processors.
    responses
        Names of further responses, see ``gearbench.results.responses``.
    shares
        Whether to compute the share of each error in the variance, and the gain of a tolerance one class finer. With
        several loads both are always computed.
    progress
        Function called with the number of samples done so far.

    Returns
    -------
    Dataset with the errors drawn, and mean and RMS of STE and stiffness of all samples. RMS values and requested
    responses have statistics with standard errors, and the share of each error in the variance. After Ctrl-C it holds
    the samples finished until then (``complete`` is 0). With several loads it is the Dataset of ``sweep``, with the
    same samples under each load. For a train of parallel paths or a planetary set it holds load sharing and
    transmission error of the train, under the errors of ``[planetary.scatter]`` and of profiles and helices.

    Raises
    ------
    InputError
        If the scene has no random errors, a response is unknown, or ``samples`` is not positive or is given together
        with an accuracy.

    Examples
    --------
    >>> from gearbench import read_scene
    >>> dataset = robust(read_scene("examples/gear55_robust.toml"), samples=64, seed=1)
    >>> dict(dataset.sizes)["sample"], dataset["mesh_stiffness_rms"].dims
    (64, ('sample',))
    """
    check_scene(scene)
    start = time.perf_counter()
    if samples is not None and samples < 1:
        raise InputError("samples", samples, "must be at least 1")
    check_responses(responses)
    chosen: dict[str, Any] = {}
    if scene.resolution.accuracy is not None and not scene.coupled:
        if samples is not None:
            raise InputError("samples", samples, "conflicts with accuracy, which sets it: give one of them")
        choice, samples = choose_robust(scene, seed=seed, sampler=sampler, threads=threads or default_threads())
        scene, chosen = choice.scene, choice.attrs
    if scene.loads and not scene.coupled:
        how = {"seed": seed, "sampler": sampler, "threads": threads, "outputs": responses}
        return _under_loads(scene, samples or SAMPLES, progress, **how).assign_attrs(chosen)
    threads = threads or default_threads()
    if scene.coupled:
        from gearbench.trains.scatter import sampled_train

        problem: Sampled = sampled_train(scene, responses=responses)
    else:
        problem = prepare_scene(scene)
    errors = problem.draw(samples or SAMPLES, seed, sampler)
    answers, complete = respond_with_usual(problem, errors, responses, threads, progress)
    _LOG.info("%d samples of %d errors on %d threads, %d rescued", *errors.shape, threads, answers.rescued)
    run = Run(complete=complete, sampler=sampler, seed=seed, wall_time=time.perf_counter() - start)
    return robust_dataset(problem, errors, answers, run=run, more=responses, shares=shares).assign_attrs(chosen)


def _under_loads(scene: Scene, samples: int, progress: Callable[[int], None], **how: Any) -> xr.Dataset:
    """Dataset of a scene with several loads."""
    from gearbench.sweeps.run import sweep

    def advance(done: int, of: int) -> None:
        progress(done * samples // of)

    return sweep(scene, samples=samples, progress=advance, **how)
