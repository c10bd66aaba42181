"""Shafts, and the bodies that they join or that their bearings sit on, as one set of motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.system.bearing import Bearing
from gearbench.system.body import Body, Condensed
from gearbench.system.shaft_model import ShaftModel

#: x, y, z, rx, ry of a node: the directions in which a bearing carries.
_FIVE = np.arange(5)


@dataclass(frozen=True, kw_only=True, eq=False)
class Support:
    """A bearing between a shaft and the ground, or a body.

    Parameters
    ----------
    shaft
        Number of its shaft.
    bearing
        It.
    index, rows
        Motions (m,) that it reads, and its deflection per motion (5, m).
    """

    shaft: int
    bearing: Bearing
    index: NDArray
    rows: NDArray

    def deflection(self, u: NDArray) -> NDArray:
        """Motion (5,) of its inner ring against its outer one."""
        return self.rows @ u[self.index]

    def add(self, K: NDArray, stiffness: NDArray) -> None:
        """Add its stiffness (5, 5) to that of the structure."""
        np.add.at(K, np.ix_(self.index, self.index), self.rows.T @ stiffness @ self.rows)


@dataclass(frozen=True, kw_only=True, eq=False)
class Structure:
    """Motions: those of the nodes of each shaft, in order, then coordinates of the bodies.

    A joined node of a body has no motion of its own: it is that of the shaft's section.

    Parameters
    ----------
    shafts
        Number in the system → model.
    bodies
        All that touch these shafts, and no others.
    """

    shafts: Mapping[int, ShaftModel]
    bodies: tuple[Body, ...] = ()

    @cached_property
    def starts(self) -> dict[int, int]:
        """Number of a shaft → its first motion."""
        ends = np.cumsum([0, *(model.size for model in self.shafts.values())])
        return {number: int(start) for number, start in zip(self.shafts, ends, strict=False)}

    def motions(self, shaft: int) -> slice:
        """Motions of a shaft."""
        return slice(self.starts[shaft], self.starts[shaft] + self.shafts[shaft].size)

    @cached_property
    def size(self) -> int:
        """Number of motions."""
        last = [int(index.max()) + 1 for _, index in self._attached.values() if len(index)]
        return max([sum(model.size for model in self.shafts.values()), *last])

    @cached_property
    def _attached(self) -> dict[str, tuple[Condensed, NDArray]]:
        """Bodies by name, their first coordinates the motions of joined nodes, and the motions that these are."""
        names = {model.shaft.name: number for number, model in self.shafts.items()}
        found, free = {}, sum(model.size for model in self.shafts.values())
        for body in self.bodies:
            try:
                condensed, joined = body.condensed.with_coordinates(tuple(joint.node for joint in body.joints))
            except InputError as error:
                raise error.within(f"system.bodies.{body.name}") from None
            index = []
            for joint, direction in joined:
                number = names[body.joints[joint].shaft]
                at = self.shafts[number].node(body.joints[joint].position)
                index.append(self.starts[number] + 6 * at + direction)
            own = condensed.size - len(index)
            found[body.name] = condensed, np.array([*index, *range(free, free + own)], dtype=int)
            free += own
        return found

    @property
    def own_coordinates(self) -> dict[str, NDArray]:
        """Motions of each body that are no shaft's."""
        shafts = sum(model.size for model in self.shafts.values())
        return {name: index[index >= shafts] for name, (_, index) in self._attached.items()}

    def assembled(self, shafts: Mapping[int, NDArray], of_bodies: Literal["mass", "stiffness"]) -> NDArray:
        """Sum (size, size) of the matrices of the shafts, by their numbers, and those of the bodies."""
        total = np.zeros((self.size, self.size))
        for number, part in shafts.items():
            here = self.motions(number)
            total[here, here] += part
        for condensed, index in self._attached.values():
            # no two coordinates of a body are one motion: each node is joined once, to sections of their own
            np.add.at(total, np.ix_(index, index), getattr(condensed, of_bodies))
        return total

    @cached_property
    def stiffness(self) -> NDArray:
        """Stiffness matrix of shafts and bodies without bearings (size, size)."""
        return self.assembled({number: model.stiffness for number, model in self.shafts.items()}, "stiffness")

    @cached_property
    def supports(self) -> tuple[Support, ...]:
        """Bearings, shaft by shaft."""
        found = []
        for number, model in self.shafts.items():
            for bearing in model.shaft.bearings:
                five = self.starts[number] + 6 * model.node(bearing.position) + _FIVE
                index, rows = five, np.eye(5)
                if bearing.on is not None:
                    condensed, of_body = self._attached[bearing.on.body]
                    index = np.concatenate([five, of_body])
                    rows = np.hstack([rows, -condensed.nodes[bearing.on.node][:5]])
                found.append(Support(shaft=number, bearing=bearing, index=index, rows=rows))
        return tuple(found)


def structures(models: Mapping[int, ShaftModel], bodies: tuple[Body, ...]) -> tuple[Structure, ...]:
    """Sets of shafts that bodies connect, each with its bodies, in the order of their first shafts."""
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
    found = [
        Structure(
            shafts={number: models[number] for number in sorted(group)},
            bodies=tuple(body for body in bodies if touched[body.name] <= group),
        )
        for group in sorted(groups, key=min)
    ]
    return tuple(found)
