"""Curves of the transmission error, one panel a case."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.plotting import BLUE, GREEN, ORANGE, new_figure, write_figure

if TYPE_CHECKING:
    import xarray as xr


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Transmission error over the mesh phase, and the share of the load outside the path of contact."""
    count = dataset.sizes["design"]
    figure, axes = new_figure(2, count, (3.2 * count + 1, 5.5), sharex=True)
    phase = dataset.mesh_phase.values
    for row in range(count):
        here, (upper, lower) = dataset.isel(design=row), axes[:, row]
        upper.plot(phase, here.line_transmission_error, "-", color=ORANGE, label="contact on the line")
        upper.plot(phase, here.off_line_transmission_error, "--", color=GREEN, label="contact off the line")
        upper.plot(phase, here.transmission_error, "o-", ms=3, color=BLUE, label="contact finite elements")
        lower.bar(phase, 1e2 * here.share_outside_path, width=0.8 / len(phase), color=BLUE)
        upper.set_title(f"{here.case.values!s}, {float(here.torque):g} N·m", fontsize=9)
        lower.set_xlabel("mesh phase")
    axes[0, 0].set_ylabel("transmission error [µm]")
    axes[1, 0].set_ylabel("load outside the path [%]")
    axes[0, 0].legend(frameon=False, fontsize=8)
    most = 1e2 * float(np.max(dataset.share_outside_path))
    figure.suptitle(f"Teeth touch outside the path of contact too, with up to {most:.0f} % of the load", fontsize=10)
    write_figure(figure, folder / "curves.png")
