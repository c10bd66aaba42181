"""Work–precision of error samples: how the means of a robust evaluation converge, by sampler."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import relative_errors, scales
from gearbench.cost.workprecision import Curve
from gearbench.robustness.montecarlo import RobustProblem, prepare_scene, respond
from gearbench.robustness.sampling import Sampler, unit_samples
from gearbench.robustness.statistics import average_error
from gearbench.scene import Scene
from gearbench.stopwatch import peak_megabytes, times

COUNTS = (16, 32, 64, 128, 256, 512, 1024)
SAMPLERS: tuple[tuple[Sampler, str], ...] = (("sobol", "¾ to 1"), ("latin_hypercube", "½"), ("random", "½"))
#: Samples of the reference, and its seed: none of those that are compared with it.
REFERENCE, REFERENCE_SEED = 2**14, 987_654


def sample_curves(scene: Scene, repeats: int, seeds: int, reference: int = REFERENCE) -> list[Curve]:
    """One curve a sampler, on one thread; errors are RMS values over ``seeds`` draws."""
    problem = prepare_scene(scene)
    responses, _ = respond(problem, draw(problem, "sobol", reference, REFERENCE_SEED))
    exact = responses.numbers.mean(axis=1)
    bar = np.array([average_error(values, "sobol") for values in responses.numbers]) / scales(exact)
    return [_curve(problem, sampler, order, exact, bar, repeats, seeds) for sampler, order in SAMPLERS]


def draw(problem: RobustProblem, sampler: Sampler, count: int, seed: int) -> NDArray:
    """Errors [µm], (sample, error)."""
    return problem.errors.draw(unit_samples(sampler, count, len(problem.names), seed), problem.scene.pair)


def _curve(
    problem: RobustProblem, sampler: Sampler, order: str, exact: NDArray, bar: NDArray, repeats: int, seeds: int
) -> Curve:
    errors, seconds, processor, memory = [], [], [], []
    for count in COUNTS:
        answers = [respond(problem, draw(problem, sampler, count, i))[0].numbers.mean(axis=1) for i in range(seeds)]
        errors.append(np.sqrt(np.mean([relative_errors(a, exact) ** 2 for a in answers], axis=0)))

        def work(count: int = count) -> None:
            respond(problem, draw(problem, sampler, count, 0))

        taken = times(work, max(3, repeats // 2))
        seconds.append(taken["seconds"])
        processor.append(taken["processor_seconds"])
        memory.append(peak_megabytes(work))
    return Curve(
        knob=f"samples, {sampler.replace('_', ' ')}",
        expected=order,
        labels=tuple(str(n) for n in COUNTS),
        sizes=np.array(COUNTS, dtype=float),
        errors=np.array(errors),
        bar=bar,
        seconds=np.array(seconds),
        processor_seconds=np.array(processor),
        megabytes=np.array(memory),
    )
