"""Error of the means against the number of samples."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.plotting import BLUE, ORANGE, new_figure, write_figure
from studies.s02_sampling.data import QUANTITIES
from studies.s02_sampling.findings import overall, relative_error

if TYPE_CHECKING:
    import xarray as xr


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Error of the means against the number of samples."""
    figure, axes = new_figure(1, 2, (10, 4.5), sharey=True)
    styles = {"sobol": (BLUE, "o", "scrambled Sobol"), "random": (ORANGE, "s", "pseudo-random")}
    for axis, quantity in zip(axes[0], QUANTITIES, strict=True):
        for sampler, (colour, marker, label) in styles.items():
            error = 100 * relative_error(dataset, sampler).sel(quantity=quantity)
            counts = dataset[f"{sampler}_count"]
            axis.loglog(counts, error.T, marker, color=colour, alpha=0.35, ms=4)
            axis.loglog(counts, np.sqrt((error**2).mean("gear")), f"-{marker}", color=colour, label=label)
        axis.set_xlabel("samples [–]")
        axis.set_title(f"{quantity.replace('_', ' ')}")
        axis.set_xticks([64, 128, 256, 512, 1000], ["64", "128", "256", "512", "1000"])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("RMS error of the mean over the seeds [%]")
    axes[0, 0].legend(frameon=False)
    sobol, random = overall(dataset)
    gain = random / sobol
    figure.suptitle(
        "256 Sobol points against 1000 pseudo-random samples: errors smaller by a factor of "
        f"{float(gain.sel(quantity='m_k')):.1f} (m k) and {float(gain.sel(quantity='m_ste')):.1f} (m ste)"
    )
    write_figure(figure, folder / "sampling.png")
