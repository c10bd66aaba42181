"""The optimisation of Garambois et al. 2017, §6, as studies, one for each tool, run into folders that are resumed."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.optimisation.run import Progress, optimise
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


class Tally:
    """Wall and processor time of a search over all its legs, kept beside its folder after every generation.

    Parameters
    ----------
    path
        JSON file of earlier legs; None: nothing is kept.
    """

    def __init__(self, path: Path | None) -> None:
        self._path, self._generation = path, 0
        self._cpu = time.process_time()
        known = json.loads(path.read_text(encoding="utf-8")) if path is not None and path.exists() else {}
        self._before = {key: known.get(key, 0.0) for key in ("wall_s", "cpu_s", "evaluated", "legs")}
        self.total = dict(self._before)

    def __call__(self, state: Progress) -> None:
        """Take note of the progress; reading finished generations again is no leg."""
        if state.generation == self._generation or state.evaluated_here == 0:
            return
        self._generation = state.generation
        here = {
            "wall_s": state.elapsed,
            "cpu_s": time.process_time() - self._cpu,
            "evaluated": state.evaluated_here,
            "legs": 1,
        }
        self.total = {key: self._before[key] + value for key, value in here.items()}
        if self._path is not None:
            part = self._path.with_suffix(".part")
            part.write_text(json.dumps(self.total), encoding="utf-8")
            part.replace(self._path)


def search(tool: int, *, quick: bool, folder: Path | None) -> xr.Dataset:
    """Run or continue the search of a tool; attributes ``search_…`` hold the time and evaluations of all legs.

    The folder of the generations is named after the study's digest: a search that was defined otherwise is never
    continued.
    """
    wanted = study(tool, quick=quick)
    name = f"tool{tool}-{wanted.digest[:8]}"
    tally = Tally(folder / f"{name}.json" if folder is not None else None)
    dataset = optimise(
        wanted, directory=folder / name if folder is not None else None, resume=folder is not None, progress=tally
    )
    return dataset.assign_attrs({f"search_{key}": value for key, value in tally.total.items()})
