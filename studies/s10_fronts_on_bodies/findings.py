"""Findings: comparison of plate and solid teeth; shares of the fronts that remain, shifts of the rows."""

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
from studies.s06_paper_fronts.findings import lead, shares
from studies.s06_paper_fronts.search import MODULE, TOOLS
from studies.s10_fronts_on_bodies.data import MODELS


def points(dataset: xr.Dataset, tool: int, found_on: str, judged_by: str) -> NDArray:
    """m_k and m_ste of a front, (point, objective), found with one model and evaluated with another; NaN if refused."""
    own = (dataset["design_tool"].values == tool) & (dataset["design_model"].values == MODELS.index(found_on))
    return np.stack([dataset[f"{name}_{judged_by}"].values[own] for name in ("m_k", "m_ste")], axis=1)


def row_points(dataset: xr.Dataset, tool: int, model: str) -> NDArray:
    """m_k and m_ste of the rows of a tool, (row, objective)."""
    own = dataset["row_module"].values == MODULE[tool]
    return np.stack([dataset[f"row_{name}_{model}"].values[own] for name in ("m_k", "m_ste")], axis=1)


def measures(dataset: xr.Dataset, tool: int) -> dict[str, float]:
    """Measures that compare the front found with the plate to that found with solid teeth on bodies."""
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
    """Check, with solid teeth, that the solid's front is no worse than the plate's and no row of Table 2 beats it."""
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


_ACROSS, _UP = "m$_k$ [%]", "m$_{ste}$ [µm]"


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Write ``fronts.png``, ``table_2.png`` and ``report.md``."""
    write_figure(fronts(dataset), folder / "fronts.png")
    write_figure(rows(dataset), folder / "table_2.png")
    (folder / "report.md").write_text("\n".join(report(dataset)) + "\n", encoding="utf-8")


def fronts(dataset: xr.Dataset) -> Any:
    """Draw for every tool the solid's front, the plate's front evaluated with solid teeth, and the rows of Table 2."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    figure, axes = new_figure(1, len(TOOLS), (13.0, 5.0))
    for axis, tool in zip(axes.ravel(), TOOLS, strict=True):
        solid, plate = points(dataset, tool, "solid", "solid"), points(dataset, tool, "plate", "solid")
        was, theirs = points(dataset, tool, "plate", "plate"), row_points(dataset, tool, "solid")
        axis.plot(*was.T, ".", color=GREY, label="front on the plate, judged by the plate")
        axis.plot(*plate.T, "s", color=ORANGE, mfc="none", label="the same gears on solid teeth and bodies")
        axis.plot(*solid[np.argsort(solid[:, 0])].T, "o-", color=BLUE, ms=4, label="front on solid teeth and bodies")
        axis.plot(*theirs.T, "x", color="black", label="rows of Table 2, solid on body")
        axis.set(title=f"tool {tool}, m$_n$ = {MODULE[tool]:g} mm", xlabel=_ACROSS, ylabel=_UP, yscale="log")
        axis.yaxis.set(major_locator=LogLocator(subs=(1, 2, 3, 5)), major_formatter=StrMethodFormatter("{x:g}"))
        axis.yaxis.set_minor_formatter(NullFormatter())
    legend_below(figure, axes.ravel()[0], 2)
    return figure


def rows(dataset: xr.Dataset) -> Any:
    """Draw the ratios solid/plate of both objectives of the rows of Table 2 over the total contact ratio."""
    figure, axes = new_figure(1, 1, (8.0, 5.0))
    axis = axes[0, 0]
    ratio = dataset["row_contact_ratio"].values
    for name, colour, marker, label in (("m_k", BLUE, "o", "m$_k$"), ("m_ste", ORANGE, "s", "m$_{ste}$")):
        change = 100 * (dataset[f"row_{name}_solid"].values / dataset[f"row_{name}_plate"].values - 1)
        axis.plot(ratio, change, marker, color=colour, label=label)
    axis.axhline(0.0, color=GREY, lw=0.8)
    axis.set(xlabel="total contact ratio", ylabel="solid on its body over clamped plate [%]")
    axis.legend(frameon=False)
    return figure


def report(dataset: xr.Dataset) -> list[str]:
    """Lines of the report: checks, fronts, and all rows of Table 2 with both models."""
    lines = ["# The paper's fronts on solid teeth and their bodies", ""]
    lines += verdicts(checks(dataset))
    found = {tool: measures(dataset, tool) for tool in TOOLS}
    heads = ("", *(f"tool {tool}, m_n {MODULE[tool]:g} mm" for tool in TOOLS))
    lines += ["", *table(heads, [(n, *(f"{found[t][n]:.4g}" for t in TOOLS)) for n in found[1]], texts=1)]
    lines += ["", "# Table 2", "", "Each cell: paper / plate / solid on its body.", ""]
    body = []
    for i, name in enumerate(dataset["row"].values):
        cells = [
            " / ".join(f"{float(dataset[f'row_{column}_{kind}'][i]):.2f}" for kind in ("paper", "plate", "solid"))
            for column in ("m_k", "m_ste")
        ]
        body.append((str(name), f"{float(dataset['row_contact_ratio'][i]):.2f}", *cells))
    return lines + table(("gear", "ε_γ", "m_k [%]", "m_ste [µm]"), body, texts=1)
