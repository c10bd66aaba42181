"""Meshes of a compared pair or planetary set; the mesh cycle of a set in the form of that of a pair."""

from __future__ import annotations

from collections.abc import Mapping

from gearbench.geometry.names import PAIR
from gearbench.lazy import xr
from gearbench.results.cycle import Phases
from gearbench.results.responses import response
from gearbench.scene import Scene
from gearbench.trains.solve import mesh_scenes, solve_train
from gearbench.validation.ste_error import CURVES


def meshes_of(scene: Scene) -> dict[str, Scene]:
    """Scene of each mesh by name; of a pair, the scene itself."""
    return mesh_scenes(scene.single_load) if scene.coupled else {PAIR: scene}


def distinct(meshes: Mapping[str, Scene]) -> dict[str, Scene]:
    """The meshes of different pairs: one with the sun and one with the ring for all planets."""
    names: dict[tuple, str] = {}
    for name, mesh_scene in meshes.items():
        names.setdefault((mesh_scene.pair, mesh_scene.load.coast), name)
    return {name: meshes[name] for name in names.values()}


def members(meshes: Mapping[str, Scene]) -> list[tuple[str, str, int]]:
    """Gears of the ``distinct`` meshes: name, mesh, and index in it; a planet is listed at both its mates."""
    both = [(name, scene.gear_names, index) for name, scene in distinct(meshes).items() for index in (0, 1)]
    names = [gears[index] for _, gears, index in both]
    return [
        (gear if names.count(gear) == 1 else f"{gear} at {gears[1 - index]}", mesh, index)
        for gear, (mesh, gears, index) in zip(names, both, strict=True)
    ]


def set_cycle(scene: Scene, meshes: Mapping[str, Scene] | None = None, phases: Phases | None = None) -> xr.Dataset:
    """Mesh cycle of a set as a Dataset like that of a pair, with load sharing and K_γ; parameters as ``solve_train``.

    Transmission error and stiffness are those of the set, on the base circle of the first gear.
    """
    solved = solve_train(scene, meshes=meshes, phases=phases)
    cycle, sharing = solved.cycles[0], solved.cycle.sharing
    variables = {name: (("position",), getattr(cycle, name)) for name in CURVES}
    numbers = [f"{name}_{part}" for name in CURVES for part in ("mean", "peak_to_peak")]
    variables |= {name: ((), response(name).reduce(cycle)) for name in numbers}
    variables |= {"load_sharing": (("position", "mesh"), sharing), "mesh_load_factor": ((), sharing.max())}
    coords = {name: ("position", values) for name, values in solved.phases.coordinates.items()}
    return xr.Dataset(variables, {**coords, "mesh": list(solved.meshes)})
