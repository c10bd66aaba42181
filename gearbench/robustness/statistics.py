"""Mean, standard deviation and maximum over error samples, with their standard errors.

A standard error is the standard deviation of the statistic over repeated draws of the same number of samples with other
seeds.

Mean and standard deviation are, to first order, averages: of the values x, and of the influence
ψ = ((x − m)² − s²)/2s. For pseudo-random samples the error of an average is the scatter over √n; for ψ this is the
classical s/2 √((kurtosis − 1)/n). Points of a Sobol sequence are not independent and have smaller errors. A single draw
shows how small: consecutive blocks of 2^k points are nets themselves, so the means of 8 to 15 blocks scatter like those
of small scrambled nets. The blocks are averaged as if they were independent. This overestimates the error, because they
also fill each other's gaps. A Latin hypercube has no such blocks; its error is taken as that of pseudo-random samples,
which is an upper bound up to a factor n/(n−1) (Owen 1997).

The maximum depends only on the tail, where no sampler is better than another in many dimensions. (Resampling fails: the
largest value reappears in 63 % of all bootstrap samples.) A generalised Pareto law is fitted to the largest values by
probability-weighted moments (Hosking & Wallis 1987); the scatter of the maximum follows in closed form.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearbench.robustness.sampling import Sampler

#: Minimum number of samples for a standard error; with fewer it is NaN.
FEWEST = 8


def summarise(values: NDArray, sampler: Sampler = "random") -> dict[str, tuple[float, float]]:
    """Return "mean", "std" (n − 1) and "max" of the samples, each with its standard error.

    Parameters
    ----------
    values
        One value for each sample, (sample,), in the order drawn; samples of a Sobol sequence from its first point on.
    sampler
        Sampler that drew the samples.

    Returns
    -------
    (value, standard error) by name, in the unit of the values. The standard deviation of a single sample, and standard
    errors of fewer than 8 samples, are NaN.
    """
    x = np.asarray(values, dtype=float)
    if x.ndim != 1 or x.size == 0:
        raise ValueError(f"values must be one row of at least one sample, not of shape {x.shape}")
    m, s = float(x.mean()), float(x.std(ddof=1)) if x.size > 1 else math.nan
    influence = ((x - m) ** 2 - s**2) / (2 * s) if s > 0 else np.zeros_like(x)
    return {
        "mean": (m, average_error(x, sampler)),
        "std": (s, average_error(influence, sampler)),
        "max": (float(x.max()), maximum_error(x)),
    }


def average_error(values: NDArray, sampler: Sampler = "random") -> float:
    """Standard error of the average of the samples, see the module; NaN for fewer than 8 samples."""
    n = values.size
    if n < FEWEST:
        return math.nan
    size = 2 ** max(0, int(math.log2(n / 8))) if sampler == "sobol" else 1
    blocks = values[: n // size * size].reshape(-1, size).mean(axis=1)
    return float(blocks.std(ddof=1) * math.sqrt(size / n))


def maximum_error(values: NDArray) -> float:
    """Standard error of the largest of independent samples, see the module; NaN for fewer than 8 samples.

    The excesses y over a threshold u that k samples exceed follow a generalised Pareto law of scale σ and shape γ. The
    largest sample is then u + σ/γ ((k/E)^γ − 1), where E is exponentially distributed. Its variance is
    (σ k^γ/γ)² [Γ(1−2γ) − Γ(1−γ)²].
    """
    n = values.size
    if n < FEWEST:
        return math.nan
    k = min(n // 2, math.ceil(2 * math.sqrt(n)))
    top = np.sort(values)[-k - 1 :]
    y = top[1:] - top[0]
    b_0, b_1 = y.mean(), ((np.arange(k)[::-1] + 0.35) / k) @ y / k  # E y, E y (1 − F(y))
    if b_1 <= 0:
        return 0.0
    # γ = −1 belongs to a density that ends abruptly; from γ = ½ on the variance does not exist
    γ = float(np.clip(2 - b_0 / (b_0 - 2 * b_1), -1.0, 0.4)) if b_0 > 2 * b_1 else -1.0
    σ = b_0 * (1 - γ)
    if abs(γ) < 1e-4:
        return float(σ * math.pi / math.sqrt(6))
    return float(σ * k**γ / abs(γ) * math.sqrt(math.gamma(1 - 2 * γ) - math.gamma(1 - γ) ** 2))
