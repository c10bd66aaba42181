"""Dynamic model of a scene: its meshes, their excitation, and the modes of the system.

``LinearModel`` is the base of ``Model``, for scenes with ``[system]``, and of ``train_model.TrainModel``, for meshes
that are one contact problem. A row is one relative motion of the gears of a mesh (approach, tilt or bending), together
with the force that does work on it. Meshes of the same frequency form a ``Group``; orders are multiples of its
frequency.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from gearbench.dynamics import surroundings
from gearbench.dynamics.balance import Excitation
from gearbench.dynamics.loaded_mesh import FRICTION, LoadedMesh, loaded_mesh
from gearbench.dynamics.modes import Modes, modes
from gearbench.errors import InputError
from gearbench.results.outputs import output
from gearbench.scene import Scene
from gearbench.system.mechanics import DIRECTIONS, Mechanics, mechanics, static_equilibrium, two_wheels
from gearbench.system.static import StaticState

#: Relative motions of gears on shafts: approach, tilt, bending. Bearing forces are off by 5 % with two, 2 % with three.
ROWS = 3
#: Largest n + m of the combinations n f_1 ± m f_2 of the mesh frequencies of one group (stepped planets); further ones
#: change forces by less than 0.5 %. ``steady`` selects the combinations of two groups.
COMBINED = 4
#: A remark names the orders of the transmission error whose noise floor exceeds this share of their amplitude.
UNCERTAIN = 0.1
#: Name of this output.
TRANSMISSION_ERROR = "transmission_error"

#: Variables of a Dataset: dimensions and values.
Variables = dict[str, tuple[tuple[str, ...], Any]]


@dataclass(frozen=True, kw_only=True)
class Group:
    """Meshes solved together, since they share a mesh frequency or one contact problem.

    Parameters
    ----------
    meshes
        Indices of the meshes.
    rate
        Frequency of order 1, relative to the pinion's frequency of rotation.
    phase
        Phase of each mesh when the scene's own pair is at phase zero (mesh,) [mesh periods].
    periods
        Number of mesh periods of each mesh in a period of order 1, (mesh,); the default (1,) is for any number of
        meshes of one frequency.
    """

    meshes: NDArray
    rate: float
    phase: NDArray
    periods: tuple[int, ...] = (1,)

    def orders(self, harmonics: int) -> NDArray:
        """Orders kept, in ascending order: 0, the first ``harmonics`` of each mesh frequency, and combinations."""
        mesh_frequencies = sorted(set(self.periods))
        of_meshes = np.multiply.outer(mesh_frequencies, np.arange(harmonics + 1)).ravel()
        combined = [
            abs(n * a + sign * m * b)
            for a, b in combinations(mesh_frequencies, 2)
            for n in range(1, COMBINED)
            for m in range(1, COMBINED + 1 - n)
            for sign in (-1, 1)
        ]
        return np.unique([*of_meshes, *(order for order in combined if order <= of_meshes.max())])


@dataclass(frozen=True, kw_only=True, eq=False)
class Vibration:
    """Steady motion of a model at each speed, by the orders of its mesh frequencies and their combinations.

    Parameters
    ----------
    harmonics
        Number of orders of each mesh frequency.
    index
        Orders as multiples of the mesh frequencies (order, frequency), without order zero.
    omega
        Frequency of each order (speed, order) [rad/s]; a difference of two frequencies may be negative.
    largest
        Largest force of each mesh (speed, mesh) [N].
    force
        Complex orders of the mesh forces (speed, mesh, order) [N].
    at_bearings
        Complex orders at the bearings (speed, bearing, 3, order): forces for ``Model``, motions of the bodies for
        ``TrainModel``.
    """

    harmonics: int
    index: NDArray
    omega: NDArray
    largest: NDArray
    force: NDArray
    at_bearings: NDArray


@dataclass(frozen=True, kw_only=True)
class LinearModel(ABC):
    """Base class of models: meshes that excite a linear system.

    Parameters
    ----------
    scene
        Gears, load and effects.
    """

    scene: Scene

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the meshes."""

    @property
    @abstractmethod
    def force(self) -> NDArray:
        """Mean force of each mesh along the line of action (mesh,) [N]."""

    @cached_property
    @abstractmethod
    def mechanics(self) -> Mechanics:
        """Matrices of the system about its static equilibrium."""

    @property
    @abstractmethod
    def damping_ratio(self) -> float:
        """ζ of every mode."""

    @property
    def mode_damping(self) -> Sequence[tuple[float, float]]:
        """Pairs (frequency [Hz], ζ) that replace ``damping_ratio``; ζ is linear between them."""
        return ()

    @cached_property
    @abstractmethod
    def stiffness(self) -> NDArray:
        """K̄ of all meshes (row, row) [N/mm]."""

    @cached_property
    @abstractmethod
    def groups(self) -> tuple[Group, ...]:
        """Meshes grouped by mesh frequency, in the order of their first meshes."""

    @abstractmethod
    def excitation(self, group: Group, harmonics: int) -> Excitation:
        """Excitation by the meshes of a group, each at its phase."""

    @abstractmethod
    def quasi_static_approach(self, orders: int) -> NDArray:
        """Orders 0 … n of the quasi-static approach of each mesh, (mesh, n + 1) [mm]."""

    @property
    @abstractmethod
    def directions(self) -> tuple[str, ...]:
        """Directions of the forces on bearings."""

    @abstractmethod
    def on_bearings(self, vibration: Vibration) -> NDArray:
        """Loads on the bearings (speed, bearing, component, order) [N; N·mm]; ``directions`` come first."""

    @abstractmethod
    def other_variables(self, vibration: Vibration, loads: NDArray, speeds: NDArray) -> Variables:
        """Further variables over speed; ``loads`` are those of ``on_bearings``."""

    @property
    @abstractmethod
    def coords(self) -> dict[str, Any]:
        """Coordinates of ``other_variables`` and ``mode_variables``."""

    @abstractmethod
    def mode_variables(self, which: NDArray) -> Variables:
        """Variables of the modes ``which`` (indices)."""

    @abstractmethod
    def remarks(self, speeds: NDArray, harmonics: int) -> list[str]:
        """Omissions and assumptions of the model at these speeds and orders, one line each."""

    @cached_property
    def modes(self) -> Modes:
        """Modes of the system with its mean mesh stiffnesses."""
        return modes(self.mechanics, self.stiffness, self.damping_ratio, self.mode_damping)

    def stiffness_of(self, meshes: NDArray) -> NDArray:
        """K̄ of some ``meshes`` (row, row) [N/mm]."""
        rows = self.rows_of(meshes)
        return self.stiffness[np.ix_(rows, rows)]

    @property
    def rows_per_mesh(self) -> int:
        """Number of rows of a mesh; the first is its approach."""
        return len(self.stiffness) // len(self.names)

    def rows_of(self, meshes: NDArray) -> NDArray:
        """Indices of the rows of ``meshes`` among the rows of all meshes."""
        return (self.rows_per_mesh * np.asarray(meshes)[:, None] + np.arange(self.rows_per_mesh)).ravel()

    @cached_property
    def is_source(self) -> NDArray:
        """Whether a mesh is the first of its group (mesh,); the orders of a group are reported at its first mesh."""
        return np.isin(np.arange(len(self.names)), [group.meshes[0] for group in self.groups])

    @cached_property
    def rates(self) -> NDArray:
        """Frequency of harmonic 1 of each mesh, relative to the pinion's frequency of rotation (mesh,)."""
        rates = np.empty(len(self.names))
        for group in self.groups:
            rates[group.meshes] = group.rate * group.periods[0]
        return rates

    def harmonics(self, harmonics: int) -> NDArray:
        """Harmonics of a Dataset (harmonic,), up to the ``harmonics``-th of each mesh frequency.

        If one group has several mesh frequencies, harmonics are multiples of the first of these.
        """
        orders, first = self.groups[0].orders(harmonics)[1:], self.groups[0].periods[0]
        return orders if first == 1 else orders / first

    def omega(self, group: Group, speed: NDArray) -> NDArray:
        """Frequency of order 1 of a group (speed,) [rad/s] at speeds of the pinion [1/min]."""
        return 2 * np.pi / 60 * group.rate * speed

    def receptances(self, group: Group, speed: NDArray, orders: NDArray) -> NDArray:
        """Receptances ĥ (D4) of the meshes of a group at some of its ``orders`` (speed, order, row, row) [mm/N]."""
        return self.modes.mesh_receptance(self.omega(group, speed)[:, None] * orders, self.rows_of(group.meshes))


