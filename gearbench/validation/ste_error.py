"""Errors of STE, mesh stiffness and load sharing against a reference with the same mesh phases."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.lazy import xr
from gearbench.results.cycle import fourier

#: Curves that are compared, and number of their harmonics.
CURVES = ("transmission_error", "mesh_stiffness")
HARMONICS = 5
#: Outputs computed with both models.
OUTPUTS = (*CURVES, "load_share", *(f"{name}_{part}" for name in CURVES for part in ("mean", "peak_to_peak")))


def relative_error(value: ArrayLike, reference: ArrayLike, scale: ArrayLike | None = None) -> NDArray:
    """(value − reference) / scale [%]; the default scale is the reference; NaN where the scale is zero."""
    value, reference = np.asarray(value, dtype=float), np.asarray(reference, dtype=float)
    scale = reference if scale is None else np.asarray(scale, dtype=float)
    return 100 * np.divide(value - reference, scale, out=np.full(value.shape, np.nan), where=scale != 0)


def shared_load(dataset: xr.Dataset) -> str:
    """Variable of load sharing: between the meshes of a set, or between the tooth pairs of a mesh."""
    return "load_sharing" if "load_sharing" in dataset else "load_share"


def cycle_errors(fast: xr.Dataset, reference: xr.Dataset) -> dict[str, tuple]:
    """Variables of a comparison: the numbers of both models, and their relative errors [%].

    Errors of harmonics are differences of amplitudes relative to the fundamental of the reference. Errors of load
    sharing are the largest and the RMS difference of the share of a tooth pair while it is in contact [–]; of a set,
    those of the ``load_sharing`` of a mesh, and the error of K_γ.
    """
    sides = (fast, reference)
    variables: dict[str, tuple] = {}
    for name in CURVES:
        for part in ("mean", "peak_to_peak"):
            a, b = (float(side[f"{name}_{part}"]) for side in sides)
            variables[f"{name}_{part}"] = (("model",), np.array([a, b]))
            variables[f"{name}_{part}_error"] = ((), relative_error(a, b))
        a, b = (fourier(side, name, HARMONICS) for side in sides)
        variables[f"{name}_amplitude"] = (("model", "harmonic"), np.array([a, b]))
        variables[f"{name}_amplitude_error"] = (("harmonic",), relative_error(a, b, np.full(HARMONICS, b[0])))
    if "load_sharing" in fast:
        a, b = (float(side["mesh_load_factor"]) for side in sides)
        variables |= {
            "mesh_load_factor": (("model",), np.array([a, b])),
            "mesh_load_factor_error": ((), relative_error(a, b)),
        }
    fast_share, exact = (side[shared_load(side)].values for side in sides)
    largest, rms = load_share_error(fast_share, exact, fast["phase_weight"].values)
    return variables | {"load_share_error_max": ((), largest), "load_share_error_rms": ((), rms)}


def error_bars(judged: Mapping[str, tuple], again: Mapping[str, tuple]) -> dict[str, tuple]:
    """Error bars of a comparison: the change of every error if the finest level replaces the extrapolated reference.

    ``judged`` holds the errors against the reference, ``again`` those against its finest level. The bar of a name is
    called ``…_bar`` and has its unit.
    """
    return {
        f"{name}_bar": (dims, np.abs(np.subtract(again[name][1], value)))
        for name, (dims, value) in judged.items()
        if name in again
    }


def load_share_error(share: NDArray, reference: NDArray, weight: NDArray) -> tuple[float, float]:
    """Largest and RMS difference between load shares (position, pair), over the positions at which a pair touches."""
    difference = share - reference
    touching = weight[:, None] * ((share > 0) | (reference > 0))
    return float(np.abs(difference).max()), float(np.sqrt(np.sum(touching * difference**2) / touching.sum()))
