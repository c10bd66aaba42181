"""Work–precision of finite elements: every element type on meshes of every level, and the requested accuracy.

Mesh m has m cells across the tooth and cells in proportion elsewhere, see ``fem_reference.refinement``. The reference
is the Richardson extrapolation from the two finest meshes of 20-node hexahedra; its error bar is half the difference
to the extrapolation from the two meshes before. Every element type runs in a new process, from coarse to fine, after
its libraries are loaded and a first small mesh is solved. A timed run meshes and solves both gears and solves the mesh
cycle.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import relative_errors
from gearbench.accuracy.settings import FE_ACCURACY, label
from gearbench.compliance.flank import FlankCompliance
from gearbench.effects.base import ComplianceEffect, Dense, Effects, Flanks, LowRank
from gearbench.effects.gear_body import GearBody
from gearbench.effects.tooth_bending import ToothBending, tooth_bending
from gearbench.effort.clock import Cost, apart, medians, most_megabytes, timed
from gearbench.effort.curves import Point, WorkPrecision, run
from gearbench.errors import GearbenchError
from gearbench.geometry.action import ContactLines
from gearbench.scene import Scene
from gearbench.solution import cycle_values
from gearbench.validation.reference import finite_elements, meshed_flanks

if TYPE_CHECKING:
    from fem_reference.section import Body

_LOG = logging.getLogger(__name__)

#: Element type → cells across the tooth of its meshes, and expected order of convergence. Meshes of quadratic elements
#: are coarser than the finest mesh of the reference.
ELEMENTS: dict[str, tuple[tuple[int, ...], str]] = {
    "hex8": ((2, 3, 4, 6, 8, 12), "2 at most; bends too little"),
    "hex20": ((2, 3, 4, 5, 6, 8), "2.4 to 2.8: the load ends with a jump"),
    "hex27": ((2, 3, 4, 5, 6), "2.4 to 2.8: the load ends with a jump"),
    "tet10": ((2, 3, 4, 5, 6, 7), "not known: the meshes are irregular"),
}
#: Runs shorter than SHORT [s] are done REPEATS times, and the median counts.
SHORT, REPEATS = 2.0, 3


@dataclass(frozen=True, kw_only=True)
class Meshed(ComplianceEffect):
    """Compliance of pinion and wheel (driven) on given, solved meshes; replaces tooth bending and gear body."""

    both: tuple[FlankCompliance, FlankCompliance]
    coupled: bool

    name: ClassVar[str] = "meshed"
    summary: ClassVar[str] = "compliance: both gears by finite elements on meshes that are given"
    source: ClassVar[str] = ToothBending.source

    def compliance(self, lines: ContactLines, effects: Effects) -> LowRank | Dense:
        """Factors of both gears concatenated, (position, pair, segment, rank), or the dense matrix if pairs couple."""
        return Flanks(both=self.both, coupled=self.coupled).on(lines)


@dataclass(frozen=True, kw_only=True)
class Meshes:
    """Meshes and accuracies to measure.

    Parameters
    ----------
    levels
        Element type → meshes m, coarse to fine.
    reference
        Three meshes m of 20-node hexahedra.
    accuracies
        Requested accuracies of the scene's finite elements.
    """

    levels: Mapping[str, tuple[int, ...]]
    reference: tuple[int, ...]
    accuracies: tuple[float, ...]


def all_meshes(scene: Scene) -> Meshes:
    """Choose the finest reference that the limit of unknowns allows, and all levels coarser than it (all of hex8)."""
    reference = (4, 5, 6) if scene.effect(GearBody.name) else (6, 8, 10)
    while not _fits(scene, reference[-1]) and reference[0] > 2:
        reference = tuple(m - 1 for m in reference)
    levels = {k: tuple(m for m in own if m < reference[-1] or k == "hex8") for k, (own, _) in ELEMENTS.items()}
    return Meshes(levels=levels, reference=reference, accuracies=FE_ACCURACY.levels(scene))


def _fits(scene: Scene, m: int) -> bool:
    from fem_reference.mesh_family import MOST_UNKNOWNS, mesh_cells, unknowns

    return all(unknowns(body, mesh_cells(body, m)) <= MOST_UNKNOWNS for body in _bodies(scene))


def element_curves(scene: Scene, meshes: Meshes | None = None) -> list[WorkPrecision]:
    """Curves of a scene's finite elements over meshes and over requested accuracy; none for other tooth models."""
    if tooth_bending(scene.effects_by_name, "finite_elements") is None:
        return []
    tried = meshes or all_meshes(scene)
    runs = {**tried.levels, "hex20": tuple(sorted({*tried.levels.get("hex20", ()), *tried.reference}))}
    rows = {kind: apart(mesh_runs, scene, kind, levels) for kind, levels in runs.items()}
    exact, before = _limits(scene, [row for row in rows["hex20"] if row["level"] in tried.reference])
    points = {
        f"mesh, {kind}": (ELEMENTS[kind][1], [exact.point(row) for row in rows[kind] if row["level"] in levels])
        for kind, levels in tried.levels.items()
    }
    points[FE_ACCURACY.name] = FE_ACCURACY.order, _accuracy_points(scene, tried.accuracies, exact)
    bar = 0.5 * relative_errors(before.values, exact.values), 0.5 * exact.distance(before.blocks)
    return [
        WorkPrecision(setting=name, expected=order, points=tuple(found), bar=bar[0], compliance_bar=bar[1])
        for name, (order, found) in points.items()
    ]


