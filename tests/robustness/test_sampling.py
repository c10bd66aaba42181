import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.stats import qmc

from gearbench.errors import InputError
from gearbench.robustness.sampling import SOBOL_BITS, Sampler, unit_samples

SAMPLERS: tuple[Sampler, ...] = ("sobol", "random", "latin_hypercube")


@pytest.mark.parametrize("sampler", SAMPLERS)
@pytest.mark.parametrize("count", [1, 2, 3, 257, 1000])
@pytest.mark.parametrize("dimension", [1, 12, 40])
def test_rows_are_the_same_however_they_are_split(sampler, count, dimension):
    whole = unit_samples(sampler, count, dimension, 3)
    assert whole.shape == (count, dimension)
    for size in (1, 7, 128) if count < 500 else (64, 333):
        starts = range(0, count, size)
        parts = [unit_samples(sampler, count, dimension, 3, start=i, stop=min(i + size, count)) for i in starts]
        assert_array_equal(np.concatenate(parts), whole)


@pytest.mark.parametrize("sampler", ["sobol", "random"])
def test_a_longer_run_begins_with_the_shorter_one(sampler):
    assert_array_equal(unit_samples(sampler, 2000, 12, 7)[:1000], unit_samples(sampler, 1000, 12, 7))
    assert_array_equal(unit_samples(sampler, 257, 3, 7)[:1], unit_samples(sampler, 1, 3, 7))


@pytest.mark.parametrize("sampler", SAMPLERS)
def test_the_seed_decides(sampler):
    one, again, other = (unit_samples(sampler, 16, 3, seed) for seed in (1, 1, 2))
    assert_array_equal(one, again)
    assert not np.isin(one, other).any()


def test_even_zeros_of_the_generators_are_moved_inside(monkeypatch):
    """The Sobol grid has 0 as a point; scrambling reaches it for some seed."""
    monkeypatch.setattr(qmc.Sobol, "random", lambda self, n: np.zeros((n, self.d)))
    assert_array_equal(unit_samples("sobol", 4, 2, 0), 2.0 ** -(SOBOL_BITS + 1))
    monkeypatch.setattr(qmc.LatinHypercube, "random", lambda self, n: np.ones((n, self.d)))
    assert unit_samples("latin_hypercube", 4, 2, 0).max() < 1


def test_sobol_powers_of_two_and_latin_hypercubes_hit_every_slice_once():
    n = 256
    cases: tuple[tuple[Sampler, int], ...] = (("sobol", n), ("latin_hypercube", n), ("latin_hypercube", 257))
    for sampler, count in cases:
        points = unit_samples(sampler, count, 15, 5)
        assert_array_equal(np.sort(np.floor(count * points), axis=0), np.arange(count)[:, None].repeat(15, axis=1))


def test_sobol_has_the_lowest_discrepancy():
    """Centred L2 discrepancy, 5 variables, 256 points, mean over 10 seeds."""
    mean = {s: np.mean([qmc.discrepancy(unit_samples(s, 256, 5, seed)) for seed in range(10)]) for s in SAMPLERS}
    # pseudo-random: (5/4)^d − (13/12)^d over n, see Hickernell 1998; within 20 % over 10 seeds
    assert mean["random"] == pytest.approx(((5 / 4) ** 5 - (13 / 12) ** 5) / 256, rel=0.2)
    assert mean["sobol"] < 0.2 * mean["random"]
    assert mean["sobol"] < mean["latin_hypercube"] < mean["random"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sampler": "halton"}, "sobol, random, latin_hypercube"),
        ({"count": -1}, "samples = -1"),
        ({"seed": -1}, "seed = -1"),
        ({"start": 5, "stop": 11}, "within 0 to 10"),
        ({"start": 5, "stop": 4}, "within 0 to 10"),
        ({"count": 2**30 + 1, "stop": 1}, "at most"),
    ],
)
def test_bad_input(change, message):
    with pytest.raises(InputError, match=message):
        unit_samples(**{"sampler": "sobol", "count": 10, "dimension": 2, "seed": 0, **change})
