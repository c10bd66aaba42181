"""Plate and solid compared: shares of the fronts that remain, shifts of the rows, and what an engineer would quote."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.verify import rank_correlation
from studies.s06_paper_fronts.compare import lead, shares
from studies.s06_paper_fronts.search import MODULE, TOOLS
from studies.s10_fronts_on_bodies.data import MODELS

if TYPE_CHECKING:
    import xarray as xr


def points(dataset: xr.Dataset, tool: int, found_on: str, judged_by: str) -> NDArray:
    """m_k, m_ste of the front that one model found, as another judges it, (point, objective); NaN where refused."""
    own = (dataset["design_tool"].values == tool) & (dataset["design_model"].values == MODELS.index(found_on))
    return np.stack([dataset[f"{name}_{judged_by}"].values[own] for name in ("m_k", "m_ste")], axis=1)


def row_points(dataset: xr.Dataset, tool: int, model: str) -> NDArray:
    """m_k, m_ste of the rows of a tool, (row, objective)."""
    own = dataset["row_module"].values == MODULE[tool]
    return np.stack([dataset[f"row_{name}_{model}"].values[own] for name in ("m_k", "m_ste")], axis=1)


def measures(dataset: xr.Dataset, tool: int) -> dict[str, float]:
    """Comparison of the plate's front with that on solid teeth and bodies."""
    solid, plate = points(dataset, tool, "solid", "solid"), points(dataset, tool, "plate", "solid")
    before, kept = points(dataset, tool, "plate", "plate"), np.isfinite(plate).all(axis=1)
    both = np.concatenate([solid, plate[kept]])
    volume, volume_plate = shares(solid, plate[kept])
    shift = 100 * (plate[kept] / before[kept] - 1)
    theirs = row_points(dataset, tool, "solid")
    return {
        "gears on the front of the solid": float(len(solid)),
        "gears on the front of the plate": float(len(plate)),
        "of these, refused on the body": float((~kept).sum()),
        "of these, on the front of both together": float(non_dominated(both)[len(solid) :].sum()),
        "hypervolume of the solid's front": volume,
        "hypervolume of the plate's front, judged by the solid": volume_plate,
        "m_k from plate to solid, median [%]": float(np.median(shift[:, 0])),
        "m_k, least [%]": float(shift[:, 0].min()),
        "m_k, greatest [%]": float(shift[:, 0].max()),
        "m_ste from plate to solid, median [%]": float(np.median(shift[:, 1])),
        "m_ste, least [%]": float(shift[:, 1].min()),
        "m_ste, greatest [%]": float(shift[:, 1].max()),
        "rank correlation of m_k": rank_correlation(before[kept, 0], plate[kept, 0]),
        "rank correlation of m_ste": rank_correlation(before[kept, 1], plate[kept, 1]),
        "largest lead of a row of Table 2": max(lead(row, solid) for row in theirs),
    }


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """The search on the solid must not be worse than the plate's front there; rows of Table 2 must not beat it."""
    found = []
    quick = bool(dataset.attrs["quick"])
    for tool in TOOLS:
        m = measures(dataset, tool)
        ours, theirs = (m[f"hypervolume of the {name}"] for name in _VOLUMES)
        limit = 0.25 if quick else 0.02
        if not quick:
            found.append((f"tool {tool}: hypervolume {ours:.4f} ≥ {theirs:.4f} of the plate's front", ours >= theirs))
        worst = m["largest lead of a row of Table 2"]
        text = f"tool {tool}: no row leads the front by more than {100 * limit:.0f} % ({100 * worst:.1f} %)"
        found.append((text, worst <= limit))
    return found


_VOLUMES = ("solid's front", "plate's front, judged by the solid")
