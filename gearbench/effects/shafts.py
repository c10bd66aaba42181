"""Effects of the shafts and bearings of ``[system]`` on the contact: flanks move with the sections of their shafts.

``system_effects`` makes them. ``mesh_spread`` gives the dynamics the distribution of the load over the face. Equations
(W…) are those of docs/theory.md. The seat of a gear is the part of its shaft under its face width.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from gearbench.effects.base import ComplianceEffect, Effect, Effects, GapEffect, LowRank
from gearbench.geometry.action import ContactLines
from gearbench.system.gearbox import FACE_POINTS, Gearbox
from gearbench.system.mechanics import resting_states, static_equilibrium
from gearbench.system.shaft_model import ShaftModel
from gearbench.system.static import StaticState, twist

#: Foundations that ``mesh_spread`` tries: springs that replace the teeth. Their stiffness is given as a multiple of
#: face width times modulus of elasticity. The first is stiffer than meshes, the second stiffer than Hertzian contact.
FOUNDATIONS = (0.3, 5.0)
#: Eigenvalues of a seat's compliance below this fraction of the largest are rounding, and are dropped.
_RANK = 1e-14


# compared by identity, because sums of compliances are cached with their effects as keys
@dataclass(frozen=True, kw_only=True, eq=False)
class SeatedGear:
    """A gear of the scene's pair, 0 for the pinion or 1 for the wheel, on its shaft in the equilibrium ``settled``."""

    box: Gearbox
    gear: int
    settled: StaticState

    @property
    def number(self) -> int:
        """Number of the shaft."""
        return self.box.seats[(self.box.own, self.gear)][0]

    @property
    def model(self) -> ShaftModel:
        """Beam model of the shaft."""
        return self.box.models[self.number]

    @property
    def nodes(self) -> NDArray:
        """Numbers of the nodes of the shaft under the face."""
        return self.box.face_nodes(self.box.own, self.gear, self.model)

    def rows(self, lines: ContactLines) -> NDArray:
        """Matrix from the motions of all nodes of the shaft to the deflection normal to the flank.

        (position, pair, segment, size), size = 6 · number of nodes.
        """
        return self.model.rows(*self._places(lines))

    def deflection(self, lines: ContactLines, motion: NDArray) -> NDArray:
        """Deflection normal to the flank (position, pair, segment) [mm] by the ``motion`` (size,) of all nodes."""
        position, wrench = self._places(lines)
        return np.einsum("...i,...i->...", self.model.moved(position, motion), wrench)

    def _places(self, lines: ContactLines) -> tuple[NDArray, NDArray]:
        """Position on the shaft, and wrench (…, 6) of a unit force normal to the flank, for each segment."""
        frame = self.box.frames[self.box.own]
        wrench = math.cos(frame.pair.meshing.beta_b) * frame.wrench(self.gear, lines.u)
        return frame.position(self.gear, lines.y), wrench

    @property
    def face_coordinates(self) -> NDArray:
        """Indices of the motions of the nodes under the face."""
        return (6 * self.nodes[:, None] + np.arange(6)).ravel()

    def motion(self, of_all: NDArray) -> NDArray:
        """The entries (size,) of this shaft in the motions ``of_all`` of all coupled shafts."""
        return of_all[self.settled.structure.motions(self.number)]

    def load(self, on_shaft: NDArray) -> NDArray:
        """Load ``on_shaft`` (size,), with zeros for the other coupled shafts and bodies."""
        load = np.zeros_like(self.settled.load)
        load[self.settled.structure.motions(self.number)] = on_shaft
        return load


