"""Data of the study: the fronts of the three tools and the rows of Table 2 with the same model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gearbench.lazy import xr
from gearbench.library.garambois2017 import gear, table_2
from gearbench.optimisation.constraints import constrained, judge
from gearbench.optimisation.designs import Designs
from gearbench.robustness.montecarlo import Responses, prepare_scene, respond
from gearbench.scene import Resolution, Scene
from studies.s01_table2.data import COLUMNS, UNITS, statistics
from studies.s06_paper_fronts.findings import wide
from studies.s06_paper_fronts.search import MODULE, TOOLS, search, study

#: Gear whose samples Figure 5 shows.
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
    """Compute the fronts of the three tools, and the rows of Table 2; the searches are kept in ``folder``."""
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
    """Dataset of the feasible designs of a search."""
    feasible = np.flatnonzero(found["feasible"].values)
    designs = Designs(found)
    scenes = [designs.scene(int(i)) for i in feasible]
    columns: dict[str, Any] = {name: found[statistic].values[feasible] for name, statistic in _STATISTIC.items()}
    for name in ("teeth", "helix_angle", "total_contact_ratio", "specific_sliding", "contact_pressure", "root_stress"):
        columns[name] = found[name].values[feasible]
    columns |= {"number": feasible, "on_front": found["on_front"].values[feasible]}
    shapes = [macro_and_micro(scene) for scene in scenes]
    columns |= {name: np.array([shape[name] for shape in shapes]) for name in shapes[0]}
    F = np.stack([columns["m_k"], columns["m_ste"]], axis=1)
    columns["in_wide_front"] = wide(F, F[columns["on_front"] == 1]).astype("int8")
    columns["design_tool"] = np.full(len(feasible), tool)
    return xr.Dataset({name: ("design", values) for name, values in columns.items()})


def macro_and_micro(scene: Scene) -> dict[str, float]:
    """Profile shift and addendum [modules], crowning and tip relief [µm], length of the relief [mm]; 0 if absent."""
    crowning, relief = scene.effect("crowning"), scene.effect("tip_relief")
    return {
        "profile_shift": scene.pair.gears[0].profile_shift,
        "addendum": scene.pair.pinion.addendum,
        "crowning": getattr(crowning, "amount", 0.0),
        "tip_relief": getattr(relief, "amount", 0.0),
        "relief_length": getattr(relief, "length", 0.0),
    }


def _run(found: xr.Dataset) -> xr.Dataset:
    """Dataset of cost and history of the search of a tool."""
    feasible = found["feasible"].values == 1
    # variables that determine the compliance of the teeth
    macro = np.stack([found[v].values[feasible] for v in ("teeth", "helix_angle", "addendum_fraction")], axis=1)
    numbers = {"wall_s": found.attrs["wall_time_s"], "asked": float(found["asked"].sum())}
    numbers |= {"designs": found.sizes["design"]}
    numbers |= {"feasible": int(feasible.sum()), "macro_geometries": len(np.unique(macro, axis=0))}
    history = {f"generation_{name}": found[name] for name in ("evaluated", "feasible_found", "hypervolume")}
    return xr.Dataset({**numbers, **history}).drop_attrs()


def _rows(quick: bool) -> xr.Dataset:
    """Dataset of Table 2: printed values, values of this model, and limits that the rows keep."""
    rows = table_2()
    answers = [statistics(responses(row.gear, quick)) for row in rows]
    limits = study(1).constraints
    kept = [constrained(scene(row.gear), limits) for row in rows]
    tools = {module: tool for tool, module in MODULE.items()}
    return xr.Dataset(
        {
            "row_paper": (("row", "column"), np.array([[getattr(r, c) for c in COLUMNS] for r in rows])),
            "row_ours": (("row", "column"), np.array(answers)),
            "row_tool": ("row", [tools[r.module] for r in rows]),
            "row_feasible": ("row", [int(judge(values, limits)[0] == 0) for values in kept]),
            "row_pressure": ("row", [values.get("contact_pressure", np.nan) for values in kept], {"units": "MPa"}),
        },
        coords={"row": [r.gear for r in rows], "column": list(COLUMNS)},
    )


def _samples(quick: bool) -> xr.Dataset:
    """Dataset of RMS values of one gear over the error samples."""
    answer = responses(SHOWN, quick)
    return xr.Dataset(
        {
            "sample_k": ("sample", answer["mesh_stiffness_rms"], {"units": "%"}),
            "sample_ste": ("sample", answer["transmission_error_rms"], {"units": "µm"}),
        }
    )


def scene(name: str = SHOWN) -> Scene:
    """Scene of a gear of the table at the resolution of the searches."""
    return gear(name).scene(errors=True, resolution=Resolution(**study(1).base["resolution"]))


def responses(name: str, quick: bool) -> Responses:
    """Compute the responses of a gear of the table to the error samples of the searches."""
    r = study(1, quick=quick).robustness
    problem = prepare_scene(scene(name))
    return respond(problem, problem.draw(r.samples, r.seed, r.sampler))[0]
