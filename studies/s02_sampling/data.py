"""Data of the study: errors of means over error samples of five gears, by sampler, sample count and seed."""

from __future__ import annotations

from gearbench.effort.curves import as_dataset
from gearbench.effort.workprecision import sample_curves
from gearbench.lazy import xr
from gearbench.library.garambois2017 import gear
from gearbench.scene import Scene

GEARS, COUNTS, SEEDS = ("SC", "7", "19", "36", "55"), (64, 128, 256, 512, 1000), 20
#: Means m_k and m_ste → names of their responses.
QUANTITIES = {"m_k": "mesh_stiffness_rms", "m_ste": "transmission_error_rms"}


def scene(name: str = "SC") -> Scene:
    """Scene of a gear of the paper with its errors."""
    return gear(name).scene(errors=True)


def compute(*, quick: bool = False) -> xr.Dataset:
    """Compute the work–precision of every sampler on five gears, against means over 65 536 Sobol points.

    The quick size has one gear but all seeds: with few seeds, chance would decide which sampler is better.
    """
    gears, reference = GEARS[:1] if quick else GEARS, 2**13 if quick else 2**16
    curves = [sample_curves(scene(name), 1, SEEDS, reference, COUNTS) for name in gears]
    return xr.concat([as_dataset(each) for each in curves], "gear").assign_coords(gear=list(gears))