@dataclass(frozen=True, kw_only=True)
class Model(LinearModel):
    """Model of a scene with ``[system]``, at any speed.

    Parameters
    ----------
    scene
        A scene with ``[system]``.
    rows
        Number of relative motions of gears on shafts that enter the dynamics. 1: approach. 2: tilt as well, since
        forces wander over the face. 3 and more: bending over the face as well. The other motions follow
        quasi-statically.
    """

    rows: int = ROWS

    def __post_init__(self) -> None:
        if self.scene.coupled:
            # the other responses have a TrainModel for such scenes
            unsupported = "have no response over a revolution, and no mesh_force in a study"
            raise InputError("meshes", f"{len(self.scene.meshes)} in one contact problem", unsupported)
        if self.scene.one_load.system is None:
            raise InputError("system", "missing", "the response needs [system]: shafts, or inertias of the two gears")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the meshes; the scene's own is "pair"."""
        return self.scene.mesh_names

    @cached_property
    def loaded_meshes(self) -> tuple[LoadedMesh, ...]:
        """Contact of each mesh under its mean force over the mesh cycle."""
        return tuple(loaded_mesh(self.scene, name, self.rows) for name in self.scene.pairs)

    @property
    def force(self) -> NDArray:
        """Mean force of each mesh along the line of action (mesh,) [N]."""
        return np.array([mesh.scene.F_bt for mesh in self.loaded_meshes])

    @cached_property
    def mechanics(self) -> Mechanics:
        """Matrices; bearings have their stiffness in static equilibrium under the mean loads."""
        scene = self.scene
        if scene.system is not None and not scene.has_shafts:
            return two_wheels(scene.system, scene.pair)
        return mechanics(scene.gearbox, self.static_states, [mesh.spread for mesh in self.loaded_meshes])

    @cached_property
    def static_states(self) -> tuple[StaticState, ...]:
        """Static equilibrium of each shaft under the mean flank forces, which act at their places on the face."""
        loads = {name: mesh.load_on_shafts for name, mesh in zip(self.scene.pairs, self.loaded_meshes, strict=True)}
        pair = self.loaded_meshes[0].on_shafts
        assert pair is not None
        return static_equilibrium(self.scene.gearbox, loads, {gear.number: gear.settled for gear in pair.gears})

    @cached_property
    def stiffness(self) -> NDArray:
        """K̄ of all meshes (row, row) [N/mm]."""
        return np.asarray(block_diag(*(mesh.mean_stiffness for mesh in self.loaded_meshes)))

    @property
    def damping_ratio(self) -> float:
        """ζ of every mode."""
        assert self.scene.system is not None
        return self.scene.system.damping_ratio

    @property
    def mode_damping(self) -> Sequence[tuple[float, float]]:
        """Pairs (frequency [Hz], ζ) that replace ``damping_ratio``; ζ is linear between them."""
        assert self.scene.system is not None
        return self.scene.system.mode_damping

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """Meshes grouped by mesh frequency, in the order of their first meshes."""
        scene = self.scene
        if not scene.has_shafts:
            return (Group(meshes=np.array([0]), rate=float(scene.pair.pinion.teeth), phase=np.zeros(1)),)
        rates = np.array([float(scene.gearbox.train.mesh_rate(name)) for name in scene.pairs])
        phases = np.array(list(scene.gearbox.phases.values()))
        groups, remaining = [], list(range(len(rates)))
        while remaining:
            equal = np.array([m for m in remaining if np.isclose(rates[m], rates[remaining[0]], rtol=1e-9)])
            groups.append(Group(meshes=equal, rate=float(rates[remaining[0]]), phase=phases[equal]))
            remaining = [m for m in remaining if m not in equal]
        return tuple(groups)

    def excitation(self, group: Group, harmonics: int) -> Excitation:
        """Excitation by the meshes of a group, each at its phase: ŷ_n e^{2πinφ}."""
        row_count = self.rows_per_mesh
        count, n = row_count * len(group.meshes), np.arange(2 * harmonics + 1)
        stiffness = np.zeros((count, count, len(n)), dtype=complex)
        motion, force = (np.zeros((count, harmonics + 1), dtype=complex) for _ in range(2))
        for k, (index, phase) in enumerate(zip(group.meshes, group.phase, strict=True)):
            mesh, block = self.loaded_meshes[index], slice(row_count * k, row_count * (k + 1))
            by_mesh = mesh.flanks.excitation(mesh.waves(2 * harmonics) * np.exp(2j * np.pi * n * phase)[:, None])
            stiffness[block, block], motion[block], force[block] = by_mesh.stiffness, by_mesh.motion, by_mesh.force
        return Excitation(stiffness=stiffness, motion=motion, force=force)

    def quasi_static_approach(self, orders: int) -> NDArray:
        """Orders 0 … n of the quasi-static approach of each mesh, (mesh, n + 1) [mm]."""
        return np.array([mesh.waves(orders) @ mesh.flanks.motion[:, 0] for mesh in self.loaded_meshes])

    @property
    def directions(self) -> tuple[str, ...]:
        """Directions of the forces on bearings."""
        return DIRECTIONS

    def on_bearings(self, vibration: Vibration) -> NDArray:
        """Forces on the bearings (speed, bearing, direction, order) [N]."""
        return vibration.at_bearings

    def other_variables(self, vibration: Vibration, loads: NDArray, speeds: NDArray) -> Variables:
        """Friction, static deflection of the shafts, and response to torque ripples."""
        friction: Variables = {"friction_force_amplitude": (("mesh", "harmonic"), self.friction(vibration.harmonics))}
        if not self.scene.has_shafts:
            return friction
        deflection = surroundings.static_deflection(self.scene.gearbox, self.static_states)
        return friction | deflection | surroundings.ripple_variables(self, speeds)

    def friction(self, harmonics: int) -> NDArray:
        """Estimated amplitudes of the friction force of each mesh (mesh, order 1 … H) [N]."""
        orders = (mesh.waves(2 * harmonics)[1 : harmonics + 1] @ mesh.friction for mesh in self.loaded_meshes)
        return 2 * np.abs(np.array(list(orders)))

    @property
    def coords(self) -> dict[str, Any]:
        """Gears, parts and shafts by name."""
        return surroundings.coords(self) if self.scene.has_shafts else {}

    def mode_variables(self, which: NDArray) -> Variables:
        """Shares of the parts in the strain energy, and mode shapes of the shafts."""
        return surroundings.mode_variables(self, which) if self.scene.has_shafts else {}

    def remarks(self, speeds: NDArray, harmonics: int) -> list[str]:
        """Size of the omitted friction, orders of the excitation that are uncertain, and assumptions about ripples."""
        lines, largest = [], self.friction(1)[:, 0]
        for name, force, mean in zip(self.names, largest, self.force, strict=True):
            size = f"{force:.3g} N at the mesh frequency, {100 * force / mean:.2g} % of the mean force"
            lines.append(f"mesh {name}: friction force (μ = {FRICTION}) across the line of action, left out: {size}")  # fmt: skip  # noqa: E501
        for name, mesh in zip(self.names, self.loaded_meshes, strict=True):
            names = f"{TRANSMISSION_ERROR}_amplitude", f"{TRANSMISSION_ERROR}_amplitude_noise_floor"
            size, floor = (output(mesh.solved, quantity)[1][:harmonics] for quantity in names)
            if (uncertain := floor > UNCERTAIN * size).any():
                orders = ", ".join(str(n + 1) for n in np.flatnonzero(uncertain))
                lines.append(f"mesh {name}: orders {orders} of its excitation may be off by more than {100 * UNCERTAIN:.0f} %, judged by its noise floor")  # fmt: skip  # noqa: E501
        if self.scene.has_shafts and len(self.modes.ripples):
            lines.append("torque ripples act on meshes of mean stiffness; mesh forces and peaks do not include them")
        return lines
