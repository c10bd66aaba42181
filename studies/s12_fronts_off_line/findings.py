"""Findings: effect of contact off the line on levels, ranks and fronts; checks, figures and report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.lazy import xr
from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.verify import rank_correlation
from gearbench.plotting import BLUE, GREY, ORANGE, legend_below, new_figure, write_figure
from studies.report import table, verdicts
from studies.s06_paper_fronts.search import MODULE, TOOLS
from studies.s10_fronts_on_bodies.data import MODELS
from studies.s12_fronts_off_line.data import CONTACTS, NAMES

_OBJECTIVES = ("m_k", "m_ste")
#: Least rank correlation between m_ste on the line and m_ste off it.
_RANK = 0.9


def of_tool(dataset: xr.Dataset, kind: str, tool: int) -> NDArray:
    """Flag the rows ("row") or gears of fronts ("design") that belong to a tool."""
    if kind == "row":
        return dataset["row_module"].values == MODULE[tool]
    return dataset["design_tool"].values == tool


def points(dataset: xr.Dataset, kind: str, tool: int, model: str, contact: str) -> NDArray:
    """m_k and m_ste of the gears of a tool, (gear, objective)."""
    own = of_tool(dataset, kind, tool)
    columns = [dataset[f"{kind}_{name}"].sel(model=model, contact=contact).values[own] for name in _OBJECTIVES]
    return np.stack(columns, axis=1)


def change(dataset: xr.Dataset, kind: str, name: str, model: str) -> NDArray:
    """Relative change of a value by contact off the line, for all gears [%]; NaN if a model refuses a gear."""
    line, off = (dataset[f"{kind}_{name}"].sel(model=model, contact=contact).values for contact in CONTACTS)
    return 100 * (off / line - 1)


def measures(dataset: xr.Dataset, kind: str, tool: int, model: str) -> dict[str, float]:
    """Changes of a tool's gears with a model: medians and ranges [%], rank correlations, gears left on the front."""
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
    """Check that every gear is evaluated, and that contact on and off the line rank the gears of a tool alike."""
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


_LABELS = {"m_k": "m$_k$", "m_ste": "m$_{ste}$", "rms": "RMS of STE without errors"}


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Write ``fronts.png``, ``table_2.png`` and ``report.md``."""
    write_figure(fronts(dataset), folder / "fronts.png")
    write_figure(rows(dataset), folder / "table_2.png")
    (folder / "report.md").write_text("\n".join(report(dataset)) + "\n", encoding="utf-8")


def fronts(dataset: xr.Dataset) -> Any:
    """Draw the gears of the fronts with both models, joined by lines from contact on the line to contact off it."""
    figure, axes = new_figure(len(MODELS), len(TOOLS), (13.0, 8.0))
    for row, model in zip(axes, MODELS, strict=True):
        for axis, tool in zip(row, TOOLS, strict=True):
            line, off = (points(dataset, "design", tool, model, contact) for contact in CONTACTS)
            axis.plot(*np.stack([line.T, off.T], axis=1), "-", color=GREY, lw=0.6)
            axis.plot(*line.T, "o", ms=3, color=ORANGE, label="contact on the line")
            axis.plot(*off.T, "o", ms=3, color=BLUE, label="contact off the line")
            table_2 = points(dataset, "row", tool, model, "off_line")
            axis.plot(*table_2.T, "x", color="black", label="rows of Table 2, off the line")
            axis.set(title=f"{model}, tool {tool}, m$_n$ = {MODULE[tool]:g} mm", yscale="log")
            axis.set(xlabel="m$_k$ [%]", ylabel="m$_{ste}$ [µm]")
    legend_below(figure, axes[0, 0], 3)
    return figure


def rows(dataset: xr.Dataset) -> Any:
    """Draw the changes of the rows of Table 2 by contact off the line over the total contact ratio."""
    figure, axes = new_figure(1, len(MODELS), (11.0, 4.5), sharey=True)
    ratio = dataset["row_contact_ratio"].values
    for axis, model in zip(axes.ravel(), MODELS, strict=True):
        for name, colour, marker in zip(NAMES, (ORANGE, BLUE, GREY), "sox", strict=True):
            axis.plot(ratio, change(dataset, "row", name, model), marker, color=colour, label=_LABELS[name])
        axis.axhline(0.0, color="black", lw=0.8)
        axis.set(title=model, xlabel="total contact ratio")
    axes[0, 0].set_ylabel("off the line over on the line [%]")
    legend_below(figure, axes[0, 0], 3)
    return figure


def report(dataset: xr.Dataset) -> list[str]:
    """Lines of the report: checks, changes on the fronts and in Table 2, and all rows of Table 2."""
    lines = ["# Table 2 and the paper's fronts with contact off the line", ""]
    lines += verdicts(checks(dataset))
    for kind, title in (("design", "The fronts"), ("row", "Table 2")):
        present = [tool for tool in TOOLS if len(points(dataset, kind, tool, "plate", "line"))]
        found = {(tool, model): measures(dataset, kind, tool, model) for tool in present for model in MODELS}
        heads = ("off the line over on it", *(f"tool {tool}, {model}" for tool, model in found))
        body = [(name, *(f"{each[name]:.3g}" for each in found.values())) for name in next(iter(found.values()))]
        lines += ["", f"## {title}", "", *table(heads, body, texts=1)]
    lines += ["", "## Every row", "", "Each cell: paper / plate / plate off the line / solid / solid off the line.", ""]
    cells = []
    for i, name in enumerate(dataset["row"].values):
        here = [
            " / ".join(
                [
                    f"{float(dataset[f'row_{column}_paper'][i]):.2f}",
                    *(f"{value:.2f}" for value in dataset[f"row_{column}"].values[i].ravel()),
                ]
            )
            for column in ("m_k", "m_ste")
        ]
        rms = " / ".join(f"{value:.2f}" for value in dataset["row_rms"].values[i].ravel())
        cells.append((str(name), f"{float(dataset['row_contact_ratio'][i]):.2f}", *here, f"– / {rms}"))
    return lines + table(("gear", "ε_γ", "m_k [%]", "m_ste [µm]", "RMS of STE without errors [µm]"), cells, texts=1)
