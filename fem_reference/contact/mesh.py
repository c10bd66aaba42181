"""Sections of both gears in their positions, in curved triangles that are fine where flanks may touch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.contact.placement import AT_EDGE, Placement, Touch
from fem_reference.plane import Patch, section_mesh
from fem_reference.section import Body, Side, on_tooth
from gearbench.compliance.edge import edge_distance
from gearbench.effects.teeth import require_bores, support_of

#: Largest number of teeth on the sector.
_TEETH = 7


@dataclass(frozen=True, kw_only=True)
class Fineness:
    """Fineness of the mesh.

    Parameters
    ----------
    contact
        Edge length where flanks touch, in half-widths of Hertz's contact strip.
    size
        Edge length away from it, in normal modules.
    growth
        How fast it grows between the two, per distance.
    """

    contact: float = 0.33
    size: float = 0.35
    growth: float = 0.4

    def halved(self) -> Fineness:
        """Half as many elements: edges √2 longer."""
        return Fineness(contact=self.contact * math.sqrt(2), size=self.size * math.sqrt(2), growth=self.growth * 1.2)

    def doubled(self) -> Fineness:
        """Twice as many elements: edges √2 shorter."""
        return Fineness(contact=self.contact / math.sqrt(2), size=self.size / math.sqrt(2), growth=self.growth / 1.2)


@dataclass(frozen=True, kw_only=True)
class Seat:
    """A gear in one of its meshes.

    Parameters
    ----------
    placement, index
        The mesh, and which of its gears it is.
    touches
        Tooth pairs that may touch.
    name
        Name of the mesh, with which the names of its surfaces begin.
    side
        The loaded flank. A mesh of left flanks is the placement mirrored at the line of centres.
    turned
        Number, in the mesh of the gear, of the tooth that is tooth 0 of this mesh.
    origin
        Centre of the placement's pinion [mm].
    """

    placement: Placement
    index: int
    touches: Sequence[Touch]
    name: str = ""
    side: Side = Side.RIGHT
    turned: int = 0
    origin: tuple[float, float] = (0.0, 0.0)

    def tooth(self, k: int) -> int:
        """Tooth of pair k in the mesh of the gear, counted clockwise."""
        z = abs(self.placement.pair.gears[self.index].teeth)
        first = (z - 1) // 2
        return (self.turned + self.side * self.placement.tooth(self.index, k) + first) % z - first

    def label(self, k: int) -> str:
        """Name of the surfaces of tooth pair k."""
        return self.name + (f"P{k}" if k >= 0 else f"M{-k}")

    def placed(self, points: NDArray) -> NDArray:
        """Points (2, n) of the gear's frame in the common frame."""
        mirror = np.array([[float(self.side)], [1.0]])
        return np.array(self.origin)[:, None] + mirror * self.placement.placed(self.index, mirror * points)


@dataclass(frozen=True, kw_only=True)
class GearMesh:
    """Section of one gear in its position.

    Parameters
    ----------
    points
        (2, node) [mm].
    triangles
        Nodes of the quadratic triangles, corners counter-clockwise, then the middles of the edges, (6, triangle).
    bore
        Nodes of the bore.
    surfaces
        Name of a tooth pair → (triangle, edge number 0 … 2) of the edges that may touch.
    free
        Length of the outside that each node of the bore stands for, of a ring that is free but for its motion as a
        rigid body [mm]; None where the bore is held.
    """

    points: NDArray
    triangles: NDArray
    bore: NDArray
    surfaces: dict[str, NDArray]
    free: NDArray | None = None


def half_width(placement: Placement, touch: Touch, line_load: float) -> float:
    """Half-width of Hertz's contact strip a = √(4 q ρ / π E*) [mm] under a line load q [N/mm]."""
    pair = placement.pair
    least, both = 0.05 * pair.normal_module, zip(touch.radii, pair.gears, strict=True)
    rho = [g.sign * max(math.sqrt(max(r**2 - g.base_radius**2, 0.0)), least) for r, g in both]
    return math.sqrt(4 * line_load * (rho[0] * rho[1] / sum(rho)) / (math.pi * pair.contact_modulus))


