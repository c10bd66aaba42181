import math

import numpy as np
import pytest
from scipy.special import ndtri

from gearbench.robustness.sampling import unit_samples
from gearbench.robustness.statistics import maximum_error, summarise

MIX = np.random.default_rng(0).normal(size=(12, 8))


def _rms_of_errors(u):
    """RMS over 8 phases of an affine response to 12 errors: what the transmission error answers."""
    return np.sqrt(np.mean((0.3 * u @ MIX - 0.5) ** 2, axis=1))


RESPONSES = {
    "rms": _rms_of_errors,
    "uniform": lambda u: u[:, 0],
    "normal": lambda u: ndtri(u[:, 0]),
    "sum": lambda u: u.sum(axis=1),
}


def test_values_by_hand():
    """1, 2, 3, 6: mean 3, variance (4+1+0+9)/3, max 6."""
    got = summarise(np.array([1.0, 2.0, 3.0, 6.0]))
    assert (got["mean"][0], got["max"][0]) == (3.0, 6.0)
    assert got["std"][0] == pytest.approx(math.sqrt(14 / 3), rel=1e-15)
    assert all(math.isnan(error) for _, error in got.values())  # too few


def test_classical_errors_of_pseudo_random_samples():
    x = np.random.default_rng(3).exponential(size=500)
    got = summarise(x, "random")
    n, s = x.size, x.std(ddof=1)
    kurtosis = np.mean((x - x.mean()) ** 4) / np.var(x) ** 2
    assert got["mean"][1] == pytest.approx(s / math.sqrt(n), rel=1e-12)
    # s/2 √((kurtosis − 1)/n) up to n against n − 1
    assert got["std"][1] == pytest.approx(s / 2 * math.sqrt((kurtosis - 1) / n), rel=2 / n)


@pytest.mark.parametrize("name", RESPONSES)
@pytest.mark.parametrize("sampler", ["random", "sobol", "latin_hypercube"])
def test_standard_errors_against_repeated_draws(name, sampler):
    """Root mean square of 200 standard errors over the scatter of the 200 statistics, which is known to 5 %."""
    runs = [summarise(RESPONSES[name](unit_samples(sampler, 256, 12, seed)), sampler) for seed in range(200)]
    for statistic in ("mean", "std", "max"):
        value, error = np.array([run[statistic] for run in runs]).T
        ratio = math.sqrt(np.mean(error**2)) / value.std()
        if (
            statistic == "max"
        ):  # depends on a tail fitted to 32 values: factor 2; bounded ones are stratified to factor 4
            assert 0.8 < ratio < (2.2 if sampler == "random" else 4.5)
        elif sampler == "random":
            assert 0.85 < ratio < 1.15
        else:  # on the safe side
            assert ratio > 0.85


def test_maximum_error_of_known_tails():
    """Medians over 100 draws of 1000: uniform 1/n, exponential π/√6; γ known to 1/√64 makes 30 %."""
    rng = np.random.default_rng(5)
    uniform, exponential = rng.random((100, 1000)), rng.exponential(size=(100, 1000))
    assert np.median([maximum_error(x) for x in uniform]) == pytest.approx(1e-3, rel=0.5)
    assert np.median([maximum_error(x) for x in exponential]) == pytest.approx(math.pi / math.sqrt(6), rel=0.3)


@pytest.mark.parametrize("sampler", ["random", "sobol", "latin_hypercube"])
@pytest.mark.parametrize("count", [1, 2, 7, 8, 9, 16, 31, 257])
def test_any_count(sampler, count):
    x = unit_samples(sampler, count, 1, 0)[:, 0]
    got = summarise(x, sampler)
    assert math.isnan(got["std"][0]) == (count == 1)
    assert all(math.isnan(error) == (count < 8) for _, error in got.values())
    same = summarise(np.full(count, 2.0), sampler)
    if count >= 8:
        assert same == {"mean": (2.0, 0.0), "std": (0.0, 0.0), "max": (2.0, 0.0)}


def test_no_samples():
    with pytest.raises(ValueError, match="at least one sample"):
        summarise(np.empty(0))
