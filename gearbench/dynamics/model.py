"""The dynamic model of a scene: its meshes, their excitation, the modes of its system."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.balance import Excitation, receptances
from gearbench.dynamics.loaded_mesh import LoadedMesh, loaded_mesh
from gearbench.dynamics.modes import Modes, modes
from gearbench.errors import InputError
from gearbench.scene import Scene
from gearbench.system.mechanics import Mechanics, mechanics, shafts_at_rest, two_wheels


@dataclass(frozen=True, kw_only=True)
class Group:
    """Meshes of one mesh frequency, solved together.

    Parameters
    ----------
    meshes
        Their numbers.
    rate
        Mesh frequency over the pinion's frequency of rotation.
    phase
        Mesh phase of each when that of the scene's own pair is zero [mesh periods].
    """

    meshes: NDArray
    rate: float
    phase: NDArray


@dataclass(frozen=True, kw_only=True)
class Model:
    """What ``response`` solves, at any speed.

    Parameters
    ----------
    scene
        It has a system.
    """

    scene: Scene

    def __post_init__(self) -> None:
        if self.scene.one_load.system is None:
            raise InputError("system", "missing", "the response needs [system]: shafts, or inertias of the two wheels")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the meshes; the scene's own is "pair"."""
        return tuple(name or "pair" for name in self.scene.pairs)

    @cached_property
    def cycles(self) -> tuple[LoadedMesh, ...]:
        """Contact of each mesh under its mean force."""
        return tuple(loaded_mesh(self.scene, name) for name in self.scene.pairs)

    @property
    def force(self) -> NDArray:
        """Mean force of each mesh along the line of action (mesh,) [N]."""
        return np.array([cycle.scene.F_bt for cycle in self.cycles])

    @cached_property
    def mechanics(self) -> Mechanics:
        """Matrices, bearings at rest under the loads of the scene's own pair as they are."""
        scene = self.scene
        if scene.system is not None and not scene.has_shafts:
            return two_wheels(scene.system, scene.pair)
        box = scene.gearbox
        settled = dict(enumerate(shafts_at_rest(box)))
        for gear in self.cycles[0].gears:
            settled |= dict.fromkeys(gear.settled.structure.shafts, gear.settled)
        return mechanics(box, tuple(settled.values()))

    @cached_property
    def stiffness(self) -> NDArray:
        """k̄ (mesh,) [N/mm]."""
        return np.array([cycle.mean_stiffness for cycle in self.cycles])

    @cached_property
    def modes(self) -> Modes:
        """Modes of the system with its mean mesh stiffnesses."""
        assert self.scene.system is not None
        return modes(self.mechanics, self.stiffness, self.scene.system.damping_ratio)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """Meshes by their mesh frequency, in order of their first."""
        scene = self.scene
        if not scene.has_shafts:
            return (Group(meshes=np.array([0]), rate=float(scene.pair.pinion.teeth), phase=np.zeros(1)),)
        rates = np.array([scene.gearbox.mesh_rate(name) for name in scene.pairs])
        phases = np.array([scene.gearbox.phase(name) for name in scene.pairs])
        groups, left = [], list(range(len(rates)))
        while left:
            same = np.array([m for m in left if np.isclose(rates[m], rates[left[0]], rtol=1e-9)])
            groups.append(Group(meshes=same, rate=float(rates[left[0]]), phase=phases[same]))
            left = [m for m in left if m not in same]
        return tuple(groups)

    def excitation(self, group: Group, harmonics: int) -> Excitation:
        """What excites the meshes of a group, each at its phase: ŷ_n e^{2πinφ}."""
        stiffness, error = [], []
        for mesh, phase in zip(group.meshes, group.phase, strict=True):
            cycle = self.cycles[mesh]
            rows = cycle.rows(2 * harmonics) * np.exp(2j * np.pi * np.arange(2 * harmonics + 1) * phase)[:, None]
            stiffness.append(rows @ cycle.stiffness)
            error.append(rows[: harmonics + 1] @ cycle.error)
        return Excitation(stiffness=np.array(stiffness), error=np.array(error), force=self.force[group.meshes])

    def omega(self, group: Group, speed: NDArray) -> NDArray:
        """Mesh frequency (speed,) [rad/s] of a group at speeds of the pinion [1/min]."""
        return 2 * np.pi / 60 * group.rate * speed

    def receptances(self, group: Group, speed: NDArray, harmonics: int) -> NDArray:
        """ĥ_c (speed, harmonic, mesh, mesh) [mm/N] of a group."""
        return receptances(self.modes, group.meshes, self.omega(group, speed), harmonics)
