"""Points of the unit cube that random errors are drawn from: the same whatever computes them, and in what order."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Sampler = Literal["sobol", "random", "latin_hypercube"]


def unit_samples(sampler: Sampler, count: int, dimension: int, seed: int) -> NDArray:
    """Points in (0, 1)^dimension, (count, dimension).

    "sobol": scrambled Sobol sequence (Owen), the default; "random": pseudo-random; both give sample i whatever
    ``count`` is. "latin_hypercube" depends on ``count`` by nature.
    """
    if dimension == 0 or count == 0:
        return np.empty((count, dimension))
    if sampler == "random":
        points = np.random.default_rng(seed).random((count, dimension))
    elif sampler == "sobol":
        from scipy.stats import qmc

        # whole powers of two keep the balance of the sequence; its beginning does not depend on how much is drawn
        points = qmc.Sobol(dimension, scramble=True, rng=seed).random_base2(max(0, math.ceil(math.log2(count))))[:count]
    else:
        from scipy.stats import qmc

        points = qmc.LatinHypercube(dimension, rng=seed).random(count)
    tiny = 2.0**-54
    return np.clip(points, tiny, 1 - 2.0**-53)
