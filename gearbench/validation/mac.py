"""Modal assurance criterion (MAC) between the deflection shapes of two models, for many positions of a unit load.

The load acts at the centre of one of 6 × 9 equal cells of the active flank (height × face width). The deflection is
taken at the centres of 12 × 17 equal cells, so that sums over the points are proportional to means over the flank.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.transitions import mesh_phases
from gearbench.geometry.action import ContactLines
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.scene import Scene
from gearbench.validation.reference import smooth_effects

#: Number of cells along height and face width: for the load, and for the deflection.
LOADS, RESPONSES = (6, 9), (12, 17)


def mac(a: ArrayLike, b: ArrayLike) -> NDArray:
    """(aᵀb)² / ((aᵀa)(bᵀb)) over the first axis: 1 for shapes that differ only in scale, 0 for orthogonal ones."""
    one, other = _unit(a), _unit(b)
    return np.sum(one * other, axis=0) ** 2 / (np.sum(one**2, axis=0) * np.sum(other**2, axis=0))


def _unit(shapes: ArrayLike) -> NDArray:
    """Scale shapes to a largest value of one, so that squares of deflections in mm/N do not underflow."""
    values = np.asarray(shapes, dtype=float)
    return values / np.abs(values).max(axis=0)


@dataclass(frozen=True, kw_only=True)
class LoadGrid:
    """Centres of equal cells of the active flank of a gear: radii (height,) and positions y (position,) [mm]."""

    radius: NDArray
    y: NDArray

    def points(self, root_radius: float) -> tuple[NDArray, NDArray]:
        """Height above the root circle, and y, of all points [mm], both (height·position,)."""
        height, y = np.meshgrid(self.radius - root_radius, self.y, indexing="ij")
        return height.ravel(), y.ravel()


def flank_grid(pair: Pair, index: int, cells: tuple[int, int]) -> LoadGrid:
    """Grid of ``cells`` (along height, along face width) on the active flank of a gear."""
    low, high = pair.meshing.active_radii[index]
    up, across = ((np.arange(n) + 0.5) / n for n in cells)
    return LoadGrid(radius=low + (high - low) * up, y=pair.gears[index].face_width * across)


def tooth_factor(scene: Scene, index: int, height: NDArray, y: NDArray) -> NDArray:
    """Factor Ψ (…, rank) [√(mm/N)] of all smooth compliances of ``scene`` on a single tooth of a gear."""
    pair = coast_view(scene.pair) if scene.load.coast else scene.pair
    parts = [effect.tooth_factor(pair, index, height, y, scene.effects_by_name) for effect in smooth_effects(scene)]
    return np.concatenate(parts, axis=-1)


def coast_view(pair: Pair) -> Pair:
    """Mirror image of the pair, as its coast flanks see it: webs are offset towards the other face."""
    offsets = {GEARS[index]: member.web_offset for index, member in enumerate(pair.members)}
    if not any(offsets.values()):
        return pair
    return replace(
        pair, **{name: replace(getattr(pair, name), web_offset=-offset) for name, offset in offsets.items() if offset}
    )


def deflection_shapes(scene: Scene, index: int) -> NDArray:
    """Deflections of one tooth of a gear at the response points under unit loads, (response, load) [mm/N]."""
    load = tooth_factor(scene, index, *flank_grid(scene.pair, index, LOADS).points(scene.pair.gears[index].root_radius))
    return response_factor(scene, index) @ load.T


def response_factor(scene: Scene, index: int) -> NDArray:
    """Factor Ψ at the response points of a gear, (response, rank)."""
    return tooth_factor(
        scene, index, *flank_grid(scene.pair, index, RESPONSES).points(scene.pair.gears[index].root_radius)
    )


def line_shapes(scene: Scene, index: int, lines: ContactLines) -> NDArray:
    """Deflections under unit loads spread evenly over a contact line, (response, line); only lines in contact."""
    height = lines.radii[index][lines.active] - scene.pair.gears[index].root_radius
    share = lines.length[lines.active] / lines.length[lines.active].sum(axis=1, keepdims=True)
    load = np.einsum("ls,lsr->lr", share, tooth_factor(scene, index, height, lines.gear_y(index)[lines.active]))
    return response_factor(scene, index) @ load.T


def line_mac(fast: Scene, reference: Scene, index: int) -> tuple[float, float]:
    """Worst and mean MAC of the shapes under the contact lines of a mesh cycle; line lengths weight the mean."""
    phase, weight = mesh_phases(fast)
    lines = scene_lines(fast, phase)
    criterion = mac(*(line_shapes(scene, index, lines) for scene in (fast, reference)))
    return float(criterion.min()), float(
        np.average(criterion, weights=(weight[:, None] * lines.length.sum(axis=2))[lines.active])
    )


@dataclass(frozen=True, kw_only=True)
class ShapeComparison:
    """Comparison of the deflection shapes of one gear, fast model against reference.

    Parameters
    ----------
    loads
        Positions of the loads.
    mac, norm_ratio
        MAC, and ‖fast‖ / ‖reference‖, for every load, (height, position).
    compliance_ratio
        Ratio of the Frobenius norms over all loads; above 1, the fast model is softer than the reference.
    """

    loads: LoadGrid
    mac: NDArray
    norm_ratio: NDArray
    compliance_ratio: float


def compare_shapes(fast: Scene, reference: Scene, index: int) -> ShapeComparison:
    """Compare the deflection shapes of pinion (``index`` 0) or wheel (1) of two scenes with the same pair."""
    a, b = deflection_shapes(fast, index), deflection_shapes(reference, index)
    ratio = np.linalg.norm(a, axis=0) / np.linalg.norm(b, axis=0)
    return ShapeComparison(
        loads=flank_grid(fast.pair, index, LOADS),
        mac=mac(a, b).reshape(LOADS),
        norm_ratio=ratio.reshape(LOADS),
        compliance_ratio=float(np.linalg.norm(a) / np.linalg.norm(b)),
    )
