"""Trains whose meshes are one contact problem: parallel paths, floating gears, yielding pins (C9 of docs/theory.md)."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, scene_lines
from gearbench.contact.equilibrium import Balance, MeshAt, Statics, balance
from gearbench.contact.panels import CLOSE, LONGEST, panel_ends
from gearbench.contact.phases import gauss_phases, uniform_phases
from gearbench.contact.transitions import CLOSER, GAUSS_POINTS, transitions
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.linkage import Linkage
from gearbench.results.cycle import MICROMETRES, Phases
from gearbench.results.solved import Solved
from gearbench.scene import Load, Resolution, Scene
from gearbench.schema import changed
from gearbench.threads import single_threaded_blas

if TYPE_CHECKING:
    import xarray as xr

#: Load of a mesh over that its contact lines were made for, from which they are made once more, and how often.
HEAVIER, ROUNDS = 1.2, 4


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedTrain:
    """A train solved over one cycle of its mesh frequency.

    Parameters
    ----------
    scene
        Gears, meshes, load.
    linkage
        How the meshes hang together.
    phases
        Phases of the first mesh.
    meshes
        Each mesh under the force that it has at each position, by its name.
    balance
        Forces and motions.
    even
        Force of each mesh where all paths share alike, (mesh,) [N].
    """

    scene: Scene
    linkage: Linkage
    phases: Phases
    meshes: Mapping[str, Solved]
    balance: Balance
    even: NDArray


def check_train(scene: Scene) -> None:
    """Refuse trains that cannot be one contact problem.

    Raises
    ------
    InputError
        Naming what does not fit.
    """
    train = scene.geometry
    rates = {mesh.name: train.mesh_rate(mesh.name) for mesh in train.meshes}
    first = next(iter(rates.values()))
    for name, rate in rates.items():
        if not np.isclose(rate, first, rtol=1e-12):
            allowed = f"must be that of the first, {first:g} z n, where paths are parallel"
            raise InputError("meshes", f"mesh frequency of {name}, {rate:g} z n", allowed)
    train.check_assembly(coast=scene.load.coast)
    assert scene.train is not None
    scene.train.linkage(train).check()


@single_threaded_blas()
def solve_train(scene: Scene) -> SolvedTrain:
    """Contact of all meshes of a ``coupled`` scene, at phases that suit all of them.

    Raises
    ------
    InputError, ConvergenceError
        As ``simulate``.
    """
    check_train(scene)
    assert scene.train is not None
    coast = scene.load.coast
    train, scenes = scene.geometry, scene.meshes
    linkage = scene.train.linkage(train, coast=coast)
    shift = train.phases(coast=coast)
    phases = _phases(scenes, shift)
    even = np.array([own.F_bt for own in scenes.values()])
    statics = Statics(
        rows=linkage.rows, stiffness=linkage.stiffness, force=linkage.force(scene.load.torque), offset=np.zeros(len(even))
    )
    for _ in range(ROUNDS):
        at = {name: _mesh(own, (phases.phase + shift[name]) % 1.0) for name, own in scenes.items()}
        found = balance([mesh for _, mesh in at.values()], statics)
        heavy = found.force.max(axis=0) / [mesh.nominal for _, mesh in at.values()]
        # off the line of action the load decides how far contact lines reach
        again = {name for (name, own), most in zip(scenes.items(), heavy, strict=True)
                 if most > HEAVIER and own.effect("off_line_contact") is not None}  # fmt: skip
        if not again:
            break
        scenes = {
            name: _under(own, most) if name in again else own
            for (name, own), most in zip(scenes.items(), heavy, strict=True)
        }
    meshes = {
        name: Solved(scene=scenes[name], lines=lines, weight=phases.weight, problem=mesh.problem, solution=own, at=phases)
        for (name, (lines, mesh)), own in zip(at.items(), found.solutions, strict=True)
    }
    return SolvedTrain(scene=scene, linkage=linkage, phases=phases, meshes=meshes, balance=found, even=even)


def _under(scene: Scene, share: float) -> Scene:
    return changed(scene, load=Load(torque=share * scene.load.torque))


def _phases(scenes: Mapping[str, Scene], shift: Mapping[str, float]) -> Phases:
    """Phases of the first mesh, on panels between the changes of contact of all of them."""
    first, *_ = scenes.values()
    resolution = first.resolution
    if resolution.accuracy is not None:
        raise InputError("resolution.accuracy", resolution.accuracy, "is for one mesh: here give segments")
    if resolution.positions is not None:
        phase, weight = uniform_phases(resolution.positions)
        return Phases(phase=phase, weight=weight, size=None)
    size = resolution.gauss_points or GAUSS_POINTS
    exact = size > GAUSS_POINTS
    changes = []
    for name, scene in scenes.items():
        own = transitions(changed(scene, resolution=Resolution()), exact=exact)
        changes += [each._replace(phase=(each.phase - shift[name]) % 1.0 % 1.0) for each in own]
    longest = LONGEST if first.pair.meshing.overlap_ratio else 1.0
    phase, weight = gauss_phases(panel_ends(changes, longest, CLOSER if exact else CLOSE), size)
    return Phases(phase=phase, weight=weight, size=size)


def _mesh(scene: Scene, phase: NDArray) -> tuple[ContactLines, MeshAt]:
    """Contact of a mesh by itself at its own phases."""
    lines = scene_lines(scene, phase)
    cos_b = float(np.cos(scene.pair.meshing.beta_b))
    return lines, MeshAt(problem=assemble(scene, lines), nominal=scene.F_bt, cos_b=cos_b)
