"""The optimisation of Garambois et al. 2017, §6: the Pareto fronts of a reverse gear for three tools, against Table 2.

Every gear of the search and every row of the table is evaluated with the same model, resolution and error samples. The
searches are stored beside the Dataset, generation by generation: a run that was interrupted goes on where it was.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.library.garambois2017 import Row, gear, table_2
from gearbench.optimise.constraints import constrained, judge
from gearbench.optimise.designs import Designs
from gearbench.robustness.montecarlo import Responses, prepare_scene, respond
from gearbench.scene import Resolution, Scene
from studies.paper_fronts_compare import coverage, distance, lead, shares, wide
from studies.paper_fronts_search import MODULE, TOOLS, search, study
from studies.s01_table2 import COLUMNS, UNITS, statistics

if TYPE_CHECKING:
    import xarray as xr

QUESTION = "Does the search find the paper's three Pareto fronts, and does any gear of Table 2 beat them?"

#: A row of the table may beat a front by no more than this in both objectives.
LEAD = 0.02
#: The gear whose samples Figure 5 shows.
SHOWN = "55"

#: Column of the table → statistic of a design.
_STATISTIC = {
    "m_k": "mesh_stiffness_rms_mean",
    "m_ste": "transmission_error_rms_mean",
    "sigma_k": "mesh_stiffness_rms_std",
    "max_k": "mesh_stiffness_rms_max",
    "sigma_ste": "transmission_error_rms_std",
    "max_ste": "transmission_error_rms_max",
}


def compute(*, quick: bool = False, folder: Path | None = None) -> xr.Dataset:
    """The fronts of the three tools and the rows of Table 2 under the same model; searches are kept in ``folder``."""
    import xarray as xr

    searches = {tool: search(tool, quick=quick, folder=folder) for tool in TOOLS}
    gears = xr.concat([_gears(tool, found) for tool, found in searches.items()], dim="design")
    runs = xr.concat([_run(found) for found in searches.values()], dim="tool")
    dataset = xr.merge([gears, runs.assign_coords(tool=list(TOOLS)), _rows(quick), _samples(quick)])
    units = {name: UNITS[name] for name in COLUMNS} | {"relief_length": "mm", "helix_angle": "°"}
    for name, unit in units.items():
        dataset[name].attrs["units"] = unit
    attrs = {"quick": int(quick), "samples": study(1, quick=quick).robustness.samples}
    versions = searches[1].attrs
    return dataset.assign_attrs(attrs | {key: versions[key] for key in ("versions", "git_revision") if key in versions})


def _gears(tool: int, found: xr.Dataset) -> xr.Dataset:
    """The feasible designs of a search, as gears."""
    import xarray as xr

    places = np.flatnonzero(found["feasible"].values)
    designs = Designs(found)
    scenes = [designs.scene(int(place)) for place in places]
    columns: dict[str, Any] = {name: found[statistic].values[places] for name, statistic in _STATISTIC.items()}
    for name in ("teeth", "helix_angle", "total_contact_ratio", "specific_sliding", "contact_pressure", "root_stress"):
        columns[name] = found[name].values[places]
    columns |= {"place": places, "on_front": found["on_front"].values[places]}
    shapes = [macro_and_micro(scene) for scene in scenes]
    columns |= {name: np.array([shape[name] for shape in shapes]) for name in shapes[0]}
    F = np.stack([columns["m_k"], columns["m_ste"]], axis=1)
    columns["in_wide_front"] = wide(F, F[columns["on_front"] == 1]).astype("int8")
    columns["design_tool"] = np.full(len(places), tool)
    return xr.Dataset({name: ("design", values) for name, values in columns.items()})


def macro_and_micro(scene: Scene) -> dict[str, float]:
    """Profile shift and addendum [modules], crowning and tip relief [µm], length of the relief [mm]; 0: absent."""
    crowning, relief = scene.effect("crowning"), scene.effect("tip_relief")
    return {
        "profile_shift": scene.pair.gears[0].profile_shift,
        "addendum": scene.pair.pinion.addendum,
        "crowning": getattr(crowning, "amount", 0.0),
        "tip_relief": getattr(relief, "amount", 0.0),
        "relief_length": getattr(relief, "length", 0.0),
    }


def _run(found: xr.Dataset) -> xr.Dataset:
    """What the search of a tool cost and how it went."""
    import xarray as xr

    names = ("search_wall_s", "search_cpu_s", "search_evaluated", "search_legs")
    numbers = {name.removeprefix("search_"): found.attrs[name] for name in names}
    feasible = found["feasible"].values == 1
    # what the compliance of the teeth depends on
    macro = np.stack([found[v].values[feasible] for v in ("teeth", "helix_angle", "addendum_fraction")], axis=1)
    numbers |= {"asked": float(found["asked"].sum()), "designs": found.sizes["design"]}
    numbers |= {"feasible": int(feasible.sum()), "macro_geometries": len(np.unique(macro, axis=0))}
    history = {f"generation_{name}": found[name] for name in ("evaluated", "feasible_found", "hypervolume")}
    return xr.Dataset({**numbers, **history}).drop_attrs()


def _rows(quick: bool) -> xr.Dataset:
    """Table 2: what the paper prints, what this model gives, and the limits each row keeps."""
    import xarray as xr

    rows = table_2()
    answers = [statistics(responses(row, quick)) for row in rows]
    limits = study(1).constraints
    kept = [constrained(row_scene(row, quick), limits) for row in rows]
    tools = {module: tool for tool, module in MODULE.items()}
    return xr.Dataset(
        {
            "row_paper": (("row", "column"), np.array([[getattr(r, c) for c in COLUMNS] for r in rows])),
            "row_ours": (("row", "column"), np.array(answers)),
            "row_tool": ("row", [tools[r.module] for r in rows]),
            "row_feasible": ("row", [int(judge(values, limits)[0] == 0) for values in kept]),
            "row_pressure": ("row", [values["contact_pressure"] for values in kept], {"units": "MPa"}),
        },
        coords={"row": [r.gear for r in rows], "column": list(COLUMNS)},
    )


def _samples(quick: bool) -> xr.Dataset:
    """RMS values of one gear over the error samples."""
    import xarray as xr

    answer = responses(gear(SHOWN), quick)
    return xr.Dataset(
        {
            "sample_k": ("sample", answer["mesh_stiffness_rms"], {"units": "%"}),
            "sample_ste": ("sample", answer["transmission_error_rms"], {"units": "µm"}),
        }
    )


def row_scene(row: Row, quick: bool = False) -> Scene:
    """A row of the table at the resolution of the searches."""
    return row.scene(errors=True, resolution=Resolution(**study(1, quick=quick).base["resolution"]))


def responses(row: Row, quick: bool) -> Responses:
    """Responses of a row to the error samples that every design of the searches sees."""
    r = study(1, quick=quick).robustness
    problem = prepare_scene(row_scene(row, quick))
    return respond(problem, problem.draw(r.samples, r.seed, r.sampler))[0]


def front(dataset: xr.Dataset, tool: int) -> NDArray:
    """Objectives m_k, m_ste of a tool's front, (point, objective)."""
    own = (dataset["design_tool"] == tool) & (dataset["on_front"] == 1)
    return np.stack([dataset[name].values[own.values] for name in ("m_k", "m_ste")], axis=1)


def rows_of(dataset: xr.Dataset, tool: int) -> tuple[list[str], NDArray]:
    """Names and re-evaluated objectives of the rows of a tool, (row, objective)."""
    own = np.flatnonzero(dataset["row_tool"].values == tool)
    return [str(name) for name in dataset["row"].values[own]], dataset["row_ours"].values[own, :2]


def measures(dataset: xr.Dataset, tool: int) -> dict[str, float]:
    """Hypervolumes, coverages, and how far the rows of a tool lead or lag."""
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
    """No row of Table 2 beats the front of its tool; the quick size searches too little for that, and is told so."""
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


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Figures 5, 8, 9 and 10 of the paper, how the searches went, and the tables."""
    from studies import paper_fronts_figures, paper_fronts_tables

    paper_fronts_figures.draw(dataset, folder)
    paper_fronts_tables.write(dataset, folder)
