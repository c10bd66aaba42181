"""Work–precision of finite elements: every element on meshes of every level, and the accuracy asked of the mesh.

Mesh m has m cells across the tooth and cells in proportion elsewhere, see ``fem_reference.refinement``. The reference
is Richardson's value of the two finest meshes of 20-node hexahedra, its error bar half the difference to the value of
the two meshes before. Each element runs in a process of its own, from coarse to fine, after its libraries are loaded
and a first small mesh is solved: a run meshes and solves both gears and solves the mesh cycle.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.knobs import FE_ACCURACY
from gearbench.accuracy.measure import relative_errors
from gearbench.cost.apart import apart, most_megabytes, timed
from gearbench.cost.measure import measure
from gearbench.cost.workprecision import Curve, FlankErrors, curve_of
from gearbench.effects.base import LowRank, ToothCompliance
from gearbench.effects.fe_compliance import FeCompliance, side_by_side
from gearbench.errors import GearbenchError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.scene import Scene
from gearbench.simulation import cycle_values

if TYPE_CHECKING:
    from fem_reference.compliance import FlankCompliance
    from fem_reference.section import Body

_LOG = logging.getLogger(__name__)

#: Meshes of each element: cells across the tooth. Quadratic ones are coarser than the finest of the reference.
LEVELS: dict[str, tuple[int, ...]] = {
    "hex8": (2, 3, 4, 6, 8, 12),
    "hex20": (2, 3, 4, 5, 6, 8),
    "hex27": (2, 3, 4, 5, 6),
    "tet10": (2, 3, 4, 5, 6, 7),
}
#: What is known of their orders.
EXPECTED = {
    "hex8": "2 at most; bends too little",
    "hex20": "2.4 to 2.8: the load ends with a jump",
    "hex27": "2.4 to 2.8: the load ends with a jump",
    "tet10": "not known: the meshes are irregular",
}
#: Runs shorter than this [s] are repeated, medians count.
SHORT, REPEATS = 2.0, 3


@dataclass(frozen=True, kw_only=True)
class GivenFlanks(ToothCompliance):
    """Teeth of given compliances, in place of ``fe_compliance``: pinion and wheel, the wheel's driven."""

    flanks: tuple[FlankCompliance, FlankCompliance]
    coupled: bool

    name: ClassVar[str] = FeCompliance.name
    summary: ClassVar[str] = "compliance: both gears by finite elements on meshes that are given"
    source: ClassVar[str] = FeCompliance.source

    def compliance(self, lines: ContactLines) -> LowRank:
        """As ``FeCompliance.compliance``."""
        return side_by_side(self.flanks, lines, coupled=self.coupled)

    def tooth_factor(self, pair: Pair, k: int, height: NDArray, y: NDArray) -> NDArray:
        """As ``FeCompliance.tooth_factor``."""
        return self.flanks[k].factor(height, y)


@dataclass(frozen=True, kw_only=True)
class Meshes:
    """What is tried.

    Parameters
    ----------
    levels
        Meshes of each element, coarse to fine.
    reference
        Three meshes of 20-node hexahedra.
    accuracies
        Accuracies of ``fe_compliance``.
    """

    levels: Mapping[str, tuple[int, ...]]
    reference: tuple[int, ...]
    accuracies: tuple[float, ...]


def all_meshes(scene: Scene) -> Meshes:
    """All levels, coarser than the finest of a reference that is as fine as the unknowns allow."""
    reference = (4, 5, 6) if _effect(scene).support == "rim" else (6, 8, 10)
    while not _fits(scene, reference[-1]) and reference[0] > 2:
        reference = tuple(m - 1 for m in reference)
    levels = {kind: tuple(m for m in own if m < reference[-1] or kind == "hex8") for kind, own in LEVELS.items()}
    return Meshes(levels=levels, reference=reference, accuracies=FE_ACCURACY.levels(scene))  # type: ignore[arg-type]


