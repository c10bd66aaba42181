"""Means over the error samples of five gears, by sampler, number of samples and seed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearbench.library.garambois2017 import gear
from gearbench.robustness.montecarlo import RobustProblem, default_threads, prepare_scene, respond
from gearbench.robustness.sampling import Sampler
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

GEARS = ("SC", "7", "19", "36", "55")
COUNTS: dict[Sampler, tuple[int, ...]] = {"sobol": (64, 128, 256, 512, 1024), "random": (64, 128, 256, 512, 1000)}
QUANTITIES = ("m_k", "m_ste")


def scene(name: str = "SC") -> Scene:
    """A gear of the paper with its errors."""
    return gear(name).scene(errors=True)


def means(problem: RobustProblem, sampler: Sampler, count: int, seed: int) -> tuple[float, float]:
    """m_k [%] and m_ste [µm] of a prepared scene."""
    answer, _ = respond(problem, problem.draw(count, seed, sampler), default_threads())
    return float(answer.mesh_stiffness_rms.mean()), float(answer.transmission_error_rms.mean())


def compute(*, quick: bool = False) -> xr.Dataset:
    """Means of five gears for every sampler, count and seed, and reference means from 65 536 Sobol points.

    The quick size is one gear with as many seeds: with a few, chance decides which sampler is the better one.
    """
    import xarray as xr

    gears, seeds = GEARS[:1] if quick else GEARS, range(20)
    problems = [prepare_scene(scene(name)) for name in gears]
    reference = [means(p, "sobol", 2**13 if quick else 2**16, 987_654) for p in problems]
    data: dict[str, tuple] = {"reference": (("gear", "quantity"), np.array(reference))}
    for sampler in COUNTS:
        counts = COUNTS[sampler]
        values = [[[means(p, sampler, n, seed) for seed in seeds] for n in counts] for p in problems]
        data[sampler] = (("gear", f"{sampler}_count", "seed", "quantity"), np.array(values))
    coords = {f"{sampler}_count": list(counts) for sampler, counts in COUNTS.items()}
    return xr.Dataset(data, coords={**coords, "gear": list(gears), "quantity": list(QUANTITIES), "seed": list(seeds)})