@dataclass(frozen=True, kw_only=True)
class _Limit:
    """Extrapolated limit of the meshes: the four numbers, (4,), and the blocks of both gears (``FlankCompliance``)."""

    values: NDArray
    blocks: tuple[NDArray, ...]

    def distance(self, blocks: Sequence[NDArray]) -> float:
        """Relative error of the compliance in the Frobenius norm, the larger of both gears."""
        norm = np.linalg.norm
        return max(float(norm(b - own) / norm(own)) for b, own in zip(blocks, self.blocks, strict=True))

    def point(self, row: Mapping[str, Any]) -> Point:
        """Convert a row of ``mesh_runs`` to a point of a curve."""
        return Point(
            label=str(row["level"]),
            size=row["level"],
            errors=relative_errors(row["values"], self.values),
            cost=Cost(**row["cost"]),
            compliance_error=self.distance([np.array(b) for b in row["blocks"]]),
            unknowns=row["unknowns"],
        )


def _limits(scene: Scene, rows: Sequence[dict[str, Any]]) -> tuple[_Limit, _Limit]:
    """Richardson extrapolations from the last two of three meshes, and from the first two."""
    from fem_reference.mesh_family import RATE

    found = []
    for coarse, fine in ((rows[1], rows[2]), (rows[0], rows[1])):
        gain = (fine["level"] / coarse["level"]) ** RATE - 1
        pairs = zip(coarse["blocks"], fine["blocks"], strict=True)
        blocks = tuple(np.array(f) + (np.array(f) - np.array(c)) / gain for c, f in pairs)
        found.append(_Limit(values=cycle_values(with_blocks(scene, blocks)), blocks=blocks))
    return found[0], found[1]


def _accuracy_points(scene: Scene, accuracies: Sequence[float], exact: _Limit) -> list[Point]:
    """Points of the requested accuracies, coarse to fine, up to the first that the meshes cannot reach."""
    points = []
    for level in accuracies:
        asked = FE_ACCURACY.with_level(scene, level)
        try:
            values, cost = run(asked, 1, prepares=True)
        except GearbenchError:  # AccuracyError of fem_reference.refinement
            break
        flanks = meshed_flanks(asked)
        point = Point(
            label=label(level),
            size=FE_ACCURACY.size(level),
            errors=relative_errors(values, exact.values),
            cost=cost,
            compliance_error=exact.distance([f.blocks for f in flanks]),
            unknowns=max(f.attrs["unknowns"] for f in flanks),
        )
        points.append(point)
    return points


def mesh_runs(scene: Scene, kind: str, levels: Sequence[int]) -> list[dict[str, Any]]:
    """Solve the meshes of one element type and measure their cost; meant to run in a new process.

    Returns
    -------
    One row per level: the four numbers ``values``, the ``blocks`` of both gears, the ``unknowns`` of the larger mesh,
    and the ``cost`` without the memory of the libraries. Meshes that cannot be made are left out.
    """
    from fem_reference.environment import import_gmsh
    from fem_reference.tooth_mesh import MeshingError

    import_gmsh()
    before, rows = most_megabytes(), []
    _solved(scene, "hex8", 2)  # the first call loads libraries and compiles
    for m in levels:
        try:
            (values, flanks), cost = timed(lambda m=m: _solved(scene, kind, m))
        except MeshingError as error:
            _LOG.warning("mesh %d of %s is left out: %s", m, kind, error)
            continue
        costs = [cost]
        while len(costs) < (REPEATS if cost.seconds < SHORT else 1):
            costs.append(timed(lambda m=m: _solved(scene, kind, m))[1])
        rows.append(
            {
                "level": m,
                "values": values.tolist(),
                "blocks": [flank.blocks.tolist() for flank in flanks],
                "unknowns": max(flank.attrs["unknowns"] for flank in flanks),
                "cost": asdict(medians(costs)) | {"megabytes": most_megabytes() - before},
            }
        )
    return rows


def _solved(scene: Scene, kind: str, m: int) -> tuple[NDArray, list[FlankCompliance]]:
    """Compute the four numbers with mesh m of an element type, and the compliances of both gears."""
    from fem_reference.compliance import flank_compliance
    from fem_reference.mesh_family import mesh_cells
    from fem_reference.refinement import default_order
    from fem_reference.tooth_mesh import tooth_mesh

    flanks = []
    for body, material in zip(_bodies(scene), scene.pair.materials, strict=True):
        mesh = tooth_mesh(body, mesh_cells(body, m), kind)
        flanks.append(flank_compliance(mesh, material, default_order(body.gear)))
    return cycle_values(_with_flanks(scene, flanks)), flanks


def with_blocks(scene: Scene, blocks: Sequence[NDArray]) -> Scene:
    """Return ``scene`` with given compliance blocks of both gears instead of tooth bending and gear body."""
    from fem_reference.refinement import default_order

    flanks = [
        FlankCompliance(gear=gear, order=default_order(gear), blocks=b)
        for gear, b in zip(scene.pair.gears, blocks, strict=True)
    ]
    return _with_flanks(scene, flanks)


def _with_flanks(scene: Scene, flanks: Sequence[FlankCompliance]) -> Scene:
    coupled = scene.effect(GearBody.name) is not None
    given = Meshed(both=(flanks[0], replace(flanks[1], driven=True)), coupled=coupled)
    kept = (effect for effect in scene.effects if effect.name not in (ToothBending.name, GearBody.name))
    return replace(scene, effects=(given, *kept))


def _bodies(scene: Scene) -> list[Body]:
    return [finite_elements(scene).body(scene.pair, index, scene.effects_by_name) for index in (0, 1)]
