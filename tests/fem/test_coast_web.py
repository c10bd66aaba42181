"""A comparison on coast flanks, of a wheel whose web lies near one face: it is the flank loaded that is compared."""

from __future__ import annotations

import pytest
from numpy.testing import assert_allclose

from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load, Resolution, Scene
from gearbench.validation.comparison import compare
from gearbench.validation.judge import JUDGED


def webbed(offset: float, torque: float) -> Scene:
    wheel = Member(
        teeth=40, bore_diameter=20.0, rim_thickness=5.0, web_thickness=4.0, hub_diameter=34.0, web_offset=offset
    )
    return Scene(
        pair=Pair(
            normal_module=2.0,
            helix_angle=15.0,
            face_width=14.0,
            centre_distance=62.2,
            pinion=Member(teeth=20, bore_diameter=16.0),
            wheel=wheel,
        ),
        load=Load(torque=torque),
        effects=(ToothBending(model="solid", order=(4, 5, 6)), GearBody(), Hertz()),
        resolution=Resolution(positions=4, segments=12),
    )


@pytest.mark.slow
def test_coast_flanks_compare_like_drive_flanks_of_the_mirror_image(tmp_path, monkeypatch):
    """Every number, error bars and shapes among them."""
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    found = [compare(webbed(offset, torque), 0.05) for offset, torque in ((3.0, -60.0), (-3.0, 60.0))]
    # 4 of 14 mm thick: the mirror image is the same body to the last digit, and solved once
    assert len(list(tmp_path.glob("flank-*"))) == 2
    for name in (*JUDGED, "mac_worst", "line_mac_worst", "norm_ratio"):
        for number in (name, f"{name}_bar"):
            assert_allclose(found[0][number], found[1][number], rtol=1e-6, atol=1e-9, err_msg=number)
    other = compare(webbed(3.0, 60.0), 0.05)
    assert abs(other["norm_ratio"] - found[0]["norm_ratio"]).max() > 1e-4
