"""Doubts about systems: told where something is hardly meant, silent otherwise."""

import pytest

from gearbench.errors import InputError
from gearbench.results.provenance import doubts
from tests.support.systems import shafts, spur_scene

SUPPORT = {"radial_stiffness": 250.0, "axial_stiffness": 150.0}
WHEEL = {"sections": [{"length": 100.0, "diameter": 60.0}], "bearings": [{"position": p, **SUPPORT} for p in (0.0, 100.0)]}  # fmt: skip  # noqa: E501
BALL = {"kind": "deep_groove_ball", "bore": 40.0, "outside": 80.0}


def on(pinion=None, **more):
    return spur_scene(shafts(pinion, WHEEL | more))


@pytest.mark.parametrize(
    ("scene", "match"),
    [
        (on({"sections": [{"length": 200.0, "diameter": 72.0}]}), "thicker than its root circle, 67.5 mm"),
        (on({"gears": [{"gear": "pinion", "position": 70.0, "inertia": 900.0}]}), "inertia 900 kg·m²"),
        (on({"coupling": {"position": 0.0, "inertia": 2e4}}), "2e+04 kg·m² coupled"),
        (on({"bearings": [{"position": 70.0, "rolling": BALL}]}), "one bearing alone"),
        (on({"bearings": [{"position": p, "rolling": BALL | {"clearance": 0.02}} for p in (0.0, 200.0)]}), "0.02 µm"),
        (spur_scene({"pinion": {"inertia": 2e3}}), "system.pinion.inertia 2e"),
    ],
)
def test_what_is_hardly_meant_is_told(scene, match):
    assert any(match in line for line in doubts(scene))


def test_usual_systems_are_not_doubted():
    assert (
        doubts(on({"bearings": [{"position": p, "rolling": BALL | {"clearance": 20.0}} for p in (0.0, 200.0)]})) == ()
    )
    assert doubts(spur_scene({"pinion": {"inertia": 2e-3}})) == ()


def test_tapers_that_carry_one_way_are_named():
    taper = {"kind": "tapered_roller", "bore": 40.0, "outside": 80.0, "width": 20.0, "carries": "forward"}
    from gearbench import simulate

    with pytest.raises(InputError, match="forward on all: one must carry the other direction"):
        simulate(on({"bearings": [{"position": p, "rolling": taper} for p in (0.0, 200.0)]}))