def factor(gears: Sequence[SeatedGear], rows_of_gears: Sequence[NDArray]) -> NDArray:
    """Ψ (…, rank) [√(mm/N)] of the seats of gears whose shafts are in equilibrium together (W9).

    The equilibrium contains bending and axial motion, with bearings and connecting bodies. It does not
    contain rotation about the axis, which is held; the twist over the face is added here.

    Parameters
    ----------
    gears
        Gears whose shafts are in equilibrium together.
    rows_of_gears
        Rows (…, size) of every gear, from motions of its shaft to deflection.
    """
    settled = gears[0].settled
    coordinates = np.concatenate([gear.face_coordinates + settled.structure.starts[gear.number] for gear in gears])
    G, scale = settled.compliance[np.ix_(coordinates, coordinates)].copy(), []
    for gear in gears:
        # the sixth motion of each node; ``scale`` has one entry for each node so far
        twist_coordinates = 6 * (len(scale) + np.arange(len(gear.nodes))) + 5
        G[np.ix_(twist_coordinates, twist_coordinates)] += twist(
            gear.model, gear.nodes, gear.box.torque_from(gear.box.own, gear.gear)
        )
        # rotations [rad] are scaled by half the face width to compare with displacements [mm]
        width = gear.box.pairs[gear.box.own].meshing.face_width
        scale += [np.array([1, 1, 1, *([2 / width] * 3)])] * len(gear.nodes)
    scales = np.concatenate(scale)
    values, vectors = np.linalg.eigh(G / scales[:, None] / scales)
    kept = values > _RANK * values[-1]
    rows = np.concatenate(
        [rows[..., gear.face_coordinates] for gear, rows in zip(gears, rows_of_gears, strict=True)], axis=-1
    )
    return rows @ (scales[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


def _grouped(gears: tuple[SeatedGear, SeatedGear]) -> list[tuple[SeatedGear, ...]]:
    """Seats grouped by equilibrium: one group if both shafts are coupled, otherwise two."""
    pinion, wheel = gears
    return [gears] if pinion.settled is wheel.settled else [(pinion,), (wheel,)]


def mesh_spread(gears: tuple[SeatedGear, SeatedGear], stiffness: NDArray) -> tuple[NDArray, NDArray]:
    """Loads over the face (resultant, point) of unit resultants, and the compliance C (resultant, resultant) of shafts.

    C is that of (W13). The points are those of ``FACE_POINTS``. A foundation of springs replaces the teeth. Among all
    loads with the same resultants, the chosen ones store the least strain energy in shafts and foundation. The
    foundation must be stiffer than the teeth, so that shafts and teeth together are more compliant than shafts and
    foundation. If the first of ``FOUNDATIONS`` is too soft, the second is taken.

    Parameters
    ----------
    gears
        Pinion and wheel on their shafts.
    stiffness
        Stiffness S of the resultants (position, resultant, resultant) [N/mm], including the shafts.
    """
    box = gears[0].box
    pair, (η, weight) = box.pairs[box.own], FACE_POINTS
    H = np.zeros((len(η), len(η)))
    for group in _grouped(gears):
        psi = factor(group, [box.face_rows(box.own, gear.gear, gear.model) for gear in group])
        H += psi @ psi.T
    R = legvander(η, stiffness.shape[-1] - 1)
    E = min(material.E for material in pair.materials)
    P = R  # for the type checker: the loop replaces it
    for multiple in FOUNDATIONS:
        P = np.linalg.solve(H + np.diag(2 / (multiple * E * pair.meshing.face_width * weight)), R)
        on_foundation = np.linalg.inv(R.T @ P)  # compliance of the resultants, shafts and foundation
        P = P @ on_foundation
        mesh_is_softer = np.linalg.eigvals(stiffness @ on_foundation).real.max() < 1
        if mesh_is_softer:
            break
    return P.T, P.T @ H @ P


def _motion_without(
    gears: tuple[SeatedGear, SeatedGear], of_flanks: tuple[NDArray, NDArray]
) -> tuple[NDArray, NDArray]:
    """Motions (size,) of both shafts in equilibrium, minus the linear part due to the loads ``of_flanks`` (W10)."""
    motions = []
    for gear in gears:
        loads = [
            other.load(load) for other, load in zip(gears, of_flanks, strict=True) if other.settled is gear.settled
        ]
        motions.append(gear.motion(gear.settled.motion - gear.settled.compliance @ np.sum(loads, axis=0)))
    return motions[0], motions[1]


@dataclass(frozen=True, kw_only=True)
class Shafts(ComplianceEffect):
    """Bending, twist and axial motion of both shafts under the load of the flanks.

    Parameters
    ----------
    gears
        Pinion and wheel on their shafts.
    """

    gears: tuple[SeatedGear, SeatedGear]

    name: ClassVar[str] = "shafts"
    summary: ClassVar[str] = "compliance: shafts and bearings; the shaft also bends and twists under the face"
    source: ClassVar[str] = "Timoshenko beams, ISO/TS 16281"

    @property
    def carriers(self) -> dict[int, ShaftModel]:
        """Number of a shaft → its model, for all shafts that move with those of the two gears."""
        return {n: model for gear in self.gears for n, model in gear.settled.structure.shafts.items()}

    @property
    def linear(self) -> bool:
        """Whether no bearing changes its stiffness with its load."""
        return all(bearing.is_linear for model in self.carriers.values() for bearing in model.shaft.bearings)

    def compliance(self, lines: ContactLines, effects: Effects) -> LowRank:
        """Factor of both shafts, shared by all tooth pairs, (position, pair, segment, rank)."""
        parts = [factor(gears, [gear.rows(lines) for gear in gears]) for gears in _grouped(self.gears)]
        return LowRank(factor=np.concatenate(parts, axis=-1), coupled=True)


@dataclass(frozen=True, kw_only=True, eq=False)
class ShaftMotion(GapEffect):
    """Displacements of the shafts besides those of ``Shafts``, which are linear in the flank forces.

    They come from other loads, clearance and nonlinear bearings.

    Parameters
    ----------
    gears
        Pinion and wheel on their shafts.
    motions
        Motions of the nodes of each shaft (size,) [mm, rad].
    """

    gears: tuple[SeatedGear, SeatedGear]
    motions: tuple[NDArray, NDArray]

    # compared by identity, although a GapEffect is compared by the values of its fields
    __eq__, __hash__ = object.__eq__, object.__hash__  # type: ignore[assignment]

    name: ClassVar[str] = "shaft_motion"
    summary: ClassVar[str] = "gap: shafts bent by other loads, and bearings whose stiffness depends on load"
    source: ClassVar[str] = "Timoshenko beams, ISO/TS 16281"

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment), positive where the flanks part."""
        pinion, wheel = (gear.deflection(lines, motion) for gear, motion in zip(self.gears, self.motions, strict=True))
        return pinion + wheel


def flank_loads(
    gears: tuple[SeatedGear, SeatedGear], lines: ContactLines, force: NDArray, weight: NDArray
) -> tuple[NDArray, NDArray]:
    """Mean load (size,) of the flank forces (position, pair, segment) [N] on the nodes of each gear's shaft.

    ``weight`` is that of each position in the mean, (position,).
    """
    mean = weight[:, None, None] * force
    pinion, wheel = (np.einsum("pks,pksn->n", mean, gear.rows(lines)) for gear in gears)
    return pinion, wheel


def system_effects(
    box: Gearbox, of_flanks: tuple[NDArray, NDArray] | None = None, near: Sequence[SeatedGear] = ()
) -> tuple[Effect, ...]:
    """Effects of the shafts of ``box`` on the contact of its own mesh.

    Parameters
    ----------
    box
        The gearbox.
    of_flanks
        Load of the flanks on the nodes of both shafts (size,), at which nonlinear bearings are linearised; by default
        that of ``Gearbox.load``.
    near
        Gears in an equilibrium close by, from which the search for this one starts.

    Returns
    -------
    ``Shafts``, and ``ShaftMotion`` if there are other loads or nonlinear bearings.

    Raises
    ------
    InputError
        If the shafts and pairs do not fit, or the bearings do not hold a shaft.
    """
    settled = resting_states(box)
    if of_flanks is not None:
        settled = static_equilibrium(box, {box.own: of_flanks}, {gear.number: gear.settled for gear in near})
    pinion, wheel = (
        SeatedGear(box=box, gear=index, settled=settled[box.seats[(box.own, index)][0]]) for index in (0, 1)
    )
    shafts = Shafts(gears=(pinion, wheel))
    only_these = {pinion.number, wheel.number} == shafts.carriers.keys()
    no_others = all(len(model.shaft.gears) == 1 and not model.shaft.loads for model in shafts.carriers.values())
    if shafts.linear and only_these and no_others:  # ``Shafts`` contains all motion
        return (shafts,)
    loads = of_flanks or (box.load(box.own, 0), box.load(box.own, 1))
    return shafts, ShaftMotion(gears=(pinion, wheel), motions=_motion_without((pinion, wheel), loads))


@lru_cache(maxsize=16)
def resting_effects(box: Gearbox) -> tuple[Effect, ...]:
    """``system_effects`` under the loads of ``box`` alone."""
    return system_effects(box)
