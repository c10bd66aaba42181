"""What each manufacturing error looks like on the flank: its shape, where it is zero, and its sign."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.effects.manufacturing_errors import ErrorKind, ManufacturingErrors
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.library.garambois2017 import gear

if TYPE_CHECKING:
    import xarray as xr

QUESTION = "What does each manufacturing error look like on the flank?"

MEANING = {
    "profile_slope": "f_Hα: linear along the profile, all at the tip",
    "profile_form": "f_fα: barrel, nothing in the middle of the profile",
    "helix_slope": "f_Hβ: linear over the face, all at y = b",
    "helix_form": "f_fβ: crown, nothing in the middle of the face",
    "inclination": "f_Σδ: axes approach in their plane, × sin α_wt cos β_b",
    "deviation": "f_Σβ: axes lean across their plane, × cos α_wt cos β_b",
}


def flank(pair: Pair, points: int = 60) -> ContactLines:
    """The whole rectangle of contact as if it were contact lines: positions along u, segments along y."""
    u = np.linspace(pair.path_start, pair.path_end, points)
    y = np.linspace(0, pair.face_width, points)
    grid_u, grid_y = np.meshgrid(u, y, indexing="ij")
    return ContactLines(
        pair=pair,
        mesh_phase=np.zeros(points),
        index=np.zeros(1, dtype=int),
        u=grid_u[:, None, :],
        y=grid_y[:, None, :],
        length=np.ones((points, 1)),
    )


def compute(*, quick: bool = False) -> xr.Dataset:
    """Gap of 1 µm of each error on the pinion of gear 24 (and of the axes), over the radius and the face width."""
    import xarray as xr

    pair = gear("24").scene().pair
    lines = flank(pair, 12 if quick else 60)
    data = {}
    for kind in MEANING:
        errors = ManufacturingErrors(**{kind: ErrorKind(amplitude=1.0, gear="pinion")})
        data[kind] = (("radius", "face_position"), 1e3 * errors.modes(lines)[:, 0, :, 0])
    return xr.Dataset(data, coords={"radius": lines.radii[0][:, 0, 0], "face_position": lines.y[0, 0]})


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """No shape exceeds its amplitude or goes below zero."""
    return [
        (f"{kind}: gap between 0 and 1 µm for an error of 1 µm", bool((v >= -1e-12).all() and (v <= 1 + 1e-12).all()))
        for kind, v in dataset.data_vars.items()
    ]


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """One figure for each error."""
    import matplotlib.pyplot as plt

    for kind, meaning in MEANING.items():
        figure, axis = plt.subplots(figsize=(5.2, 3.6), layout="constrained")
        y, radius = dataset["face_position"], dataset["radius"]
        filled = axis.contourf(y, radius, dataset[kind], levels=np.linspace(0, 1, 11), cmap="cividis")
        figure.colorbar(filled, ax=axis, label="gap for an error of 1 µm [µm]")
        axis.set(xlabel="place along the face width y [mm]", ylabel="radius on the pinion R [mm]")
        axis.set_title(f"{kind.replace('_', ' ')}\n{meaning}", fontsize=9)
        figure.savefig(folder / f"{kind}.png", dpi=110)
        plt.close(figure)
