"""Effect of contact off the line: levels, ranks, and the gears that remain on a front."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.verify import rank_correlation
from studies.s06_paper_fronts.search import MODULE, TOOLS
from studies.s10_fronts_on_bodies.data import MODELS
from studies.s12_fronts_off_line.data import CONTACTS, NAMES

if TYPE_CHECKING:
    import xarray as xr

_OBJECTIVES = ("m_k", "m_ste")
#: Least rank correlation of m_ste on the line and off it.
_RANK = 0.9


def of_tool(dataset: xr.Dataset, kind: str, tool: int) -> NDArray:
    """Rows ("row") or gears of fronts ("design") that belong to a tool."""
    if kind == "row":
        return dataset["row_module"].values == MODULE[tool]
    return dataset["design_tool"].values == tool


def points(dataset: xr.Dataset, kind: str, tool: int, model: str, contact: str) -> NDArray:
    """m_k, m_ste, (gear, objective)."""
    own = of_tool(dataset, kind, tool)
    columns = [dataset[f"{kind}_{name}"].sel(model=model, contact=contact).values[own] for name in _OBJECTIVES]
    return np.stack(columns, axis=1)


def change(dataset: xr.Dataset, kind: str, name: str, model: str) -> NDArray:
    """Change by contact off the line, of all gears [%]; NaN where refused."""
    line, off = (dataset[f"{kind}_{name}"].sel(model=model, contact=contact).values for contact in CONTACTS)
    return 100 * (off / line - 1)


def measures(dataset: xr.Dataset, kind: str, tool: int, model: str) -> dict[str, float]:
    """Changes of a tool's gears on a model: medians and ranges [%], rank correlations, and who remains in front."""
    own = of_tool(dataset, kind, tool)
    found: dict[str, float] = {}
    for name in NAMES:
        changed = change(dataset, kind, name, model)[own]
        changed = changed[np.isfinite(changed)]
        found |= {f"{name}, median [%]": float(np.median(changed)), f"{name}, least [%]": float(changed.min())}
        found[f"{name}, greatest [%]"] = float(changed.max())
        values = [dataset[f"{kind}_{name}"].sel(model=model, contact=contact).values[own] for contact in CONTACTS]
        both = np.isfinite(values).all(axis=0)
        found[f"rank correlation of {name}"] = rank_correlation(values[0][both], values[1][both])
    line, off = (points(dataset, kind, tool, model, contact) for contact in CONTACTS)
    both = np.isfinite(line).all(axis=1) & np.isfinite(off).all(axis=1)
    before, after = (non_dominated(each[both]) for each in (line, off))
    found |= {"gears": float(both.sum()), "not dominated on the line": float(before.sum())}
    found["of these, not dominated off the line"] = float((before & after).sum())
    return found


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Every gear is judged; contact off the line orders the gears of a tool much as contact on it does."""
    found = []
    for kind in ("row", "design"):
        judged = all(np.isfinite(dataset[f"{kind}_{name}"].sel(model="plate")).all() for name in NAMES)
        found.append((f"all {dataset.sizes[kind]} of {kind} are judged on the plate", bool(judged)))
    if dataset.attrs["quick"]:
        return found
    for tool in TOOLS:
        for model in MODELS:
            m = measures(dataset, "row", tool, model)
            rank = m["rank correlation of m_ste"]
            text = f"tool {tool}, {model}: rows keep their order of m_ste, rank correlation {rank:.3f} ≥ {_RANK:g}"
            found.append((text, rank >= _RANK))
    return found
