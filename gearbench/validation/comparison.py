"""Compare scenes with their finite element references: one Dataset with both sides' curves, errors, times."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.contact.assemble import mesh_phases, scene_lines
from gearbench.effort.clock import timed, times, unseen
from gearbench.errors import InputError
from gearbench.geometry.role import Role
from gearbench.results.provenance import provenance, run_provenance
from gearbench.results.responses import described
from gearbench.scene import Scene
from gearbench.simulation import simulate
from gearbench.validation.dataset import CYCLE, stack
from gearbench.validation.mac import compare_shapes, line_mac
from gearbench.validation.reference import meshed_flanks, reference_scene, smooth_effects
from gearbench.validation.ste_error import CURVES, HARMONICS, OUTPUTS, cycle_errors

if TYPE_CHECKING:
    import xarray as xr

#: Timed runs; medians count.
REPEATS = 5
MODELS, GEARS = ("fast", "reference"), ("pinion", "wheel")


def compare(scene: Scene, accuracy: float = 0.01) -> xr.Dataset:
    """Compare a scene with its finite element reference.

    Parameters
    ----------
    accuracy
        Relative error of the reference's compliance that its meshes are refined to.

    Returns
    -------
    Dataset with the dimensions ``model`` (fast, reference), ``position``, ``pair``, ``harmonic``, ``gear``,
    ``load_height``, ``load_face``; both scenes as TOML in the attributes.

    Raises
    ------
    InputError
        If the scene has no reference, see ``reference_scene``.
    """
    import xarray as xr

    begun = time.perf_counter()
    reference = reference_scene(scene, accuracy)
    fast_run, first_call = timed(lambda: simulate(scene, outputs=OUTPUTS))
    reference_run = simulate(reference, outputs=OUTPUTS)
    variables: dict[str, tuple] = {
        name: (("model", *fast_run[name].dims), np.array([fast_run[name].values, reference_run[name].values]))
        for name in (*CURVES, "load_share")
    }
    coords: dict[str, tuple] = {
        "model": ("model", list(MODELS)),
        "gear": ("gear", list(GEARS)),
        "harmonic": ("harmonic", np.arange(1, HARMONICS + 1)),
        **{name: (fast_run[name].dims, fast_run[name].values) for name in CYCLE},
    }
    variables |= cycle_errors(fast_run, reference_run) | _shapes(scene, reference) | _reference(reference)
    variables |= _times(scene, reference, variables["reference_seconds"][1].sum()) | {
        "first_call_seconds": ((), first_call.seconds)
    }
    attrs = provenance(scene, wall_time=time.perf_counter() - begun) | _reference_attrs(reference)
    return xr.Dataset(described(variables), described(coords), attrs)


def _shapes(scene: Scene, reference: Scene) -> dict[str, tuple]:
    found = [compare_shapes(scene, reference, role) for role in Role]
    over = ("gear", "load_height", "load_face")
    criterion = np.array([each.mac for each in found])
    lines = np.array([line_mac(scene, reference, role) for role in Role])
    return {
        "load_radius": (("gear", "load_height"), np.array([each.loads.radius for each in found])),
        "load_position": (("load_face",), found[0].loads.y),
        "mac": (over, criterion),
        "mac_worst": (("gear",), criterion.min(axis=(1, 2))),
        "mac_mean": (("gear",), criterion.mean(axis=(1, 2))),
        "line_mac_worst": (("gear",), lines[:, 0]),
        "line_mac_mean": (("gear",), lines[:, 1]),
        "norm_ratio": (over, np.array([each.norm_ratio for each in found])),
        "compliance_ratio": (("gear",), np.array([each.compliance_ratio for each in found])),
    }


def _reference(reference: Scene) -> dict[str, tuple]:
    """Finite elements of both gears."""
    flanks = meshed_flanks(reference)
    of_gear: dict[str, list[Any]] = {
        "reference_error": [flank.error for flank in flanks],
        "reference_unknowns": [flank.attrs["unknowns"] for flank in flanks],
        "reference_meshes": [flank.attrs["meshes"] for flank in flanks],
        "reference_seconds": [flank.attrs["seconds"] for flank in flanks],
        "reference_cached": [int(flank.attrs.get("cached", False)) for flank in flanks],
    }
    return {name: (("gear",), np.array(values)) for name, values in of_gear.items()}


def _times(scene: Scene, reference: Scene, reference_compliance: float) -> dict[str, tuple]:
    """Wall times; that of the reference's compliance is the one stored when it was computed."""
    compliance = [compliance_seconds(scene), reference_compliance]
    simulation = [times(lambda s=s: simulate(s), REPEATS).seconds for s in (scene, reference)]
    return {
        "compliance_seconds": (("model",), np.array(compliance)),
        "simulation_seconds": (("model",), np.array(simulation)),
    }


def compliance_seconds(scene: Scene, repeats: int = REPEATS) -> float:
    """Wall time [s] of the smooth compliance of a pair that was not seen before, on the lines of all positions."""
    fresh = iter([unseen(scene, i + 1) for i in range(repeats)])
    return times(lambda: smooth_compliance(next(fresh)), repeats).seconds


def smooth_compliance(scene: Scene) -> None:
    """Compute the smooth compliances of ``scene`` on all its contact lines."""
    lines = scene_lines(scene, mesh_phases(scene)[0])
    for effect in smooth_effects(scene):
        effect.compliance(lines, scene.effects_by_name)


def _reference_attrs(reference: Scene) -> dict[str, str]:
    attrs = meshed_flanks(reference)[0].attrs
    return {
        "reference_scene": reference.to_toml(),
        "reference_solver": str(attrs["solver"]),
        "reference_element": str(attrs["element"]),
        "reference_versions": ", ".join(_installed("gmsh", "scikit-fem", "pypardiso")),
    }


def _installed(*packages: str) -> list[str]:
    """Names and versions of those packages that are there."""
    found = []
    for package in packages:
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return found


def validate(
    scenes: Sequence[Scene], accuracy: float = 0.01, progress: Callable[[str], object] = lambda _: None
) -> xr.Dataset:
    """Compare several scenes, each with its reference, along the dimension ``scene``.

    ``progress`` is called with the name of each scene before its turn.

    Raises
    ------
    InputError
        As ``compare``, before anything is computed.
    """
    begun = time.perf_counter()
    for name, scene in zip(labels(scenes), scenes, strict=True):
        check(scene, accuracy, name)
    found = []
    for name, scene in zip(labels(scenes), scenes, strict=True):
        progress(name)
        found.append(compare(scene, accuracy))
    return stack(found, labels(scenes)).assign_attrs(run_provenance(wall_time=time.perf_counter() - begun))


def check(scene: Scene, accuracy: float, file: str) -> None:
    """Refuse a scene that has no reference, naming the file it comes from."""
    try:
        reference_scene(scene, accuracy)
    except InputError as error:
        raise error.in_file(file) from None


def labels(scenes: Sequence[Scene]) -> list[str]:
    """Name of each scene, numbered where it has none or shares it."""
    names = [scene.name or "scene" for scene in scenes]
    return [name if names.count(name) == 1 else f"{name} #{i + 1}" for i, name in enumerate(names)]
