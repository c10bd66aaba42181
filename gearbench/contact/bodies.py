"""Bodies that are loaded by several meshes at once: a load on one of their teeth moves the flanks at the other meshes.

With polynomials φ on the flanks and blocks C_d between teeth d pitches apart, the loads P of one mesh open the gap

    e = φ · Σ_d C_d Σ_i φ_i P_i

at another (M4 of docs/theory.md): H has these blocks beside those of each mesh by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Side:
    """Flank polynomials of a gear of a mesh over the levers, where its lines are loaded and where gaps are asked for.

    Parameters
    ----------
    mesh
        Number of the mesh.
    cells
        Mean over the segments that forces are known of, (position, pair, segment, function) [1/mm].
    nodes
        At the nodes of gaps, see ``assemble.with_field``, (position, pair, node, function) [1/mm].
    """

    mesh: int
    cells: NDArray
    nodes: NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Link:
    """Compliance between the teeth of one body at two sides, or at one and the same.

    Parameters
    ----------
    sides
        Numbers of the sides.
    groups
        Positions at which the same teeth are loaded, and C between them, (pair, function, pair, function) [mm·mm²/N].
    """

    sides: tuple[int, int]
    groups: tuple[tuple[NDArray, NDArray], ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Bodies:
    """All bodies of a train that are loaded by several meshes.

    Parameters
    ----------
    sides
        Where they are loaded.
    links
        Between different sides of a body.
    own
        Of each side with itself: what its body lends to the compliance that the mesh has anyhow.
    """

    sides: tuple[Side, ...]
    links: tuple[Link, ...]
    own: tuple[Link, ...]

    def fields(self, loads: Sequence[NDArray]) -> list[NDArray | None]:
        """Gap that the ``loads`` of the meshes, (position, pair, segment) [N] each, open at the others [mm].

        (position, pair, node) of each mesh; None of meshes that no body connects with others.
        """
        pressed = self._pressed(loads)
        moved = [np.zeros_like(each) for each in pressed]
        for link in self.links:
            one, other = link.sides
            for at, C in link.groups:
                moved[one][at] += np.einsum("kfmg,pmg->pkf", C, pressed[other][at], optimize=True)
                moved[other][at] += np.einsum("kfmg,pkf->pmg", C, pressed[one][at], optimize=True)
        found: dict[int, NDArray] = {}
        for side, u in zip(self.sides, moved, strict=True):
            found[side.mesh] = found.get(side.mesh, 0.0) + (side.nodes @ u[..., None])[..., 0]
        return [found.get(m) for m in range(len(loads))]

    def compliance(self, loads: Sequence[NDArray]) -> NDArray:
        """C (position, mesh, mesh) [mm/N] of ``loads`` of 1 N on each mesh: what they do work on at the others."""
        pressed = self._pressed(loads)
        found = np.zeros((len(loads[0]), len(loads), len(loads)))
        for link in (*self.links, *self.own):
            one, other = link.sides
            m, n = self.sides[one].mesh, self.sides[other].mesh
            for at, C in link.groups:
                c = np.einsum("pkf,kfmg,pmg->p", pressed[one][at], C, pressed[other][at], optimize=True)
                found[at, m, n] += c
                found[at, n, m] += 0.0 if m == n else c
        return found

    def _pressed(self, loads: Sequence[NDArray]) -> list[NDArray]:
        """Σ φ_i P_i of each pair of teeth at each side, (position, pair, function)."""
        return [(loads[side.mesh][..., None, :] @ side.cells)[..., 0, :] for side in self.sides]