def _fits(scene: Scene, m: int) -> bool:
    from fem_reference.mesh_family import MOST_UNKNOWNS, mesh_cells, unknowns

    return all(unknowns(body, mesh_cells(body, m)) <= MOST_UNKNOWNS for body in _bodies(scene))


def element_curves(scene: Scene, meshes: Meshes | None = None) -> list[Curve]:
    """Curves of finite elements over their meshes and of the accuracy of ``fe_compliance``, which the scene has."""
    tried = meshes or all_meshes(scene)
    runs = {**tried.levels, "hex20": tuple(sorted({*tried.levels.get("hex20", ()), *tried.reference}))}
    rows = {kind: apart(mesh_runs, scene, kind, levels) for kind, levels in runs.items()}
    exact, before = _limits(scene, [row for row in rows["hex20"] if row["level"] in tried.reference])
    bar = 0.5 * relative_errors(before.values, exact.values), 0.5 * exact.distance(before.blocks)
    kept = {kind: [row for row in rows[kind] if row["level"] in levels] for kind, levels in tried.levels.items()}
    curves = [_mesh_curve(kind, found, exact, bar) for kind, found in kept.items()]
    return [*curves, _accuracy_curve(scene, tried.accuracies, exact, bar)]


@dataclass(frozen=True, kw_only=True)
class _Limit:
    """What meshes converge to: the four numbers, (4,), and the blocks of both gears, see ``FlankCompliance``."""

    values: NDArray
    blocks: tuple[NDArray, ...]

    def distance(self, blocks: Sequence[NDArray]) -> float:
        """Relative error of the compliance in the Frobenius norm, of the gear where it is larger."""
        norm = np.linalg.norm
        return max(float(norm(b - own) / norm(own)) for b, own in zip(blocks, self.blocks, strict=True))


def _limits(scene: Scene, rows: Sequence[dict[str, Any]]) -> tuple[_Limit, _Limit]:
    """Richardson's value of the last two of three meshes, and of the first two."""
    from fem_reference.mesh_family import RATE

    found = []
    for coarse, fine in ((rows[1], rows[2]), (rows[0], rows[1])):
        gain = (fine["level"] / coarse["level"]) ** RATE - 1
        pairs = zip(coarse["blocks"], fine["blocks"], strict=True)
        blocks = tuple(np.array(f) + (np.array(f) - np.array(c)) / gain for c, f in pairs)
        found.append(_Limit(values=cycle_values(with_blocks(scene, blocks)), blocks=blocks))
    return found[0], found[1]


def _mesh_curve(kind: str, rows: Sequence[dict[str, Any]], exact: _Limit, bar: tuple[NDArray, float]) -> Curve:
    columns = {name: np.array([row[name] for row in rows]) for name in ("level", "unknowns", *_COST)}
    return Curve(
        knob=f"mesh, {kind}",
        expected=EXPECTED[kind],
        labels=tuple(str(m) for m in columns["level"]),
        sizes=columns["level"].astype(float),
        errors=np.array([relative_errors(row["values"], exact.values) for row in rows]),
        bar=bar[0],
        flank=FlankErrors(
            errors=np.array([exact.distance([np.array(b) for b in row["blocks"]]) for row in rows]),
            bar=bar[1],
            unknowns=columns["unknowns"].astype(float),
        ),
        **{name: columns[name] for name in _COST},
    )


_COST = ("seconds", "processor_seconds", "megabytes")


