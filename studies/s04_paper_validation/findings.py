"""Errors of the models, and the claims of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearbench.validation.dataset import of_scene
from studies.s04_paper_validation.data import ERRORS, FINE, PAPER, SOLID

if TYPE_CHECKING:
    import xarray as xr

#: What the paper claims: relative error [%] of mean and peak-to-peak of STE and stiffness, in odd cases; MAC; time [s].
CLAIM, ODD_CASES, CLAIMED_MAC = 10.0, 25.0, 0.95
CLAIMED_FAST, CLAIMED_FE, CLAIMED_GAIN = 1.0, 1000.0, 1000.0


def of_model(dataset: xr.Dataset, number: str, name: str) -> xr.Dataset:
    """The comparison of one model on one case."""
    hit = (dataset["case"].values == number) & (dataset["tooth"].values == name)
    return of_scene(dataset, int(np.flatnonzero(hit)[0]))


def cases_of(dataset: xr.Dataset) -> list[str]:
    """Names of the pairs, in the order they were computed."""
    return list(dict.fromkeys(dataset["case"].values.tolist()))


def names_of(dataset: xr.Dataset) -> list[str]:
    """Names of the models, in the order they were computed."""
    return list(dict.fromkeys(dataset["tooth"].values.tolist()))


def errors(one: xr.Dataset) -> np.ndarray:
    """Relative errors of ``ERRORS`` [%]."""
    return np.array([float(one[name]) for name in ERRORS.values()])


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Checks of the fast models; the report compares the paper's own claims."""
    found = []
    for number in cases_of(dataset):
        plate, solid, fine = (of_model(dataset, number, name) for name in (PAPER, SOLID, FINE))
        for label, worst in (
            (f"{FINE}, means and peak-to-peaks", np.abs(errors(fine)).max()),
            (f"{SOLID}, means", np.abs(errors(solid)[::2]).max()),
        ):
            found.append((f"case {number}: {label} within {worst:.1f} % of finite elements", bool(worst < CLAIM)))
        mac = float(solid["line_mac_mean"].min())
        found.append((f"case {number}: {SOLID}, MAC {mac:.3f} under contact lines", mac >= CLAIMED_MAC))
        seconds = float(plate["compliance_seconds"][0])
        found.append((f"case {number}: {PAPER}, compliance in {1e3 * seconds:.1f} ms", seconds < CLAIMED_FAST))
        nearer = float(np.abs(errors(solid)).max() / np.abs(errors(plate)).max())
        found.append((f"case {number}: worst error of {SOLID} {nearer:.2f} of that of {PAPER}", nearer < 1))
    return found
