"""A shaft as a chain of beam elements: nodes, stiffness, mass, and rows that read or load any section."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.system.beam import Beam
from gearbench.system.schema import Disc, Shaft

#: Number of elements across the face of a gear, in statics and in dynamics.
FACE_ELEMENTS, DYNAMIC_ELEMENTS = 12, 12
#: Largest number of elements between two marked positions. They resolve twenty modes of the stretch; a stretch that
#: would need more is so slender that these modes have low frequencies.
MOST_ELEMENTS = 40
#: Nodes closer than this fraction of the shaft length are merged.
_SAME = 1e-9
#: Conversion factors: g/cm³ to t/mm³, kg·m² to t·mm², kg to t, m to mm.
DENSITY, INERTIA, MASS, METRE = 1e-9, 1e3, 1e-3, 1e3


@dataclass(frozen=True, kw_only=True)
class Face:
    """Stretch of a shaft under a gear, from ``start`` to ``end`` [mm].

    ``diameter`` [mm] replaces that of the shaft sections if given.
    """

    start: float
    end: float
    diameter: float | None = None


@dataclass(frozen=True, kw_only=True)
class ShaftModel:
    """Beam model of a shaft. Motions are ordered by node, six per node as in ``beam``.

    Parameters
    ----------
    shaft
        The shaft to model.
    faces
        Stretches under gears.
    face_elements
        Number of elements across a face.
    joints
        Positions at which bodies are joined [mm].
    """

    shaft: Shaft
    faces: tuple[Face, ...]
    face_elements: int = FACE_ELEMENTS
    joints: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        tolerance = 1e-6 * self.shaft.length
        for face in self.faces:
            if face.start < -tolerance or face.end > self.shaft.length + tolerance:
                reach = f"its face reaches from {face.start:.6g} to {face.end:.6g} mm"
                allowed = f"must lie on the shaft, 0 to {self.shaft.length:g} mm"
                raise InputError(f"system.shafts.{self.shaft.name}.gears", reach, allowed)

    @cached_property
    def nodes(self) -> NDArray:
        """Positions of the nodes [mm], ascending."""
        shaft = self.shaft
        ends = np.cumsum([0.0, *(section.length for section in shaft.sections)])
        marks = [*ends, *(item.position for item in (*shaft.bearings, *shaft.loads, *shaft.discs)), *self.joints]
        if shaft.coupling is not None:
            marks.append(shaft.coupling.position)
        for face in self.faces:
            marks += [*np.linspace(face.start, face.end, self.face_elements + 1)]
        marks = np.unique(np.clip(marks, 0.0, shaft.length))
        keep = np.concatenate([[True], np.diff(marks) > _SAME * shaft.length])
        coarse = marks[keep]
        fine = [coarse[:1]]
        for a, b in pairwise(coarse):
            # elements no longer than their diameter resolve modes up to some ten kHz
            count = math.ceil((b - a) / self.diameters(a, b)[0][0] - 1e-9)
            fine.append(np.linspace(a, b, min(max(count, 1), MOST_ELEMENTS) + 1)[1:])
        return np.concatenate(fine)

    def diameters(self, a: float, b: float) -> tuple[tuple[float, float], float]:
        """Outer diameters at both ends of the stretch from a to b within one section, and its bore [mm]."""
        middle, start = (a + b) / 2, 0.0
        for section in self.shaft.sections:
            if middle <= start + section.length or section is self.shaft.sections[-1]:
                end = section.end_diameter or section.diameter
                slope = (end - section.diameter) / section.length
                outer = (section.diameter + slope * (a - start), section.diameter + slope * (b - start))
                for face in self.faces:
                    if face.diameter is not None and face.start < middle < face.end:
                        outer = (face.diameter, face.diameter)
                return outer, section.bore
            start += section.length
        raise AssertionError("a shaft has sections")

    @cached_property
    def beams(self) -> tuple[Beam, ...]:
        """Elements between the nodes."""
        material, beams = self.shaft.material, []
        for a, b in pairwise(self.nodes):
            outer, bore = self.diameters(a, b)
            if bore >= min(outer):
                raise InputError(
                    f"system.shafts.{self.shaft.name}.gears.diameter", min(outer), f"must exceed the bore, {bore:g} mm"
                )
            beams.append(
                Beam(
                    length=float(b - a),
                    diameter=outer,
                    bore=(bore, bore),
                    E=material.E,
                    G=material.G,
                    nu=material.nu,
                    density=self.shaft.density * DENSITY,
                )
            )
        return tuple(beams)

    @property
    def size(self) -> int:
        """Number of motions."""
        return 6 * len(self.nodes)

    def node(self, position: float) -> int:
        """Index of the node at the position of a bearing, load, disc, coupling, joint or end of a face."""
        return int(np.argmin(np.abs(self.nodes - position)))

    @cached_property
    def stiffness(self) -> NDArray:
        """Stiffness matrix of the free shaft (size, size)."""
        return self._sum([beam.stiffness() for beam in self.beams])

    @cached_property
    def mass(self) -> NDArray:
        """Mass matrix of the shaft and its discs (size, size) [t, t·mm²]."""
        M = self._sum([beam.mass() for beam in self.beams])
        for disc in self.shaft.discs:
            add_disc(M, 6 * self.node(disc.position), disc)
        return M

    def _sum(self, parts: Sequence[NDArray]) -> NDArray:
        """Matrix of the shaft (size, size) from the matrices of its elements, (12, 12) each."""
        total = np.zeros((self.size, self.size))
        for k, part in enumerate(parts):
            total[6 * k : 6 * k + 12, 6 * k : 6 * k + 12] += part
        return total

    def rows(self, position: NDArray, wrench: NDArray) -> NDArray:
        """Rows (…, size): work of wrenches (…, 6) (force, moment) at positions (…,) per unit motion of the nodes.

        Static shape functions apply within an element. A row reads the motion at its position, and its transpose
        applies the wrench as a load.
        """
        z, w = np.broadcast_arrays(np.asarray(position, dtype=float)[..., None], wrench)
        z, w, shape = z[..., 0].ravel(), w.reshape(-1, 6), w.shape[:-1]
        out = np.zeros((len(z), self.size))
        for k, points, s in self._located(z):
            out[points, 6 * k : 6 * k + 12] = np.einsum("pi,pia->pa", w[points], self.beams[k].shapes(s))
        return out.reshape(*shape, self.size)

    def moved(self, position: NDArray, motion: NDArray) -> NDArray:
        """Motion (…, 6) of the sections at positions (…,) if the nodes move by ``motion`` (size,)."""
        z, nodes = position.ravel(), motion.reshape(-1, 6)
        out = np.empty((len(z), 6))
        for k, points, s in self._located(z):
            out[points] = self.beams[k].motion(s, nodes[k], nodes[k + 1])
        return out.reshape(*position.shape, 6)

    def _located(self, z: NDArray) -> Iterator[tuple[int, NDArray, NDArray]]:
        """For each element with positions z: its number, indices of these positions, and s from 0 to 1 along it."""
        element = np.clip(np.searchsorted(self.nodes, z, side="right") - 1, 0, len(self.beams) - 1)
        for k in np.flatnonzero(np.bincount(element)).tolist():
            points = np.flatnonzero(element == k)
            yield k, points, (z[points] - self.nodes[k]) / self.beams[k].length


def add_disc(M: NDArray, first: int, disc: Disc) -> None:
    """Add a rigid disc to the mass matrix, at the node whose motions begin at the index ``first``."""
    m, axial, across = disc.mass * MASS, disc.inertia * INERTIA, disc.transverse_inertia * INERTIA
    for k, value in enumerate((m, m, m, across, across, axial)):
        M[first + k, first + k] += value
