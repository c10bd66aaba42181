"""The optimisation of Garambois et al. 2017, §6, as studies, one for each tool, run into folders that are resumed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.optimisation.run import optimise
from gearbench.optimisation.study import Algorithm, OptimisationStudy, Robustness
from gearbench.optimisation.study_file import parse_study
from gearbench.scene_file import read_toml

if TYPE_CHECKING:
    import xarray as xr

TOOLS = (1, 2, 3)
MODULE = {1: 1.0, 2: 1.5, 3: 2.0}  # m_n [mm]
#: Every number of teeth that makes a gear within the limits of contact ratio and sliding at some β and h_a*.
TEETH = {1: (32, 39), 2: (21, 26), 3: (16, 19)}
#: The quick size; the full one is that of ``study.toml``.
QUICK = Algorithm(population=24, generations=8, seed=1), Robustness(samples=32)


def study(tool: int, *, quick: bool = False) -> OptimisationStudy:
    """The reverse gear cut by one of the three tools: that of ``study.toml`` with the module and teeth of the tool."""
    tables = read_toml(Path(__file__).with_name("study.toml"))
    tables["name"] = f"reverse gear, tool {tool}"
    tables["base"]["pair"]["normal_module"] = MODULE[tool]
    tables["variables"]["teeth"] |= dict(zip(("min", "max"), TEETH[tool], strict=True))
    found = parse_study(tables)
    return replace(found, algorithm=QUICK[0], robustness=QUICK[1]) if quick else found


def search(tool: int, *, quick: bool, folder: Path | None) -> xr.Dataset:
    """Run or continue the search of a tool."""
    return kept_search(study(tool, quick=quick), f"tool{tool}", folder)


def kept_search(wanted: OptimisationStudy, name: str, folder: Path | None) -> xr.Dataset:
    """Run a study, or continue what there is of it in ``folder`` under ``name`` and its digest.

    A search that was defined otherwise is never continued.
    """
    if folder is None:
        return optimise(wanted)
    return optimise(wanted, directory=folder / f"{name}-{wanted.digest[:8]}", resume=True)
