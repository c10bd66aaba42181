"""Shafts together with the bodies that are joined to them or carry their bearings, as one set of motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import naming
from gearbench.system.bearing import Bearing
from gearbench.system.body import Body, Condensed
from gearbench.system.shaft_model import ShaftModel

#: Indices of x, y, z, rx, ry of a node, the directions in which a bearing carries load.
_FIVE = np.arange(5)


@dataclass(frozen=True, kw_only=True, eq=False)
class BearingSupport:
    """A bearing between a shaft and the ground or a body.

    Parameters
    ----------
    shaft
        Number of the shaft.
    bearing
        The bearing.
    index, rows
        Indices (m,) of the motions that affect the bearing, and its deflection per unit of these motions (5, m).
    """

    shaft: int
    bearing: Bearing
    index: NDArray
    rows: NDArray

    def deflection(self, u: NDArray) -> NDArray:
        """Motion (5,) of the inner ring relative to the outer ring, for the motions u (size,) of the structure."""
        return self.rows @ u[self.index]

    def add(self, K: NDArray, stiffness: NDArray) -> None:
        """Add the bearing ``stiffness`` (5, 5) to the matrix K of the structure."""
        np.add.at(K, np.ix_(self.index, self.index), self.rows.T @ stiffness @ self.rows)


@dataclass(frozen=True, kw_only=True, eq=False)
class Structure:
    """A single shaft, or several shafts and the bodies that connect them.

    The motions are those of the nodes of all shafts, in order, followed by the coordinates of the bodies. A joined node
    of a body adds no motion, because it moves with the section of the shaft.

    Parameters
    ----------
    shafts
        Number of a shaft in the system → its model.
    bodies
        All bodies connected to these shafts.
    """

    shafts: Mapping[int, ShaftModel]
    bodies: tuple[Body, ...] = ()

    @cached_property
    def starts(self) -> dict[int, int]:
        """Number of a shaft → index of its first motion."""
        ends = np.cumsum([0, *(model.size for model in self.shafts.values())])
        return {number: int(start) for number, start in zip(self.shafts, ends, strict=False)}

    def motions(self, shaft: int) -> slice:
        """Indices of the motions of a shaft."""
        return slice(self.starts[shaft], self.starts[shaft] + self.shafts[shaft].size)

    @cached_property
    def size(self) -> int:
        """Number of motions."""
        last = [int(index.max()) + 1 for _, index in self._attached.values() if len(index)]
        return max([sum(model.size for model in self.shafts.values()), *last])

    @cached_property
    def _attached(self) -> dict[str, tuple[Condensed, NDArray]]:
        """Name of a body → the body, and the indices of its coordinates among the motions of the structure.

        The first coordinates of the body are the motions of its joined nodes.
        """
        names = {model.shaft.name: number for number, model in self.shafts.items()}
        attached, free = {}, sum(model.size for model in self.shafts.values())
        for body in self.bodies:
            with naming(below=f"system.bodies.{body.name}"):
                condensed, joined = body.condensed.with_coordinates(tuple(joint.node for joint in body.joints))
            index = []
            for joint, direction in joined:
                number = names[body.joints[joint].shaft]
                node = self.shafts[number].node(body.joints[joint].position)
                index.append(self.starts[number] + 6 * node + direction)
            own_count = condensed.size - len(index)
            attached[body.name] = condensed, np.array([*index, *range(free, free + own_count)], dtype=int)
            free += own_count
        return attached

    @property
    def own_coordinates(self) -> dict[str, NDArray]:
        """Name of a body → indices of its coordinates that are not motions of a shaft."""
        shafts = sum(model.size for model in self.shafts.values())
        return {name: index[index >= shafts] for name, (_, index) in self._attached.items()}

    def assembled(self, shafts: Mapping[int, NDArray], of_bodies: Literal["mass", "stiffness"]) -> NDArray:
        """Sum (size, size) of the matrices of the shafts, given by number, and of the bodies."""
        total = np.zeros((self.size, self.size))
        for number, part in shafts.items():
            motions = self.motions(number)
            total[motions, motions] += part
        for condensed, index in self._attached.values():
            # two coordinates of a body never map to one motion: every node is joined once, to a separate section
            np.add.at(total, np.ix_(index, index), getattr(condensed, of_bodies))
        return total

    @cached_property
    def stiffness(self) -> NDArray:
        """Stiffness matrix (size, size) of shafts and bodies, without bearings."""
        return self.assembled({number: model.stiffness for number, model in self.shafts.items()}, "stiffness")

    @cached_property
    def supports(self) -> tuple[BearingSupport, ...]:
        """All bearings, ordered by shaft."""
        supports = []
        for number, model in self.shafts.items():
            for bearing in model.shaft.bearings:
                five = self.starts[number] + 6 * model.node(bearing.position) + _FIVE
                index, rows = five, np.eye(5)
                if bearing.on is not None:
                    condensed, of_body = self._attached[bearing.on.body]
                    index = np.concatenate([five, of_body])
                    rows = np.hstack([rows, -condensed.nodes[bearing.on.node][:5]])
                supports.append(BearingSupport(shaft=number, bearing=bearing, index=index, rows=rows))
        return tuple(supports)


def structures(models: Mapping[int, ShaftModel], bodies: tuple[Body, ...]) -> tuple[Structure, ...]:
    """Group the shafts that bodies connect, with these bodies; groups are ordered by their first shaft."""
    touched = {
        body.name: {
            number
            for number, model in models.items()
            if any(joint.shaft == model.shaft.name for joint in body.joints)
            or any(bearing.on and bearing.on.body == body.name for bearing in model.shaft.bearings)
        }
        for body in bodies
    }
    groups: list[set[int]] = [{number} for number in models]
    for shafts in touched.values():
        joined = [group for group in groups if group & shafts]
        groups = [group for group in groups if not group & shafts] + [set().union(*joined)]
    grouped = [
        Structure(
            shafts={number: models[number] for number in sorted(group)},
            bodies=tuple(body for body in bodies if touched[body.name] <= group),
        )
        for group in sorted(groups, key=min)
    ]
    return tuple(grouped)
