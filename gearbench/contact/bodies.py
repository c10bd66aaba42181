"""Gear bodies that are loaded by several meshes: a load in one mesh displaces the flanks in the others.

With polynomials φ on the flanks, and the compliance C_d between the polynomials of two teeth d pitches apart, the loads
P of one mesh open the gap

    e = φ · Σ_d C_d Σ_i φ_i P_i

in another mesh, where i counts the segments of a tooth (M4 of docs/theory.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.batch import on_threads
from gearbench.threads import default_threads


@dataclass(frozen=True, kw_only=True, eq=False)
class Side:
    """One gear in one mesh: its flank polynomials, divided by the levers (lever arms divided by the base radius).

    Parameters
    ----------
    mesh
        Number of the mesh.
    polynomials
        Values at the nodes at which gaps are needed, see ``assemble.with_field``, (position, pair, node, function)
        [1/mm].
    means
        Matrix from values at the nodes to means over the segments that carry the forces, (position, pair, segment,
        node); None if the nodes carry the forces.
    """

    mesh: int
    polynomials: NDArray
    means: NDArray | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Link:
    """Compliance of a body between its teeth in two meshes.

    Parameters
    ----------
    sides
        Numbers of the two sides in ``Bodies.sides``.
    groups
        One group for each combination of loaded teeth: the indices of its positions, and the compliance C between the
        polynomials of all tooth pairs on the first side (rows) and on the second (columns), (pair × function, pair ×
        function) [mm·mm²/N].
    """

    sides: tuple[int, int]
    groups: tuple[tuple[NDArray, NDArray], ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Bodies:
    """All bodies of a train that are loaded by several meshes.

    Parameters
    ----------
    sides
        Sides at which the bodies are loaded.
    links
        Links between the sides of a body.
    """

    sides: tuple[Side, ...]
    links: tuple[Link, ...]

    def fields(self, loads: Sequence[NDArray]) -> list[NDArray | None]:
        """Gaps that loads in other meshes open in each mesh.

        Parameters
        ----------
        loads
            Forces in each mesh (position, pair, segment) [N].

        Returns
        -------
        Gap of each mesh (position, pair, node) [mm]; None for meshes that no body connects with others.
        """
        generalised = self._generalised_loads(loads)

        def gap_at(number: int) -> NDArray:
            """Gap at the nodes of a side."""
            displaced = np.zeros_like(generalised[number])
            for link in self.links:
                one, other = link.sides
                for positions, C in link.groups if number in link.sides else ():
                    by = generalised[other][positions] @ C.T if number == one else generalised[one][positions] @ C
                    displaced[positions] += by
            polynomials = self.sides[number].polynomials
            return (polynomials @ displaced.reshape(*polynomials.shape[:2], -1, 1))[..., 0]

        gaps: dict[int, NDArray] = {}
        of_sides = on_threads(gap_at, range(len(self.sides)), default_threads())
        for side, gap in zip(self.sides, of_sides, strict=True):
            gaps[side.mesh] = gaps.get(side.mesh, 0.0) + gap
        return [gaps.get(m) for m in range(len(loads))]

    def compliance(self, loads: Sequence[NDArray]) -> NDArray:
        """Compliance C (position, mesh, mesh) [mm/N] between different meshes; its diagonal is 0.

        The ``loads`` of each mesh, as for ``fields``, must sum to 1 N.
        """
        generalised = self._generalised_loads(loads)
        compliance = np.zeros((len(loads[0]), len(loads), len(loads)))
        for link in self.links:
            one, other = link.sides
            m, n = self.sides[one].mesh, self.sides[other].mesh
            for positions, C in link.groups:
                c = np.sum((generalised[one][positions] @ C) * generalised[other][positions], axis=1)
                compliance[positions, m, n] += c
                compliance[positions, n, m] += c
        return compliance

    def _generalised_loads(self, loads: Sequence[NDArray]) -> list[NDArray]:
        """Generalised loads Σ φ_i P_i of all tooth pairs, for every side, (position, pair × function)."""

        def of_side(side: Side) -> NDArray:
            at_nodes = loads[side.mesh][..., None, :]
            at_nodes = at_nodes if side.means is None else at_nodes @ side.means
            return (at_nodes @ side.polynomials).reshape(len(side.polynomials), -1)

        return list(on_threads(of_side, self.sides, default_threads()))
