"""Errors of means over the error samples of five gears, by sampler and number of samples, over 20 seeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearbench.effort.curves import as_dataset
from gearbench.effort.workprecision import sample_curves
from gearbench.library.garambois2017 import gear
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

GEARS, COUNTS, SEEDS = ("SC", "7", "19", "36", "55"), (64, 128, 256, 512, 1000), 20
#: Names of the means m_k and m_ste among the numbers whose error is measured.
QUANTITIES = {"m_k": "mesh_stiffness_rms", "m_ste": "transmission_error_rms"}


def scene(name: str = "SC") -> Scene:
    """A gear of the paper with its errors."""
    return gear(name).scene(errors=True)


def compute(*, quick: bool = False) -> xr.Dataset:
    """Work–precision of every sampler on five gears, against means over 65 536 Sobol points.

    The quick size is one gear with as many seeds: with a few, chance decides which sampler is the better one.
    """
    import xarray as xr

    gears, reference = GEARS[:1] if quick else GEARS, 2**13 if quick else 2**16
    curves = [sample_curves(scene(name), 1, SEEDS, reference, COUNTS) for name in gears]
    return xr.concat([as_dataset(each) for each in curves], "gear").assign_coords(gear=list(gears))
