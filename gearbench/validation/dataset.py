"""Datasets of several comparisons: stack them along ``scene``, and take one out again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearbench.lazy import xr

#: Attribute of a single comparison → variable that holds it in a Dataset of several scenes.
TEXTS = {
    "scene": "scene_toml",
    "scene_sha256": "scene_sha256",
    "support": "support",
    "reference_scene": "reference_scene_toml",
    "reference_solver": "reference_solver",
    "reference_element": "reference_element",
    "reference_versions": "reference_versions",
    "reference_reason": "reference_reason",
}
#: Coordinates of a mesh cycle.
CYCLE = ("mesh_phase", "phase_weight", "panel_start", "panel_end", "pair_index")


def stack(datasets: Sequence[xr.Dataset], names: Sequence[str]) -> xr.Dataset:
    """Stack comparisons into one Dataset; positions and pairs that a scene does not have are NaN."""
    sizes = {
        dim: max(dataset.sizes[dim] for dataset in datasets) for dim in ("position", "pair") if dim in datasets[0].dims
    }
    padded = []
    for dataset in datasets:
        missing = {dim: (0, size - dataset.sizes[dim]) for dim, size in sizes.items()}
        text = {variable: ((), dataset.attrs[key]) for key, variable in TEXTS.items()}
        floats = dataset.assign_coords({name: dataset[name].astype(float) for name in CYCLE if name in dataset.coords})
        floats = floats.reset_coords([name for name in CYCLE if name in dataset.coords])
        padded.append(floats.pad(missing, constant_values=np.nan, keep_attrs=True).assign(text).drop_attrs(deep=False))
    joined = xr.concat(padded, "scene", combine_attrs="override", data_vars="all", coords="minimal")
    known = [name for name in CYCLE if name in joined]
    return joined.assign_coords(scene=("scene", list(names))).set_coords(known)


def of_scene(dataset: xr.Dataset, i: int) -> xr.Dataset:
    """Comparison of scene number ``i``, as ``compare`` returned it."""
    one = dataset.isel(scene=i)
    one = one.isel(position=np.isfinite(one["mesh_phase"].values))
    if "pair_index" in one.coords:
        one = one.isel(pair=np.isfinite(one["pair_index"].values))
        one = one.assign_coords(pair_index=one["pair_index"].astype(int))
    text = {key: str(one[variable].item()) for key, variable in TEXTS.items()}
    return one.drop_vars(list(TEXTS.values())).assign_attrs({**dataset.attrs, **text})
