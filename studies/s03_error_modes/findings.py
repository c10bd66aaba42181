"""Findings: bounds of the shapes of manufacturing errors, and their maps over the flank."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearbench.lazy import xr
from gearbench.plotting import new_figure, write_figure
from studies.s03_error_modes.data import MEANING


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check that no shape leaves the range of its amplitude."""
    checks = []
    for kind, v in dataset.data_vars.items():
        low, high = _range(str(kind))
        inside = bool((v >= low - 1e-12).all() and (v <= high + 1e-12).all())
        checks.append((f"{kind}: gap between {low:g} and {high:g} µm for an error of 1 µm", inside))
    return checks


def _range(kind: str) -> tuple[float, float]:
    """Least and greatest gap [µm] for an error of 1 µm: slopes are zero in the middle."""
    return (-0.5, 0.5) if kind.endswith("slope") else (0.0, 1.0)


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Draw one figure per error."""
    for kind, meaning in MEANING.items():
        figure, ((axis,),) = new_figure(1, 1, (5.2, 3.6))
        y, radius = dataset["face_position"], dataset["radius"]
        filled = axis.contourf(y, radius, dataset[kind], levels=np.linspace(*_range(kind), 11), cmap="cividis")
        figure.colorbar(filled, ax=axis, label="gap for an error of 1 µm [µm]")
        axis.set(xlabel="position along the face width y [mm]", ylabel="radius on the pinion R [mm]")
        axis.set_title(f"{kind.replace('_', ' ')}\n{meaning}", fontsize=9)
        write_figure(figure, folder / f"{kind}.png")
