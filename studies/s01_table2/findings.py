"""Agreement of conventions of manufacturing errors with Table 2."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studies.s01_table2.data import COLUMNS

if TYPE_CHECKING:
    import xarray as xr

LIMITS = {"m_k": 0.10, "m_ste": 0.15, "sigma_k": 0.30, "max_k": 0.30, "sigma_ste": 0.30, "max_ste": 0.30}


def log_rms(ours: NDArray, theirs: NDArray) -> NDArray:
    """Log-RMS deviation of each column, over the gears."""
    return np.sqrt(np.mean(np.log(ours / theirs) ** 2, axis=-2))


def spearman(ours: NDArray, theirs: NDArray) -> tuple[float, float]:
    """Rank correlation of m_k and of m_ste."""
    from scipy.stats import spearmanr

    k, ste = (float(spearmanr(ours[:, i], theirs[:, i])[0]) for i in (0, 1))  # type: ignore[arg-type]
    return k, ste


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Checks of the adopted convention."""
    ours, theirs = dataset["ours"].values, dataset["paper"].values
    deviations = zip(COLUMNS, log_rms(ours, theirs), strict=True)
    found = [(f"{c}: log-RMS deviation {d:.3f} ≤ {LIMITS[c]:.2f}", bool(d <= LIMITS[c])) for c, d in deviations]
    for name, rho in zip(("m_k", "m_ste"), spearman(ours, theirs), strict=True):
        found.append((f"{name}: Spearman rank correlation {rho:.3f} ≥ 0.9", rho >= 0.9))
    return found
