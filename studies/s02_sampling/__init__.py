"""Number of samples for a robust evaluation: scrambled Sobol points against pseudo-random ones, over 20 seeds."""

from studies.s02_sampling.data import compute, scene
from studies.s02_sampling.findings import checks, figures

QUESTION = "Are 256 Sobol points at least as accurate as 1000 pseudo-random samples?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
