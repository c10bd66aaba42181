"""m_k of teeth whose contact ends at the form circle, on their body: see ``docs/results_fronts.md``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.compliance.flank import FlankCompliance
from gearbench.effects import tooth_bending
from gearbench.effects.teeth import fe_body, fe_flank, ring_flank, solid_flank
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate

MEMBER = {"teeth": 17, "addendum": 0.73, "dedendum": 1.25, "bore_diameter": 20.0}
EFFECTS = {"tooth_bending": {"model": "solid"}, "gear_body": {}, "hertz": {}}


def gear(**tooth: object) -> Scene:
    """A gear of the front of tool 3, on teeth of a model."""
    pair = {"normal_module": 2.0, "helix_angle": 10.0, "face_width": 8.0, "centre_distance": 38.0}
    effects = EFFECTS | {"tooth_bending": {"model": "solid"} | tooth}
    tables = {"pair": pair | {"pinion": MEMBER, "wheel": MEMBER}, "load": {"torque": 10.0}, "effects": effects}
    return parse_scene(tables | {"resolution": {"positions": 16}})


def without_negative(block: NDArray) -> NDArray:
    value, vector = np.linalg.eigh(block)
    return (vector * np.maximum(value, 0.0)) @ vector.T


@pytest.fixture(scope="module")
def parts() -> tuple[FlankCompliance, NDArray, NDArray, NDArray]:
    """Finite elements on the body; the clamped tooth of finite elements, and of the solid; the ring (13, 25, 25)."""
    pair = gear().pair
    whole, clamped = (
        fe_flank(fe_body(pair, 0, on_body=on_body), pair.materials[0], 0.002) for on_body in (True, False)
    )
    solid, ring = solid_flank(pair, 0, None, True), ring_flank(pair, 0, None, 6)
    return whole, clamped.block(0), solid.block(0), ring.blocks


@pytest.mark.slow
def test_negative_directions_of_the_tooth_are_filled_by_its_body(parts, monkeypatch):
    whole, clamped, solid, ring = parts
    accuracy = 0.002

    def with_blocks(tooth: NDArray, added: NDArray) -> float:
        nonlocal accuracy
        accuracy += 1e-5  # a scene of its own
        blocks = added.copy()
        blocks[len(added) // 2] += tooth
        monkeypatch.setattr(tooth_bending, "fe_flank", lambda *_: replace(whole, blocks=blocks))
        scene = gear(model="finite_elements", accuracy=round(accuracy, 6))
        return float(simulate(scene, outputs=("mesh_stiffness_rms",)).mesh_stiffness_rms)

    def fast(*order: int) -> float:
        tooth = {"order": order} if order else {}
        return float(simulate(gear(**tooth), outputs=("mesh_stiffness_rms",)).mesh_stiffness_rms)

    exact = with_blocks(np.zeros_like(clamped), whole.blocks)
    shifts = [abs(value / exact - 1) for value in (fast(), fast(10, 11, 8), fast(14, 15, 6))]
    assert shifts == sorted(shifts, reverse=True)
    assert shifts[0] < 0.03
    assert shifts[2] < 0.01
    assert with_blocks(clamped, ring) / exact == pytest.approx(1.0, abs=0.01)
    for tooth in (solid, clamped):
        assert with_blocks(without_negative(tooth), ring) / exact == pytest.approx(0.93, abs=0.01)
