"""The 25/40 pair with finite face width by contact finite elements: light loads, reliefs, a helix angle of 15°."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem_reference.contact.cycle import contact_cycle, halfway
from fem_reference.contact.laying import Fineness
from fem_reference.contact.spatial import SpatialSettings
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.lazy import xr
from gearbench.results.responses import described
from gearbench.scene import Load, Resolution, Scene
from gearbench.validation.contact import model_cycle
from studies.s08_contact.data import scene
from studies.s08_contact.findings import off_line

#: Relief of both gears, amount [µm] and length [mm]. Spur and helical pair have the same teeth, module and bores.
_RELIEF = {"": None, "relief": (20.0, 1.0), "short_relief": (10.0, 0.5), "long_relief": (20.0, 2.0)}


@dataclass(frozen=True, kw_only=True)
class Wide:
    """Curves stored in one file.

    Parameters
    ----------
    curves
        Scene → torques on the pinion [N·m].
    phases
        Number of phases.
    fineness
        Fineness of the strips.
    softer
        Ratio of the deflection with layers that are thin across the face to that with the layers of ``fineness``; gaps
        are not scaled by it.
    """

    curves: dict[str, tuple[float, ...]]
    phases: int
    fineness: Fineness
    softer: float = 1.0


#: File → its curves. Layers of the spur gears are three modules thick, which gives the same shape at a fourth of the
#: cost.
WIDE = {
    "width_spur": Wide(
        curves={
            "spur": (10.0, 50.0), "spur_relief": (10.0, 50.0, 100.0, 200.0), "spur_short_relief": (50.0, 100.0),
            "spur_long_relief": (50.0, 100.0),
        },
        phases=20, fineness=replace(Fineness().coarser(), layer=3.0, cells=32, contact=0.33), softer=1.007,
    ),
    "width_helical": Wide(
        curves={"helical": (100.0,)}, phases=12, fineness=replace(Fineness().coarser(), layer=0.6)
    ),
    "width_helical_thicker": Wide(
        curves={"helical": (200.0,), "helical_relief": (100.0,)}, phases=12,
        fineness=replace(Fineness().coarser(), layer=0.7),
    ),
}  # fmt: skip


def wide_scene(name: str) -> Scene:
    """Scene of a curve; its name is "spur" or "helical", and optionally "_" with a relief."""
    kind, _, relief = name.partition("_")
    given, shape = scene("spur"), _RELIEF[relief]
    pair = given.pair
    if kind == "helical":
        pair = replace(pair, helix_angle=15.0, centre_distance=pair.centre_distance / math.cos(math.radians(15.0)))
    gaps = () if shape is None else (TipRelief(amount=shape[0], length=shape[1]),)
    return replace(given, name=name, pair=pair, effects=(*given.effects, *gaps))


def wide(name: str) -> xr.Dataset:
    """Compute all curves of a file of ``WIDE``, (curve, position), without mesh refinement for error bars."""
    chosen, rows = WIDE[name], []
    for which, torques in chosen.curves.items():
        settings = SpatialSettings(fineness=chosen.fineness)
        found = contact_cycle(wide_scene(which), chosen.phases, torques=torques, settings=settings, error_bar=math.inf)
        q, k = found.transmission_error.values, found.mesh_stiffness.values
        rows += [(which, *each) for each in zip(torques, q, k, strict=True)]
    return collected(name, rows)


def collected(name: str, rows: list[tuple[str, float, NDArray, NDArray]]) -> xr.Dataset:
    """Dataset of curves, given by scene, torque [N·m], STE [µm] and stiffness [N/µm], (position,)."""
    chosen = WIDE[name]
    scenes, torques, ste, stiffness = (list(each) for each in zip(*rows, strict=True))
    r_b = [wide_scene(which).pair.gears[0].base_radius for which in scenes]
    q, k, grid = np.stack(ste), np.stack(stiffness), ("curve", "position")
    variables = {
        "transmission_error": (grid, q + (chosen.softer - 1) * 1e3 * (np.array(torques) / r_b)[:, None] / k),
        "mesh_stiffness": (grid, k / chosen.softer),
    }
    phase = (np.arange(chosen.phases) + 0.5) / chosen.phases
    coords = {"mesh_phase": ("position", phase), "case": ("curve", scenes)}
    return xr.Dataset(described(variables), coords={**described(coords), "torque": ("curve", torques)})


def loaded(name: str, torque: float) -> Scene:
    """Scene of a curve with its torque [N·m]."""
    return replace(wide_scene(name), load=Load(torque=torque))


def fast_alike(here: xr.Dataset, *extra: OffLineContact) -> NDArray:
    """STE of the fast teeth at the gear positions of a curve by contact finite elements, (position,) [µm]."""
    given = loaded(str(here.case.values), float(here.torque))
    resolution = Resolution(positions=here.sizes["position"])
    given = replace(given, effects=(*given.effects, *extra), resolution=resolution)
    return model_cycle(given, halfway(here, given.pair)).transmission_error


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check the current fast teeth with contact off the line against every curve."""
    found = []
    for row in range(dataset.sizes["curve"]):
        here = dataset.isel(curve=row)
        found += off_line(here.assign(off_line_transmission_error=("position", fast_alike(here, OffLineContact()))))
    return found
