"""Tables: Table 2 of the paper re-evaluated, comparison of the fronts with it, and cost of the searches."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from gearbench.lazy import xr
from studies.report import table, verdicts
from studies.s01_table2.data import COLUMNS, UNITS
from studies.s06_paper_fronts.findings import checks, distance, front, lead, measures
from studies.s06_paper_fronts.search import MODULE, TOOLS, study

#: Columns of a gear in the lists, and their units.
_GEAR = {
    "teeth": "z",
    "profile_shift": "x",
    "helix_angle": "β [°]",
    "addendum": "h_a*",
    "crowning": "C_β [µm]",
    "tip_relief": "f [µm]",
    "relief_length": "L [mm]",
}
#: Number of gears per front in the regenerated table; the CSV has all.
SHOWN = 12


def write(dataset: xr.Dataset, folder: Path) -> None:
    """Write ``report.md``, ``table_2.md`` and ``fronts.csv``."""
    (folder / "report.md").write_text("\n".join(_report(dataset)) + "\n", encoding="utf-8")
    (folder / "table_2.md").write_text("\n".join(_table_2(dataset)) + "\n", encoding="utf-8")
    with (folder / "fronts.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("tool", "wide_only", *_GEAR, *COLUMNS))
        for tool in TOOLS:
            near = _sorted(dataset, (dataset["design_tool"] == tool) & (dataset["in_wide_front"] == 1))
            columns = [near[name].values for name in (*_GEAR, *COLUMNS)]
            for on_front, *row in zip(near["on_front"].values, *columns, strict=True):
                writer.writerow((tool, int(not on_front), *(f"{value:.6g}" for value in row)))


def _sorted(dataset: xr.Dataset, chosen: xr.DataArray) -> xr.Dataset:
    found = dataset.isel(design=np.flatnonzero(chosen.values))
    return found.isel(design=np.argsort(found["m_k"].values, kind="stable"))


def _report(dataset: xr.Dataset) -> list[str]:
    lines = ["# The three fronts", ""]
    lines += verdicts(checks(dataset))
    lines += ["", "## Fronts against Table 2, evaluated with the same model", ""]
    limit, all_measures = study(1).constraints, {tool: measures(dataset, tool) for tool in TOOLS}
    heads = ("", *(f"tool {tool}, m_n {MODULE[tool]:g} mm" for tool in TOOLS))
    lines += table(heads, [(n, *(f"{all_measures[t][n]:.4f}" for t in TOOLS)) for n in all_measures[1]], texts=1)
    lines += _cost(dataset) + _span(dataset)
    lines += [
        "",
        "Hypervolumes are shares of the box below the worst of both sets and 10 % more. Coverage: share of the one set",
        "that some gear of the other equals or beats. Lead: by which share a row beats some gear of the front in both",
        "objectives. Distance: by which share the front must become better to reach the row.",
        "",
        f"Limits of the material: contact pressure {limit['contact_pressure'].max:g} MPa, root stress "
        f"{limit['root_stress'].max:g} MPa; the paper does",
        "not print its own. Total contact ratio > 1.1, specific sliding < 2.5.",
    ]
    return lines


def _cost(dataset: xr.Dataset) -> list[str]:
    """Lines on times, rates, and shares of designs that needed no new evaluation."""
    d = dataset
    rows = {
        "designs asked for": d["asked"],
        "different designs evaluated": d["designs"],
        "feasible": d["feasible"],
        "share saved by the cache of designs [%]": 100 * (1 - d["designs"] / d["asked"]),
        "macro-geometries among the feasible": d["macro_geometries"],
        "feasible designs for each of them": d["feasible"] / d["macro_geometries"],
        "wall time of the last run [s]": d["wall_s"],
        "evaluations per second": d["designs"] / d["wall_s"],
    }
    cells = [(name, *(f"{float(x):.6g}" for x in v.sel(tool=list(TOOLS)))) for name, v in rows.items()]
    lines = ["", "## What the searches cost", "", *table(("", *(f"tool {tool}" for tool in TOOLS)), cells, texts=1)]
    return [*lines, "", f"All three: {float(d['wall_s'].sum()) / 60:.1f} min of wall time."]


def _span(dataset: xr.Dataset) -> list[str]:
    k, ste = dataset["m_k"].values, dataset["m_ste"].values
    return [
        "",
        f"Over all {k.size} feasible gears m_k spans {k.min():.1f} to {k.max():.1f} % (mean {k.mean():.1f}) and m_ste "
        f"reaches {ste.max():.1f} µm; the paper: 7.5 to 29.2 % (17.5) and 23.6 µm.",
    ]


def _table_2(dataset: xr.Dataset) -> list[str]:
    """Lines with the paper's rows under this model, then gears spread over our fronts, in the paper's columns."""
    lines = [
        "# Table 2 of Garambois et al. 2017",
        "",
        "Each cell: this model / paper. Lead and distance as in the report.",
        "",
    ]
    heads = ["gear", "tool", *COLUMNS, "lead [%]", "distance [%]", "σ_H [MPa]"]
    rows = []
    for i, name in enumerate(dataset["row"].values):
        ours, paper = dataset["row_ours"].values[i], dataset["row_paper"].values[i]
        tool = int(dataset["row_tool"][i])
        F, pressure = front(dataset, tool), f"{float(dataset['row_pressure'][i]):.0f}"
        against = (f"{100 * measure(ours[:2], F):.1f}" for measure in (lead, distance))
        cells = (f"{o:.2f} / {p:.2f}" for o, p in zip(ours, paper, strict=True))
        rows.append((str(name), str(tool), *cells, *against, pressure))
    lines += table(heads, rows, texts=2)
    lines += [
        "",
        "# The fronts found",
        "",
        f"Up to {SHOWN} gears of each, from one end to the other; `fronts.csv` holds all.",
    ]
    for tool in TOOLS:
        found = _sorted(dataset, (dataset["design_tool"] == tool) & (dataset["on_front"] == 1))
        lines += ["", f"## Tool {tool}, m_n {MODULE[tool]:g} mm: {found.sizes['design']} gears", ""]
        heads = [*_GEAR.values(), *(f"{c} [{UNITS[c]}]" for c in COLUMNS)]
        shown = found.isel(design=np.unique(np.linspace(0, found.sizes["design"] - 1, SHOWN).round().astype(int)))
        values = zip(*(shown[name].values for name in (*_GEAR, *COLUMNS)), strict=True)
        lines += table(heads, [[f"{value:.3g}" for value in row] for row in values], texts=0)
    return lines
