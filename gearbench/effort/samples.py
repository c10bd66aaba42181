"""Work–precision of error samples: how the means of a robust evaluation converge, by sampler."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearbench.accuracy.measure import relative_errors, scales
from gearbench.effort.clock import measured
from gearbench.effort.curves import Point, WorkPrecision
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.robustness.sampling import Sampler
from gearbench.robustness.statistics import average_error
from gearbench.scene import Scene

COUNTS = (16, 32, 64, 128, 256, 512, 1024)
SAMPLERS: tuple[tuple[Sampler, str], ...] = (("sobol", "¾ to 1"), ("latin_hypercube", "½"), ("random", "½"))
#: Samples of the reference, and its seed: none of those that are compared with it.
REFERENCE, REFERENCE_SEED = 2**14, 987_654


def sample_curves(
    scene: Scene, repeats: int, seeds: int, reference: int = REFERENCE, counts: Sequence[int] = COUNTS
) -> list[WorkPrecision]:
    """One curve a sampler, on one thread; errors are RMS values over ``seeds`` draws. None without random errors."""
    if scene.effect("manufacturing_errors") is None:
        return []
    problem = prepare_scene(scene)
    responses, _ = respond(problem, problem.draw(reference, REFERENCE_SEED, "sobol"))
    exact = responses.numbers.mean(axis=1)
    bar = np.array([average_error(values, "sobol") for values in responses.numbers]) / scales(exact)

    def point(sampler: Sampler, count: int) -> Point:
        answers = [respond(problem, problem.draw(count, i, sampler))[0].numbers.mean(axis=1) for i in range(seeds)]
        errors = np.sqrt(np.mean([relative_errors(a, exact) ** 2 for a in answers], axis=0))
        cost = measured(lambda: respond(problem, problem.draw(count, 0, sampler)), max(3, repeats // 2))
        return Point(label=str(count), size=count, errors=errors, cost=cost)

    return [
        WorkPrecision(
            knob=f"samples, {sampler.replace('_', ' ')}",
            expected=order,
            points=tuple(point(sampler, count) for count in counts),
            bar=bar,
        )
        for sampler, order in SAMPLERS
    ]