def gear_mesh(seats: Sequence[Seat], line_loads: tuple[float, float], fineness: Fineness) -> GearMesh:
    """Mesh of one gear in all its meshes, modified flanks included, placed in the first; all its teeth if it has two.

    ``line_loads`` [N/mm]: least and greatest that a pair carries, for the size of the elements where flanks touch and
    for how far they are that small.

    Raises
    ------
    MeshingError
        If the section cannot be meshed.
    """
    pair, index = seats[0].placement.pair, seats[0].index
    gear, (support, _) = pair.gears[index], support_of(pair, index)
    # the teeth of a ring are much of its stiffness
    teeth = _TEETH if gear.teeth >= _TEETH + 2 and len(seats) == 1 else abs(gear.teeth)
    body = Body(gear=gear, bore_radius=require_bores(pair)[index] / 2, teeth=teeth)
    touches = [(seat, touch) for seat in seats for touch in seat.touches]
    patches = []
    for seat, touch in touches:
        R = touch.radii[seat.index]
        a, widest = (half_width(seat.placement, touch, load) for load in line_loads)
        half_angle = float(gear.half_angle(np.clip(R, gear.root_radius, gear.tip_radius)))
        angle = seat.side * half_angle + seat.tooth(touch.pair) * body.pitch_angle
        x, y = R * math.sin(angle), R * math.cos(angle)
        usual = fineness.contact * a
        patches.append(Patch(x=x, y=y, radius=2 * widest, size=usual))
        patches.append(Patch(x=x, y=y, radius=0.0, size=usual * _at_edge(seat, touch, widest)))
    mesh = section_mesh(body, patches, fineness.size, fineness.growth)
    points, boundaries = mesh.doflocs.copy(), mesh.boundaries
    triangles, edges_of = _triangles(mesh)
    surfaces = {}
    for seat, touch in touches:
        d, side = seat.tooth(touch.pair), seat.side.label
        parts = [on_tooth(part, d) for part in (f"{side}_fillet", f"{side}_flank", "tip")]
        facets = np.concatenate([boundaries[name] for name in parts if name in boundaries])
        surfaces[seat.label(touch.pair)] = np.array([(mesh.f2t[0, f], edges_of[int(f)]) for f in facets])
        _modify(seat, touch.pair, points)
    middle = mesh.dofs.facet_dofs[0][boundaries["bore"]]
    ends = mesh.facets[:, boundaries["bore"]]
    bore_nodes = np.union1d(ends.ravel(), middle)
    weight = np.zeros(points.shape[1])  # of quadratic edges: 1, 4 and 1 sixths of their length
    length = np.hypot(*(points[:, ends[1]] - points[:, ends[0]]))
    for nodes, share in ((ends[0], 1 / 6), (ends[1], 1 / 6), (middle, 4 / 6)):
        np.add.at(weight, nodes, share * length)
    return GearMesh(
        points=seats[0].placed(points),
        triangles=triangles,
        bore=bore_nodes,
        surfaces=surfaces,
        free=weight[bore_nodes] if support == (0.0, 0.0) else None,
    )


def _at_edge(seat: Seat, touch: Touch, a: float) -> float:
    """Size where flanks touch, as a share of that in strips of half-width ``a``: small near a tip, which cuts them."""
    both = zip(seat.placement.pair.gears, touch.radii, strict=True)
    nearest = min(float(edge_distance(gear, gear.roll_length(R))) for gear, R in both)
    return float(np.clip(nearest / (2 * a), AT_EDGE, 1.0))


def _triangles(mesh: object) -> tuple[NDArray, dict[int, int]]:
    """Triangles in CalculiX's order, and of each boundary facet the number of its edge in its triangle."""
    t, dofs = mesh.t.copy(), mesh.dofs  # type: ignore[attr-defined]
    t2f = mesh.t2f.copy()  # type: ignore[attr-defined]
    x, y = mesh.doflocs[:, t]  # type: ignore[attr-defined]
    clockwise = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]) < 0
    corners = np.where(clockwise, t[[0, 2, 1]], t)
    # skfem's edges join corners 01, 12, 02
    facets = np.where(clockwise, t2f[[2, 1, 0]], t2f)
    number = {int(f): i for i in range(3) for f in facets[i]}
    boundary = set(mesh.boundary_facets().tolist())  # type: ignore[attr-defined]
    return np.vstack([corners, dofs.facet_dofs[0][facets]]), {f: i for f, i in number.items() if f in boundary}


def _modify(seat: Seat, k: int, points: NDArray) -> None:
    """Turn the nodes of the tooth of pair k by what is missing on its flank: all on the flank, none on its middle.

    Elements at the flank may be smaller than what is missing there: moved alone, its nodes would turn them over.
    """
    gear, profile = seat.placement.pair.gears[seat.index], seat.placement.profiles[seat.index]
    R, theta = gear.sign * np.hypot(*points), np.arctan2(*(gear.sign * points))
    on_profile = np.clip(R, gear.form_radius, gear.tip_radius)
    centre = 2 * math.pi / gear.teeth * seat.tooth(k)
    # from the middle of the tooth towards its loaded flank
    away = seat.side * ((theta - centre + math.pi) % (2 * math.pi) - math.pi)
    across = away / gear.half_angle(on_profile)
    up = np.clip((R - gear.root_radius) / (gear.form_radius - gear.root_radius), 0.0, 1.0)
    # the loaded half of this tooth, and not the next one
    on_flank = (across > 0) & (away * gear.teeth < math.pi) & (up > 0)
    missing = profile.missing(on_profile[on_flank], k) / gear.base_radius
    theta[on_flank] -= seat.side * missing * np.minimum(across[on_flank], 1.0) * up[on_flank]
    points[:] = R * np.array([np.sin(theta), np.cos(theta)])