def _accuracy_curve(scene: Scene, accuracies: Sequence[float], exact: _Limit, bar: tuple[NDArray, float]) -> Curve:
    """Accuracies that ``fe_compliance`` is asked for; those out of reach of its meshes are left out."""
    levels, runs, errors, unknowns = [], [], [], []
    for level in accuracies:
        asked = FE_ACCURACY.with_level(scene, level)
        try:
            runs.append(measure(asked, 1, prepares=True))
        except GearbenchError:  # AccuracyError: said by the mesh family, see fem_reference.refinement
            break
        flanks = [_effect(asked).flank(scene.pair, k) for k in range(2)]
        levels.append(level)
        errors.append(exact.distance([f.blocks for f in flanks]))
        unknowns.append(max(f.attrs["unknowns"] for f in flanks))
    flank = FlankErrors(errors=np.array(errors), bar=bar[1], unknowns=np.array(unknowns, dtype=float))
    return replace(curve_of(FE_ACCURACY, levels, runs, exact.values, bar[0]), flank=flank)


def mesh_runs(scene: Scene, kind: str, levels: Sequence[int]) -> list[dict[str, Any]]:
    """What meshes of an element answer and cost, for a process of its own.

    Returns
    -------
    By level: the four numbers ``values``, the ``blocks`` of both gears, the ``unknowns`` of the larger one,
    ``seconds``, ``processor_seconds``, and ``megabytes`` beyond the libraries. Meshes that cannot be made are left out.
    """
    from fem_reference.environment import import_gmsh
    from fem_reference.tooth_mesh import MeshingError

    import_gmsh()
    before, rows = most_megabytes(), []
    _solved(scene, "hex8", 2)  # first calls load libraries and compile
    for m in levels:
        try:
            (values, flanks), wall, processor = timed(lambda m=m: _solved(scene, kind, m))
        except MeshingError as error:
            _LOG.warning("mesh %d of %s is left out: %s", m, kind, error)
            continue
        runs = [(wall, processor)]
        while len(runs) < (REPEATS if wall < SHORT else 1):
            runs.append(timed(lambda m=m: _solved(scene, kind, m))[1:])
        rows.append(
            {
                "level": m,
                "values": values.tolist(),
                "blocks": [flank.blocks.tolist() for flank in flanks],
                "unknowns": max(flank.attrs["unknowns"] for flank in flanks),
                "seconds": median(run[0] for run in runs),
                "processor_seconds": median(run[1] for run in runs),
                "megabytes": most_megabytes() - before,
            }
        )
    return rows


def _solved(scene: Scene, kind: str, m: int) -> tuple[NDArray, list[FlankCompliance]]:
    """The four numbers with meshes m of an element, and the compliances of both gears."""
    from fem_reference.compliance import flank_compliance
    from fem_reference.mesh_family import mesh_cells
    from fem_reference.refinement import default_order
    from fem_reference.tooth_mesh import tooth_mesh

    flanks = []
    for body in _bodies(scene):
        mesh = tooth_mesh(body, mesh_cells(body, m), kind)
        flanks.append(flank_compliance(mesh, scene.pair.material, default_order(body.gear)))
    return cycle_values(_with_flanks(scene, flanks)), flanks


def with_blocks(scene: Scene, blocks: Sequence[NDArray]) -> Scene:
    """``scene`` with the compliance blocks of both gears given in place of ``fe_compliance``."""
    from fem_reference.compliance import FlankCompliance
    from fem_reference.refinement import default_order

    flanks = [
        FlankCompliance(gear=gear, order=default_order(gear), blocks=b, error=math.nan, attrs={})
        for gear, b in zip(scene.pair.gears, blocks, strict=True)
    ]
    return _with_flanks(scene, flanks)


def _with_flanks(scene: Scene, flanks: Sequence[FlankCompliance]) -> Scene:
    given = GivenFlanks(flanks=(flanks[0], replace(flanks[1], driven=True)), coupled=_effect(scene).support == "rim")
    return replace(scene, effects=tuple(given if e.name == given.name else e for e in scene.effects))


def _effect(scene: Scene) -> FeCompliance:
    effect = scene.effect(FeCompliance.name)
    assert isinstance(effect, FeCompliance)
    return effect


def _bodies(scene: Scene) -> list[Body]:
    return [_effect(scene).body(scene.pair, k) for k in range(2)]
