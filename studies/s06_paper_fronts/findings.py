"""Findings: measures that compare fronts and single gears, and checks of the fronts against Table 2.

All objectives are minimised; ``F`` holds them, (point, objective).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.lazy import xr
from gearbench.optimisation.front import hypervolume
from studies.s06_paper_fronts.search import TOOLS

#: A gear belongs to the wide front if it is worse than a gear of the front by at most this share in both objectives.
WIDE = 0.10


def coverage(A: NDArray, B: NDArray) -> float:
    """Share of the points of B that are equal to or dominated by a point of A (Zitzler & Thiele 1999)."""
    return float(np.mean([np.any(np.all(b >= A, axis=1)) for b in B])) if len(B) else float("nan")


def reference_point(*fronts: NDArray) -> NDArray:
    """Reference point: 1.1 times the worst objectives over all fronts, (objective,)."""
    return 1.1 * np.max([F.max(axis=0) for F in fronts], axis=0)


def shares(ours: NDArray, theirs: NDArray) -> tuple[float, float]:
    """Hypervolumes of two fronts as shares of the box below their common reference point."""
    reference = reference_point(ours, theirs)
    return hypervolume(ours / reference), hypervolume(theirs / reference)


def lead(point: NDArray, front: NDArray) -> float:
    """Largest share by which ``point`` beats a point of the front in both objectives; negative if it beats none."""
    return float(np.max(np.min(1 - point / front, axis=1)))


def distance(point: NDArray, front: NDArray) -> float:
    """Share by which the front must improve to reach ``point``; negative if the front already dominates it."""
    return float(np.min(np.max(front / point, axis=1)) - 1)


def wide(F: NDArray, front: NDArray, share: float = WIDE) -> NDArray:
    """Flag points that are worse than a point of the front by at most ``share`` in every objective, (point,)."""
    return np.array([np.min(np.max(f / front, axis=1)) <= 1 + share for f in F], dtype=bool)


#: Largest share by which a row of the table may beat a front in both objectives.
LEAD = 0.02


def front(dataset: xr.Dataset, tool: int) -> NDArray:
    """Objectives m_k and m_ste of a tool's front, (point, objective)."""
    own = (dataset["design_tool"] == tool) & (dataset["on_front"] == 1)
    return np.stack([dataset[name].values[own.values] for name in ("m_k", "m_ste")], axis=1)


def rows_of(dataset: xr.Dataset, tool: int) -> tuple[list[str], NDArray]:
    """Names and re-evaluated objectives of the rows of a tool, (row, objective)."""
    own = np.flatnonzero(dataset["row_tool"].values == tool)
    return [str(name) for name in dataset["row"].values[own]], dataset["row_ours"].values[own, :2]


def measures(dataset: xr.Dataset, tool: int) -> dict[str, float]:
    """Hypervolumes, coverages, and leads and distances of the rows of a tool."""
    ours, (_, theirs) = front(dataset, tool), rows_of(dataset, tool)
    volume, volume_rows = shares(ours, theirs)
    return {
        "hypervolume": volume,
        "hypervolume of Table 2": volume_rows,
        "coverage of Table 2 by the front": coverage(ours, theirs),
        "coverage of the front by Table 2": coverage(theirs, ours),
        "largest lead of a row": max(lead(row, ours) for row in theirs),
        "largest distance to a row": max(distance(row, ours) for row in theirs),
    }


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check that no row of Table 2 beats the front of its tool; the limit is looser for the quick, small search."""
    found = []
    quick = bool(dataset.attrs["quick"])
    for tool in TOOLS:
        ours, (names, theirs) = front(dataset, tool), rows_of(dataset, tool)
        leads = {name: lead(row, ours) for name, row in zip(names, theirs, strict=True)}
        worst = max(leads, key=leads.__getitem__)
        m = measures(dataset, tool)
        limit = 0.25 if quick else LEAD
        text = f"tool {tool}: row {worst} leads the front by {100 * leads[worst]:.1f} % ≤ {100 * limit:.0f} %"
        found.append((text + (" (quick size)" if quick else ""), leads[worst] <= limit))
        text = f"hypervolume {m['hypervolume']:.4f} ≥ {m['hypervolume of Table 2']:.4f} of Table 2"
        if not quick:
            found.append((f"tool {tool}: {text}", m["hypervolume"] >= m["hypervolume of Table 2"]))
        growth = np.diff(dataset["generation_hypervolume"].sel(tool=tool).dropna("generation").values)
        found.append((f"tool {tool}: the hypervolume never falls", bool(np.all(growth >= -1e-12))))
    feasible = int(dataset["row_feasible"].sum())
    found.append((f"{feasible} of {dataset.sizes['row']} rows keep all limits", feasible == dataset.sizes["row"]))
    return found
