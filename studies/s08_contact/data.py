"""Data of the study: mesh cycles of spur pairs by contact finite elements and by contact on the line of action."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.pair import Member, Pair
from gearbench.lazy import xr
from gearbench.results.cycle import MeshCycle
from gearbench.results.responses import described
from gearbench.scene import Load, Resolution, Scene
from gearbench.validation.contact import model_cycle

PHASES = 20
_TEETH = (ToothBending(model="solid"), GearBody(), Hertz())


@dataclass(frozen=True, kw_only=True)
class Case:
    """Scene with ascending torques.

    Parameters
    ----------
    scene
        The pair with its modifications.
    torques
        Torques on the pinion [N·m].
    width_factor
        Ratio of the deflection of teeth with free end faces to that in plane strain; 1 if not known.
    """

    scene: Scene
    torques: tuple[float, ...]
    width_factor: float = 1.0


def _pair(m: float, width: float, distance: float, bores: tuple[float, float], teeth: tuple[int, int], **shape) -> Pair:
    pinion, wheel = (Member(teeth=z, bore_diameter=d, **shape) for z, d in zip(teeth, bores, strict=True))
    return Pair(normal_module=m, face_width=width, centre_distance=distance, pinion=pinion, wheel=wheel)


def _scene(name: str, pair: Pair, torque: float, *gaps: TipRelief) -> Scene:
    return Scene(name=name, pair=pair, load=Load(torque=torque), effects=(*_TEETH, *gaps))


_SPUR = _pair(2.0, 20.0, 65.0, (25.0, 40.0), (25, 40))
_HCR = _pair(2.5, 25.0, 136.25, (50.0, 130.0), (36, 73), addendum=1.3, dedendum=1.6)
_NASA = _pair(3.175, 6.35, 88.9, (30.0, 30.0), (28, 28), dedendum=1.35)
_RIM = replace(_pair(2.54, 20.0, 121.92, (66.4, 147.7), (32, 64), dedendum=1.35), pressure_angle=25.0)

_RELIEF = TipRelief(amount=20.0, length=1.0)

#: Cases by name. The factor 1.0278 is the ratio of 3D to plane strain at four phases, from another FE program.
CASES = {
    "spur": Case(scene=_scene("spur", _SPUR, 100.0), torques=(100.0,), width_factor=1.0278),
    "spur_loads": Case(scene=_scene("spur_loads", _SPUR, 100.0), torques=(50.0, 200.0), width_factor=1.0278),
    "spur_relief": Case(
        scene=_scene("spur_relief", _SPUR, 100.0, _RELIEF), torques=(50.0, 100.0, 200.0), width_factor=1.0278
    ),
    "hcr_spur": Case(scene=_scene("hcr_spur", _HCR, 250.0, TipRelief(amount=15.0, length=1.0)), torques=(250.0,)),
    "nasa_28": Case(scene=_scene("nasa_28", _NASA, 71.8, TipRelief(amount=23.0, length=2.0)), torques=(71.8,)),
    "thin_rim": Case(scene=_scene("thin_rim", _RIM, 180.0), torques=(180.0,)),
}


def scene(name: str = "spur") -> Scene:
    """Scene of a case."""
    return CASES[name].scene


def curves(name: str, phases: int = PHASES, workers: int = 2) -> xr.Dataset:
    """Compute a case by contact finite elements; see ``fem_reference.contact.cycle.contact_cycle``."""
    from fem_reference.contact.cycle import contact_cycle

    case = CASES[name]
    return contact_cycle(case.scene, phases, torques=case.torques, width_factor=case.width_factor, workers=workers)


def outside_path(dataset: xr.Dataset, pair: Pair) -> np.ndarray:
    """Share of the load outside the path of contact, (torque, position)."""
    turns = dataset.mesh_phase.values[:, None] + dataset.pair_index.values
    outside = (turns < 0) | (turns > pair.meshing.transverse_contact_ratio)
    return (dataset.load_share.values * outside).sum(axis=-1)


def compute(*, quick: bool = False) -> xr.Dataset:
    """Compute the curves of all cases and torques by contact finite elements, and by fast teeth on and off the line."""
    return compare(["spur"], 4) if quick else compare(list(CASES), PHASES)


def compare(names: Sequence[str], phases: int = PHASES) -> xr.Dataset:
    """Compute the curves of some cases, as ``compute``."""
    from fem_reference.contact.cycle import halfway

    rows: dict[str, list] = {
        key: [] for key in ("fe", "k", "line", "line_k", "off_line", "outside", "error", "seconds")
    }
    labels, torques = [], []
    for name in names:
        found, case = curves(name, phases), CASES[name]
        for i, torque in enumerate(case.torques):
            at = halfway(found.isel(torque=i), case.scene.pair)
            line = fast(case.scene, torque, at)
            labels.append(name)
            torques.append(torque)
            rows["fe"].append(found.transmission_error.values[i])
            rows["k"].append(found.mesh_stiffness.values[i])
            rows["line"].append(line.transmission_error)
            rows["line_k"].append(line.mesh_stiffness)
            rows["off_line"].append(fast(case.scene, torque, at, OffLineContact()).transmission_error)
            rows["outside"].append(outside_path(found, case.scene.pair)[i])
            rows["error"].append(found.transmission_error_uncertainty.values[i])
    grid = ("design", "position")
    variables = {
        "transmission_error": (grid, rows["fe"]),
        "mesh_stiffness": (grid, rows["k"]),
        "line_transmission_error": (grid, rows["line"]),
        "line_mesh_stiffness": (grid, rows["line_k"]),
        "off_line_transmission_error": (grid, rows["off_line"]),
        "share_outside_path": (grid, rows["outside"]),
        "transmission_error_uncertainty": (("design",), rows["error"]),
    }
    coords = {"mesh_phase": ("position", (np.arange(phases) + 0.5) / phases), "case": ("design", labels)}
    return xr.Dataset(described(variables), coords={**described(coords), "torque": ("design", torques)})


def fast(scene: Scene, torque: float, phases: NDArray, *extra: OffLineContact) -> MeshCycle:
    """Compute the mesh cycle of fast teeth at mesh phases, (position,)."""
    effects, resolution = (*scene.effects, *extra), Resolution(positions=len(phases))
    return model_cycle(replace(scene, load=Load(torque=torque), effects=effects, resolution=resolution), phases)
