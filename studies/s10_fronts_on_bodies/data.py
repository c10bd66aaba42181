"""Data of the study: searches with both tooth models, their fronts evaluated with both, and the rows of Table 2."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.gear_body import GearBody
from gearbench.effects.tooth_bending import ToothBending
from gearbench.lazy import xr
from gearbench.library.garambois2017 import table_2
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.problem import evaluate
from gearbench.optimisation.study import OptimisationStudy, Robustness
from gearbench.optimisation.study_file import parse_study
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.scene import Resolution, Scene
from studies.s06_paper_fronts.search import QUICK, TOOLS, kept_search
from studies.s06_paper_fronts.search import study as plate_study

#: Names of the tooth models in this study.
MODELS = ("plate", "solid")
#: Bore of all gears [mm], half the reference diameter, as for a gear on a needle bearing; the paper gives no bore.
BORE = 20.0
#: Responses whose means are m_k and m_ste.
NAMES = ("mesh_stiffness_rms", "transmission_error_rms")


def study(tool: int, model: str, *, quick: bool = False) -> OptimisationStudy:
    """Make the study of ``s06_paper_fronts`` with one of the tooth models."""
    given = plate_study(tool)
    if quick:
        given = replace(given, algorithm=QUICK[0], robustness=Robustness(samples=32, racing=True))
    if model == "plate":
        return given
    tables = given.to_mapping()
    tables["base"]["effects"] |= {"tooth_bending": {"model": "solid"}, "gear_body": {"model": "ring"}}
    for member in ("pinion", "wheel"):
        tables["base"]["pair"][member]["bore_diameter"] = BORE
    return parse_study(tables | {"name": f"{given.name}, solid on body"})


def scene(number: int = 0) -> Scene:
    """Scene of a row of Table 2 with solid teeth and gear bodies, at the resolution of the searches."""
    resolution = Resolution(**plate_study(1).base["resolution"])
    return on_body(table_2()[number].scene(errors=True, resolution=resolution))


def on_body(scene: Scene) -> Scene:
    """Return a scene of the paper with solid teeth on gear bodies."""
    pair = scene.pair
    bored = {name: replace(getattr(pair, name), bore_diameter=BORE) for name in ("pinion", "wheel")}
    teeth = [ToothBending(model="solid") if isinstance(e, ToothBending) else e for e in scene.effects]
    return replace(scene, pair=replace(pair, **bored), effects=(*teeth, GearBody()))


def compute(*, quick: bool = False, folder: Path | None = None) -> xr.Dataset:
    """Compute the fronts of both tooth models and the rows of Table 2 with both; searches are kept in ``folder``."""
    searched = {(tool, model): study(tool, model, quick=quick) for tool in TOOLS for model in MODELS}
    found = {key: kept_search(wanted, f"{key[1]}{key[0]}", folder) for key, wanted in searched.items()}
    return assemble(found, quick=quick)


def assemble(found: dict[tuple[int, str], xr.Dataset], *, quick: bool) -> xr.Dataset:
    """Make the Dataset of the study from its searches, given by tool and model."""
    fronts = xr.concat([_front(tool, model, found, quick) for tool, model in found], dim="design")
    dataset = xr.merge([fronts, rows(quick)])
    for name in dataset:
        dataset[name].attrs["units"] = "µm" if "m_ste" in str(name) else "%" if "m_k" in str(name) else "1"
    return dataset.assign_attrs(quick=int(quick), generations=study(1, "solid", quick=quick).algorithm.generations)


def _front(tool: int, model: str, found: dict[tuple[int, str], xr.Dataset], quick: bool) -> xr.Dataset:
    """Evaluate the front of a search with both tooth models; NaN if a model refuses a gear."""
    designs = Designs(found[tool, model])
    numbers = np.flatnonzero(found[tool, model]["on_front"].values)
    own = found[tool, model]["objective"].values[numbers]
    other = study(tool, MODELS[1 - MODELS.index(model)], quick=quick)
    theirs = np.array([evaluate(other, designs.design(int(i))).objectives(other) for i in numbers])
    by = {model: own, MODELS[1 - MODELS.index(model)]: theirs}
    columns: dict[str, NDArray] = {
        f"{name}_{each}": by[each][:, i] for each in MODELS for i, name in enumerate(("m_k", "m_ste"))
    }
    columns |= {"design_tool": np.full(len(numbers), tool), "design_model": np.full(len(numbers), MODELS.index(model))}
    columns |= {v.name: found[tool, model][v.name].values[numbers].astype(float) for v in designs.study.variables}
    return xr.Dataset({name: ("design", values) for name, values in columns.items()})


def rows(quick: bool) -> xr.Dataset:
    """Dataset of m_k and m_ste of the rows of Table 2: as printed, with the plate, and with solid teeth on bodies."""
    table = table_2()
    resolution = Resolution(**plate_study(1).base["resolution"])
    scenes = [row.scene(errors=True, resolution=resolution) for row in table]
    r = plate_study(1, quick=quick).robustness
    columns: dict[str, list] = {
        "row_m_k_paper": [row.m_k for row in table],
        "row_m_ste_paper": [row.m_ste for row in table],
    }
    for model, change in (("plate", lambda each: each), ("solid", on_body)):
        found = np.array([means(change(scene), r) for scene in scenes])
        columns |= {f"row_m_k_{model}": list(found[:, 0]), f"row_m_ste_{model}": list(found[:, 1])}
    columns["row_module"] = [row.module for row in table]
    columns["row_contact_ratio"] = [scene.pair.meshing.total_contact_ratio for scene in scenes]
    names = np.array([row.gear for row in table], dtype=object)
    return xr.Dataset({name: ("row", values) for name, values in columns.items()}, coords={"row": names})


def means(scene: Scene, r: Robustness) -> list[float]:
    """Compute m_k and m_ste of a scene over error samples."""
    problem = prepare_scene(scene)
    answers, _ = respond(problem, problem.draw(r.samples, r.seed, r.sampler), names=NAMES)
    return [float(answers[name].mean()) for name in NAMES]
