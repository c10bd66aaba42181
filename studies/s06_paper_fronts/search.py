"""Searches: the optimisation of Garambois et al. 2017, §6, as one study per tool, in folders that can be resumed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from gearbench.lazy import xr
from gearbench.optimisation.run import optimise
from gearbench.optimisation.study import Algorithm, OptimisationStudy, Robustness
from gearbench.optimisation.study_file import parse_study
from gearbench.scene_file import read_toml

TOOLS = (1, 2, 3)
MODULE = {1: 1.0, 2: 1.5, 3: 2.0}  # m_n [mm]
#: Tool → range of tooth numbers that keep the limits of contact ratio and sliding for at least one β and h_a*.
TEETH = {1: (32, 39), 2: (21, 26), 3: (16, 19)}
#: Quick size of a search; ``study.toml`` gives the full size.
QUICK = Algorithm(population=24, generations=8, seed=1), Robustness(samples=32)


def study(tool: int, *, quick: bool = False) -> OptimisationStudy:
    """Make the study of one of the three tools: ``study.toml`` with the module and tooth numbers of the tool."""
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
    """Run a study, or continue it in the subfolder of ``folder`` with ``name`` and the digest of the study.

    Because of the digest, the search of a different study is never continued.
    """
    if folder is None:
        return optimise(wanted)
    return optimise(wanted, directory=folder / f"{name}-{wanted.digest[:8]}", resume=True)
