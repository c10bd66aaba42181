"""Fake of the finite element reference: the flank of the plate, whose result is known."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gearbench.compliance.plate import PlateTooth
from gearbench.contact.smooth import clear_compliance_cache
from gearbench.effects import tooth_bending
from gearbench.effects.teeth import plate_tooth
from gearbench.geometry.gear import Gear


@dataclass(frozen=True, eq=False)
class PlateFlank:
    """Stand-in for ``FlankCompliance``: the paper's plate, ``blocks`` times as compliant."""

    gear: Gear
    plate: PlateTooth
    blocks: float
    correction: float = 0.0
    error: float = 0.005
    driven: bool = False
    anchors: None = None
    attrs: dict = field(
        default_factory=lambda: {
            "unknowns": 9, "meshes": 1, "seconds": 2.0, "solver": "by hand", "element": "hex20", "cached": True,
        }
    )  # fmt: skip

    def factor(self, height, y):
        return np.sqrt(self.blocks) * self.plate.factor(height, y)

    shapes = factor

    def root(self, pairs=1, tolerance=0.0):
        return np.broadcast_to(np.eye(3), (pairs, 3, 3))


def plates_for_finite_elements(monkeypatch, softness: float = 1.0, correction: float = 0.0) -> None:
    """Replace the finite elements by the paper's plate, whose extrapolation adds ``correction`` × accuracy."""

    def flank(body, material, accuracy):
        return PlateFlank(body.gear, plate_tooth(body.gear, material, None, False), softness, correction * accuracy)

    monkeypatch.setattr(tooth_bending, "fe_flank", flank)
    clear_compliance_cache()  # they may come from another softness
