"""Predicted cost of a run over many error samples: one chunk of them at a few phases, extrapolated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearbench.effort.trials import LONGEST, Reduced, Trial, Trials, spent
from gearbench.robustness.montecarlo import SAMPLES, RobustProblem, prepare_phases, respond
from gearbench.threads import default_threads


def robust_part(
    both: Trials, small: Reduced, total: int, samples: int = SAMPLES, threads: int | None = None
) -> tuple[str, str, float] | None:
    """Name, size and time [s] of the batch of error samples at ``total`` phases; None without errors.

    The time of each sample grows with the number of segments; set-ups of the pair are not part of it.
    """
    from gearbench.contact._lane_kernels import LANES
    from gearbench.robustness.dataset import robust_dataset

    scene = both.long.scene
    if scene.effect("manufacturing_errors") is None:
        return None

    def prepared(trial: Trial) -> RobustProblem:
        return prepare_phases(scene, trial.lines.mesh_phase, trial.weight)

    both = replace(both, total=total)
    problem, few = spent(lambda: prepared(both.short))
    errors = problem.draw(samples, 0, "random")
    respond(problem, errors[:LANES])  # compiled code is loaded
    (responses, _), short = spent(lambda: respond(problem, errors[:LANES]))
    seconds, chunk = few * total / len(both.short.weight), short * total / len(both.short.weight)
    if short * len(both.long.weight) <= LONGEST * len(both.short.weight):
        problem, many = spent(lambda: prepared(both.long))
        seconds = both.at_all(few, many)
        chunk = both.at_all(short, spent(lambda: respond(problem, errors[:LANES]))[1])
    threads = threads or default_threads()
    seconds += -(-samples // (LANES * threads)) * chunk
    seconds *= small.segments * small.pairs
    all_of_them = replace(responses, values={n: np.resize(v, samples) for n, v in responses.values.items()})
    settings = {"complete": True, "sampler": "sobol", "seed": 0, "wall_time": 0.0}
    seconds += spent(lambda: robust_dataset(problem, errors, all_of_them, **settings))[1]
    batch = problem.batch
    path = "structured" if batch.reference is None else "conjugate gradients"
    size = f"{path}: rank {batch.rank} a block, {batch.modes.shape[1]} errors, {threads} threads"
    return f"robust ({samples} samples)", size, seconds
