"""Choice of resolution and number of samples of a robustness run, for the accuracy that the scene asks for."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.choose import Choice, choose
from gearbench.accuracy.measure import scales
from gearbench.errors import InputError
from gearbench.robustness.montecarlo import Responses, join, prepare_scene, respond
from gearbench.robustness.sampling import Sampler
from gearbench.robustness.statistics import average_error
from gearbench.scene import Scene

#: Share of the allowed error that the resolution may use; the samples get the rest, as they converge more slowly.
RESOLUTION_SHARE = 0.4
#: Estimated error of a run over its difference from a coarser run. It is above 1 because the contact of a sample may
#: change inside a panel.
ERROR_OVER_CHANGE = 1.5
#: Number of samples for the choice of the resolution; all runs use the same samples, so that their scatter cancels.
TRIAL_SAMPLES = 128
#: Minimum and maximum number of samples, and number of standard errors that count as the error of a mean.
FEWEST_SAMPLES, MOST_SAMPLES, STANDARD_ERRORS = 64, 2**20, 3.0


def choose_robust(scene: Scene, *, seed: int, sampler: Sampler, threads: int) -> tuple[Choice[NDArray], int]:
    """Settings whose estimated error is within the accuracy that ``scene`` asks for, and the number of samples.

    A sample has four responses: mean and RMS of STE and of stiffness. The error is the largest relative error of their
    means over the samples, under any load.

    Raises
    ------
    InputError
        If no settings meet the accuracy.
    """
    trial = choose(
        scene, partial(_means, seed=seed, sampler=sampler), share=RESOLUTION_SHARE, error_over_change=ERROR_OVER_CHANGE
    )
    budget = trial.requested - trial.estimated
    problems, count = [prepare_scene(each) for each in trial.scene.each_load], FEWEST_SAMPLES
    parts: list[list[Responses]] = [[] for _ in problems]
    while True:
        # the first half of the samples is known already, unless the sampler draws all of them anew
        start = 0 if sampler == "latin_hypercube" or not parts[0] else count // 2
        for problem, computed in zip(problems, parts, strict=True):
            drawn = problem.draw(count, seed, sampler, start)
            computed[:] = [*(computed if start else []), respond(problem, drawn, threads)[0]]
        errors = STANDARD_ERRORS * np.max([_standard_errors(computed, sampler) for computed in parts], axis=0)
        if (error := float(errors.max())) <= budget:
            break
        count *= 2
        if count > MOST_SAMPLES:
            raise InputError(
                "accuracy", trial.requested, f"{MOST_SAMPLES} samples leave an error of {100 * error:.2g} %"
            )
    settings = {**trial.settings, "samples": str(count)}
    return replace(trial, settings=settings, errors=trial.errors + errors), count


def _means(scene: Scene, *, seed: int, sampler: Sampler) -> NDArray:
    """Means over ``TRIAL_SAMPLES`` samples under each load, (load, 4)."""
    problems = [prepare_scene(each) for each in scene.each_load]
    drawn = [respond(problem, problem.draw(TRIAL_SAMPLES, seed, sampler))[0] for problem in problems]
    return np.array([answers.numbers.mean(axis=1) for answers in drawn])


def _standard_errors(parts: list[Responses], sampler: Sampler) -> NDArray:
    """Relative standard errors of the means over all samples, (4,)."""
    numbers = join(parts).numbers
    errors = np.array([average_error(values, sampler) for values in numbers])
    return errors / scales(numbers.mean(axis=1))
