"""Shafts and bearings of SEW's three-stage gearbox, from its REXS file."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.dynamics.analysis import response
from gearbench.errors import InputError
from gearbench.exchange.rexs_document import read_document
from gearbench.exchange.rexs_system import system_scene
from tests.support.paths import DATA

SEW = DATA / "sew_3_stage_cylindrical_gearbox_1.0.rexs"


@pytest.mark.parametrize("stage", [1, 2, 3])
def test_stage_stands_on_the_shafts_of_the_file(stage):
    scene, notes = system_scene(read_document(SEW), stage)
    box = scene.gearbox
    assert [len(shaft.bearings) for shaft in scene.system.shafts] in ([2, 2, 3, 2], [2, 3, 2, 2], [3, 2, 2, 2])
    assert sum("catalogue" in note for note in notes) == 9
    # axes of the file are as far apart as its centre distances: 53, 57, 77 mm
    for name, pair in scene.pairs.items():
        p, w = (box.seats[(name, gear)][0] for gear in range(2))
        places = [box.train.places[scene.system.shafts[n].name] for n in (p, w)]
        assert_allclose(np.linalg.norm(places[0] - places[1]), pair.centre_distance, rtol=1e-6)
    # the motor turns clockwise at 1400: the next shaft the other way, and so on
    assert scene.system.rotation == ("counterclockwise" if stage == 2 else "clockwise")
    torques = {1: 4.724562306435156, 2: 4.724562306435156 * 67 / 23, 3: 4.724562306435156 * 67 / 23 * 76 / 13}
    assert_allclose(box.torques["pair"], torques[stage], rtol=1e-12)
    for other in {1, 2, 3} - {stage}:
        assert_allclose(box.torques[f"stage {other}"], torques[other], rtol=1e-9)


def test_shaft_of_the_file_section_by_section():
    scene, _ = system_scene(read_document(SEW), 1)
    shaft = next(s for s in scene.system.shafts if s.name.startswith("ANW"))
    assert len(shaft.sections) == 12
    assert shaft.length == pytest.approx(164.5)
    assert [bearing.position for bearing in shaft.bearings] == [65.5, 111.8]
    assert [bearing.rolling.floating for bearing in shaft.bearings] == [False, True]
    # gears 16 and 11 mm wide whose middles are 154 and 156.5: they share 151 … 162
    assert shaft.gears[0].position == pytest.approx(156.5)
    assert shaft.coupling.position == 20.0


@pytest.mark.slow
@pytest.mark.parametrize("stage", [1, 2, 3])
def test_each_stage_answers_over_speed(stage):
    """Forces of all meshes on all bearings; frequencies follow the ratios, mean forces the torques."""
    scene, _ = system_scene(read_document(SEW), stage)
    data = response(scene, speed=[300.0, 900.0], harmonics=3)
    assert data.sizes["mesh"] == 3
    assert (data["bearing_force_amplitude"] > 0).any()
    assert np.isfinite(data["bearing_force_amplitude"]).all()
    if stage == 1:
        ratios = np.cumprod([23, 13 / 67, 14 / 76])
        assert_allclose(data["mesh_frequency"], np.outer([5.0, 15.0], ratios), rtol=1e-12)
    torques = [scene.gearbox.torques[name] for name in scene.pairs]
    radii = [pair.gears[0].base_radius for pair in scene.pairs.values()]
    assert_allclose(data["mean_force"], 1e3 * np.array(torques) / radii, rtol=1e-12)


def test_bearing_of_unknown_kind_is_named(tmp_path):
    text = SEW.read_text().replace("radial_roller_bearing", "magnetic_bearing")
    path = tmp_path / "odd.rexs"
    path.write_text(text)
    with pytest.raises(InputError, match=r"odd\.rexs: component 50\.bearing_type = magnetic_bearing: must be one of"):
        system_scene(read_document(path), 1)
