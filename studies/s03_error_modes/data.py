"""Data of the study: gap of every manufacturing error over the flank."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gearbench.effects.manufacturing_errors import ErrorKind, ManufacturingErrors
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.lazy import xr
from gearbench.library.garambois2017 import gear
from gearbench.scene import Scene

MEANING = {
    "profile_slope": "f_Hα: linear along the profile, zero in its middle",
    "profile_form": "f_fα: barrel, nothing in the middle of the profile",
    "helix_slope": "f_Hβ: linear over the face, zero in its middle",
    "helix_form": "f_fβ: crown, nothing in the middle of the face",
    "inclination": "f_Σδ: axes approach in their plane, × sin α_wt cos β_b",
    "deviation": "f_Σβ: axes lean across their plane, × cos α_wt cos β_b",
}


def scene(kind: str = "profile_slope") -> Scene:
    """Scene of gear 24 with one error of 1 µm on the pinion (or of the axes)."""
    error: dict[str, Any] = {kind: ErrorKind(amplitude=1.0, gear="pinion")}
    plain = gear("24").scene()
    return replace(plain, effects=(*plain.effects, ManufacturingErrors(**error)))


def flank(pair: Pair, points: int = 60) -> ContactLines:
    """Represent the whole rectangle of contact as contact lines: positions along u, segments along y."""
    u = np.linspace(pair.meshing.path_start, pair.meshing.path_end, points)
    y = np.linspace(0, pair.meshing.face_width, points)
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
    """Compute the gap of every error over radius and face width [µm]."""
    lines = flank(scene().pair, 12 if quick else 60)
    data = {}
    for kind in MEANING:
        errors = scene(kind).effect("manufacturing_errors")
        assert isinstance(errors, ManufacturingErrors)
        data[kind] = (("radius", "face_position"), 1e3 * errors.modes(lines)[:, 0, :, 0])
    return xr.Dataset(data, coords={"radius": lines.radii[0][:, 0, 0], "face_position": lines.y[0, 0]})
