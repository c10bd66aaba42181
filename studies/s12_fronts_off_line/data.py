"""Data of the study: rows of Table 2 and gears of the fronts, contact on and off the line, plate and solid teeth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gearbench.effects.base import Effect
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.library.garambois2017 import table_2
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.study import Robustness
from gearbench.scene import Resolution, Scene
from gearbench.simulation import simulate
from studies.s06_paper_fronts.search import TOOLS, kept_search
from studies.s06_paper_fronts.search import study as plate_study
from studies.s10_fronts_on_bodies.data import MODELS, means, on_body, study

#: Contact models: on the line of action, and off it.
CONTACTS = ("line", "off_line")
#: Values per gear and their units: means over the error samples, and RMS of the STE without errors.
NAMES = {"m_k": "%", "m_ste": "µm", "rms": "µm"}


def scene(number: int = 0) -> Scene:
    """Scene of a row of Table 2 at the resolution of the searches."""
    return table_2()[number].scene(errors=True, resolution=Resolution(**plate_study(1).base["resolution"]))


def variant(scene: Scene, model: str, contact: str) -> Scene:
    """Return a scene of the paper with one of the ``MODELS`` and one of the ``CONTACTS``."""
    found = on_body(scene) if model == "solid" else scene
    extra: tuple[Effect, ...] = (OffLineContact(),) if contact == "off_line" else ()
    return replace(found, effects=(*found.effects, *extra))


def judged(scene: Scene, r: Robustness) -> np.ndarray:
    """Compute ``NAMES`` of a scene with every model and contact, (name, model, contact); NaN if a model refuses it."""
    found = np.full((len(NAMES), len(MODELS), len(CONTACTS)), np.nan)
    for i, model in enumerate(MODELS):
        for j, contact in enumerate(CONTACTS):
            try:
                changed = variant(scene, model, contact)
            except InputError:  # the gear body is too thin
                continue
            nominal = replace(changed, effects=tuple(e for e in changed.effects if e.name != "manufacturing_errors"))
            rms = float(simulate(nominal, outputs=("transmission_error_rms",)).transmission_error_rms)
            found[:, i, j] = [*means(changed, r), rms]
    return found


def compute(*, quick: bool = False, folder: Path | None = None) -> xr.Dataset:
    """Evaluate all rows and fronts; the searches with the plate are kept in ``folder``."""
    table = table_2()[:4] if quick else table_2()
    r = plate_study(1, quick=quick).robustness
    rows = _columns("row", [scene(i) for i in range(len(table))], r)
    rows |= {f"row_{name}_paper": ("row", [getattr(row, name) for row in table]) for name in ("m_k", "m_ste")}
    rows["row_module"] = ("row", [row.module for row in table])
    ratios = [scene(i).pair.meshing.total_contact_ratio for i in range(len(table))]
    rows["row_contact_ratio"] = ("row", ratios)
    tools, gears = [], []
    for tool in TOOLS:
        found = kept_search(study(tool, "plate", quick=quick), f"plate{tool}", folder)
        numbers = np.flatnonzero(found["on_front"].values)
        gears += [Designs(found).scene(int(i)) for i in numbers]
        tools += [tool] * len(numbers)
    designs = _columns("design", gears, r) | {"design_tool": ("design", tools)}
    designs["design_contact_ratio"] = ("design", [gear.pair.meshing.total_contact_ratio for gear in gears])
    names = np.array([row.gear for row in table], dtype=object)
    dataset = xr.Dataset(rows | designs, coords={"row": names, "model": list(MODELS), "contact": list(CONTACTS)})
    return dataset.assign_attrs(quick=int(quick), samples=r.samples)


def _columns(dim: str, scenes: Sequence[Scene], r: Robustness) -> dict[str, tuple]:
    values = np.array([judged(each, r) for each in scenes])
    return {
        f"{dim}_{name}": ((dim, "model", "contact"), values[:, i], {"units": unit})
        for i, (name, unit) in enumerate(NAMES.items())
    }
