"""A tooth in hexahedra that are fine along its contact strip.

Coordinates: the level ξ up the tooth, from the fillet to the tip; the share t = −1 … 1 across it, θ = t ψ(R), 1 on the
loaded flank; y across the face. Levels are crowded around the strip and follow it: R(ξ, y). The tooth is clamped at its
foot; the compliance of the gear is added by ``fem_reference.contact.spatial``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem_reference.elasticity import Lame, Space, free_dofs
from fem_reference.sector import Outline
from fem_reference.solver import schur_complement
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material

#: Points on the outline between which lengths are interpolated.
_OUTLINE = 4000


@dataclass(frozen=True, kw_only=True)
class Grading:
    """Sizes of the elements.

    Parameters
    ----------
    near
        Along the flank in the strip, and below it [mm].
    far
        Away from it [mm].
    growth
        Growth between the two, per distance.
    ends
        Sizes at the lower and upper end of the strip, as shares of ``near``, (2, layer + 1) or one for all.
    """

    near: float
    far: float
    growth: float
    ends: NDArray | float = 1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class FineTooth:
    """One tooth of a gear.

    Parameters
    ----------
    gear
        The gear; loaded is its right flank.
    layers
        Ends of the layers across the face, from 0 to b [mm].
    strip
        Radii between which the strip lies at the ends of the layers, (2, layer + 1) [mm].
    grading
        Sizes of the elements.
    """

    gear: Gear
    layers: NDArray
    strip: NDArray
    grading: Grading

    @cached_property
    def _outline(self) -> tuple[NDArray, NDArray]:
        """Radii from the clamped foot to the tip, and the length of the outline up to them [mm]."""
        outline = Outline(gear=self.gear)
        foot = float(outline.fillet(np.array([outline.junction]))[0][0])
        R = np.linspace(foot, self.gear.tip_radius, _OUTLINE)
        psi = self.gear.half_angle(R)
        step = np.hypot(np.diff(R), (R[1:] + R[:-1]) / 2 * np.diff(psi))
        return R, np.concatenate([[0.0], np.cumsum(step)])

    @cached_property
    def radii(self) -> NDArray:
        """R of the levels and their middles at the ends and in the middles of the layers, (2·level + 1, 2·layer + 1).

        Middles are means, so that Jacobians are positive for any strip.
        """
        R, length = self._outline
        near, growth = self.grading.near, self.grading.growth
        ends = np.interp(self.strip, R, length)
        away = np.maximum(np.maximum(ends[0] - length[:, None], length[:, None] - ends[1]), 0.0)
        fine = near * np.broadcast_to(self.grading.ends, ends.shape)[:, None]
        from_ends = (fine + growth * np.abs(length[:, None] - ends[:, None])).min(axis=0)
        size = np.minimum(np.minimum(near + growth * away, from_ends), self.grading.far)
        middle = (1 / size[1:] + 1 / size[:-1]) / 2 * np.diff(length)[:, None]
        number = np.concatenate([np.zeros((1, size.shape[1])), np.cumsum(middle, axis=0)])
        count = math.ceil(number[-1].max())
        share = np.linspace(0.0, 1.0, 2 * count + 1)
        at_ends = np.stack([np.interp(share * each[-1], each, R) for each in number.T], axis=1)
        radii = np.empty((len(share), 2 * at_ends.shape[1] - 1))
        radii[:, ::2], radii[:, 1::2] = at_ends, (at_ends[:, 1:] + at_ends[:, :-1]) / 2
        return radii

    @cached_property
    def shares(self) -> NDArray:
        """Shares t across the tooth of the ends of the elements and their middles, ascending to 1."""
        gear = self.gear
        R = self.strip.mean()
        thickness = 2 * R * float(gear.half_angle(R)) * math.cos(gear.beta_b)
        size, depth = self.grading.near * np.min(self.grading.ends), [0.0]
        while depth[-1] < thickness:
            depth.append(depth[-1] + min(size + self.grading.growth * depth[-1], 1.5 * self.grading.far))
        t = 1 - 2 * np.array(depth[::-1]) / depth[-1]
        return np.sort(np.concatenate([t, (t[1:] + t[:-1]) / 2]))

    @cached_property
    def _stations(self) -> NDArray:
        return np.sort(np.concatenate([self.layers, (self.layers[1:] + self.layers[:-1]) / 2]))

    @property
    def _counts(self) -> list[int]:
        """Elements up the tooth, across it, and layers."""
        return [len(each) // 2 for each in (self.radii, self.shares, self._stations)]

    @cached_property
    def _flat(self) -> Any:
        """Mesh of unit cubes: level, step across the tooth, layer."""
        import skfem

        return skfem.MeshHex1.init_tensor(*(np.arange(n + 1.0) for n in self._counts))

    @cached_property
    def space(self) -> Space:
        """Displacements on the mesh."""
        import skfem

        flat = self._flat
        clamp = flat.facets_satisfying(lambda x: x[0] < 0.25)
        curved: Any = skfem.MeshHex2.from_mesh(flat)
        i, j, k = np.rint(2 * curved.doflocs).astype(int)
        R, t, y = self.radii[i, k], self.shares[j], self._stations[k]
        theta = t * self.gear.half_angle(R) + self._turn(y)
        points = np.array([R * np.sin(theta), R * np.cos(theta), y])
        mesh = replace(curved, doflocs=points).with_boundaries({"clamp": clamp})
        return Space(mesh, "hex20")

    def _turn(self, y: NDArray) -> NDArray:
        return y * math.tan(self.gear.beta) / self.gear.pitch_radius

    @cached_property
    def _elements(self) -> tuple[NDArray, NDArray, NDArray]:
        """Elements below the flank by level and layer, and the map of an element from steps (ξ, t, y) to reference."""
        flat = self._flat
        corner = flat.p[:, flat.t]
        low = corner.min(axis=1)
        element = np.full(self._counts, -1)
        element[tuple(low.astype(int))] = np.arange(flat.nelements)
        # all elements are alike
        offset, reference = corner[:, :, 0] - low[:, :1], flat.elem.refdom.p
        affine = np.linalg.lstsq(np.vstack([offset, np.ones(8)]).T, reference.T, rcond=None)[0].T
        return element[:, -1], affine[:, :3], affine[:, 3]

    def interpolation(self, R: NDArray, y: NDArray) -> sp.csr_matrix:
        """Values at points of the loaded flank from those at the nodes, (point, node)."""
        elements, matrix, shift = self._elements
        layer = np.clip(np.searchsorted(self.layers, y, side="right") - 1, 0, len(self.layers) - 2)
        eta = (y - self.layers[layer]) / np.diff(self.layers)[layer]
        levels = self._levels(layer, eta)
        level = np.array([np.searchsorted(row[::2], r, side="right") - 1 for row, r in zip(levels, R, strict=True)])
        level = np.clip(level, 0, levels.shape[1] // 2 - 1)
        row = np.arange(len(R))
        low, middle, high = (levels[row, 2 * level + i] for i in range(3))
        xi = (R - low) / (high - low)
        for _ in range(8):  # the radius is a quadratic function of ξ
            value = low + xi * (high - low) + 4 * xi * (1 - xi) * (middle - (low + high) / 2)
            slope = (high - low) + 4 * (1 - 2 * xi) * (middle - (low + high) / 2)
            xi = xi - (value - R) / slope
        X = matrix @ np.stack([np.clip(xi, 0.0, 1.0), np.ones(len(R)), eta]) + shift[:, None]
        values, _ = self.space.reference_gradients(X)
        nodes = self.space.nodes_of[:, elements[level, layer]]
        rows = np.broadcast_to(row, nodes.shape)
        return sp.csr_matrix((values.ravel(), (rows.ravel(), nodes.ravel())), shape=(len(R), self.space.n_nodes))

    def _levels(self, layer: NDArray, eta: NDArray) -> NDArray:
        """Radii of all levels in the sections at ``eta`` of the layers, as the elements have them, (point, …)."""
        ends = self.radii[:, ::2]
        return ((1 - eta) * ends[:, layer] + eta * ends[:, layer + 1]).T

    def section_edges(self, y: float) -> NDArray:
        """Radii of the ends of the elements in the section at y."""
        layer = np.clip(np.searchsorted(self.layers, [y], side="right") - 1, 0, len(self.layers) - 2)
        eta = (y - self.layers[layer]) / np.diff(self.layers)[layer]
        return self._levels(layer, eta)[0, ::2]

    def normals(self, section: NDArray, y: NDArray) -> NDArray:
        """Inward normals (point, 3) from those of the sections in the frame of the tooth (point, 2)."""
        beta_b, c, s = self.gear.beta_b, np.cos(self._turn(y)), np.sin(self._turn(y))
        u, v = section.T * math.cos(beta_b)
        return np.stack([c * u + s * v, c * v - s * u, np.full(len(y), math.sin(beta_b))], axis=-1)

    def load(self, R: NDArray, y: NDArray, normal: NDArray, force: sp.csr_matrix) -> sp.csr_matrix:
        """Nodal forces (3·node, load) of ``force`` (point, load) at points of the flank along ``normal`` (point, 3)."""
        interpolation = self.interpolation(R, y)
        parts = [interpolation.T @ force.multiply(normal[:, [i]]).tocsr() for i in range(3)]
        n, m = self.space.n_nodes, force.get_shape()[1]
        parts = [part.tocoo() for part in parts]
        rows = np.concatenate([3 * part.row + i for i, part in enumerate(parts)])
        columns, values = (np.concatenate([getattr(part, name) for part in parts]) for name in ("col", "data"))
        return sp.csr_matrix((values, (rows, columns)), shape=(3 * n, m))

    def compliance(self, material: Material, load: sp.csr_matrix) -> NDArray:
        """Fᵀ K⁻¹ F of nodal forces F, with the foot clamped."""
        free = np.ones(self.space.n_nodes, dtype=bool)
        free[self.space.boundary_nodes("clamp")] = False
        stiffness = self.space.stiffness(Lame.of(material.E, material.nu), free)
        inside = load[free_dofs(free, 3)].tocsr()
        return -schur_complement(stiffness, inside, np.zeros(0, dtype=np.int64))
