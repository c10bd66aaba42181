"""The hard cases with the solid tooth and with elastic gear bodies in place of the plate: solved, finite, k > 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.solver import solve
from gearbench.effects.base import Effect
from gearbench.effects.gear_body import GearBody
from gearbench.effects.tooth_bending import ToothBending
from gearbench.scene import Scene
from tests.stability.catalogue import CASES
from tests.stability.models import ONE_PAIR
from tests.support.contact_invariants import assert_solved

SOLID = ToothBending(model="solid")
MODELS: dict[str, tuple[Effect, ...]] = {
    "solid": (SOLID,),
    "ring": (SOLID, GearBody(coupled=False)),
    "neighbours": (SOLID, GearBody()),
}
#: Those whose difficulty lies in the geometry or the material.
HARD = [c for c in CASES.values() if not c.slow and not c.name.startswith(ONE_PAIR)]
QUICK = {"undercut spur, z = 12", "β = 0.01°"}


def bored(scene: Scene) -> Scene:
    """Both gears with a bore of half the root diameter, where body models ask for one."""
    pair = scene.pair
    pinion, wheel = (
        replace(member, bore_diameter=gear.root_radius)
        for member, gear in zip((pair.pinion, pair.wheel), pair.gears, strict=True)
    )
    return replace(scene, pair=replace(pair, pinion=pinion, wheel=wheel))


@pytest.mark.parametrize(
    ("case", "model"),
    [pytest.param(c, m, id=f"{c.name}, {m}") for c in HARD if c.name in QUICK for m in MODELS]
    + [pytest.param(c, "neighbours", id=c.name, marks=pytest.mark.slow) for c in HARD if c.name not in QUICK],
)
def test_solved(case, model):
    scene = bored(case.build())
    scene = replace(scene, effects=(*MODELS[model], *scene.effects[1:]))
    edges = np.array(scene.pair.meshing.transition_phases)
    phases = np.unique(np.concatenate([[0.31, 0.77], edges, (edges + 1e-9) % 1.0]))
    s = solve(assemble(scene, scene_lines(scene, phases)))
    assert_solved(s, steps=30)
    assert s.corrected == 0
