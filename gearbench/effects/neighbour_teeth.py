"""Teeth in contact at the same time move each other through the gear body."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import LowRank, ToothCompliance
from gearbench.effects.solids import SolidOrder, gear_body, require_bores
from gearbench.geometry.action import ContactLines
from gearbench.geometry.material import STRICT
from gearbench.geometry.pair import Pair


@dataclass(frozen=True, kw_only=True, config=STRICT)
class NeighbourTeeth(ToothCompliance):
    """What the gear body adds to the deflection of all its teeth, whichever is loaded: foundation and coupling.

    The body is an elastic ring, held at the bore, with solid teeth joined to it along their roots. Needs
    ``bore_diameter`` of both gears. Takes the place of tooth_foundation, whose ring is the same without coupling.

    Parameters
    ----------
    order
        Functions of the solid tooth, [thickness, height, face width], by default 6, 7 and about one
        for each module of face width.
    """

    order: SolidOrder | None = None

    name: ClassVar[str] = "neighbour_teeth"
    summary: ClassVar[str] = "compliance: the gear body, through which all its teeth move each other"
    source: ClassVar[str] = "elastic ring with solid teeth, Fourier and Ritz"
    use: ClassVar[str] = "Instead of tooth_foundation where several pairs share the load on a thin rim."
    example: ClassVar[dict[str, Any]] = {}
    requires: ClassVar[dict[str, str]] = {"hertz": "the body alone does not determine the distribution of the load"}
    conflicts: ClassVar[dict[str, str]] = {
        "fe_compliance": "which has a gear body of its own",
        "tooth_foundation": "which is contained in it",
    }

    def check(self, pair: Pair) -> None:
        """Refuse gears without bore."""
        require_bores(pair)

    def compliance(self, lines: ContactLines) -> LowRank:
        """Factor of both gears side by side, shared by all pairs, (position, pair, segment, rank) (R8)."""
        bodies = [gear_body(lines.pair, k, self.order) for k in range(2)]
        roots = [body.root(lines.shape[1]) for body in bodies]
        ends = np.cumsum([0, *(root.shape[-1] for root in roots)])
        # filled in place: the factor is megabytes, and a copy of it costs as much as the products
        factor = np.empty((*lines.shape, ends[-1]))
        for k, gear in enumerate(lines.pair.gears):
            shapes = bodies[k].tooth.shapes(lines.radii[k] - gear.root_radius, lines.y)
            np.matmul(shapes, roots[k], out=factor[..., ends[k] : ends[k + 1]])
        return LowRank(factor=factor, coupled=True)

    def tooth_factor(self, pair: Pair, k: int, height: NDArray, y: NDArray) -> NDArray:
        """Ψ of one tooth by itself; see ``ToothCompliance``."""
        return gear_body(pair, k, self.order).factor(height, y)
