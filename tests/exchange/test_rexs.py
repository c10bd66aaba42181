"""REXS: a real gearbox stage by stage, units, what is missing, and files that must be refused."""

import math
import zipfile

import numpy as np
import pytest

from gearbench.errors import InputError
from gearbench.exchange import rexs_document
from gearbench.exchange.rexs import find_stage, read_rexs, stage_scene, stages
from gearbench.exchange.rexs_document import read_document
from gearbench.simulation import simulate
from tests.support.iso6336 import norm_stiffness
from tests.support.paths import DATA

SEW = DATA / "sew_3_stage_cylindrical_gearbox_1.0.rexs"
#: One stage in the dialect of REXS 1.6, every attribute where that version has it.
MODEL = (DATA / "stage_1.6.rexs").read_text(encoding="utf-8")

#: Read off the file by eye: teeth, m_n, β, b, a′, x of both gears.
SIZES = {
    1: ((23, 67), 1.0, 30.0, 11.0, 53.0, (0.581, 0.5131)),
    2: ((13, 76), 1.25, 10.0, 15.0, 57.0, (0.521, -0.094)),
    3: ((14, 87), 1.5, 10.0, 36.0, 77.0, (0.536, -0.4815)),
}


def write(folder, text, name="model.rexs"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def without_load_cases():
    return MODEL[: MODEL.index("  <load_spectrum")] + "</model>\n"


def change(old, new, text=MODEL):
    assert old in text
    return text.replace(old, new)


# -- the real gearbox -------------------------------------------------------------------------------------------------


def test_stages_are_listed_in_file_order():
    found = stages(read_document(SEW))
    assert [(s.number, s.component.id, s.gears[0].id, s.gears[1].id) for s in found] == [
        (1, 6, 23, 34), (2, 37, 38, 52), (3, 55, 56, 69),
    ]  # fmt: skip


@pytest.mark.parametrize("number", SIZES)
def test_sizes_of_the_real_stages(number):
    teeth, module, helix, width, distance, shifts = SIZES[number]
    pair = read_rexs(SEW, number).pair
    assert (pair.pinion.teeth, pair.wheel.teeth) == teeth
    assert (pair.normal_module, pair.helix_angle, pair.face_width) == (module, helix, width)
    assert (pair.centre_distance, pair.pressure_angle) == (distance, 20.0)
    # the file gives the sum of the shifts to 4 decimals, and it is the sum without backlash (ISO 21771): two
    # programs agree on centre distance, helix and pressure angle
    np.testing.assert_allclose(pair.profile_shifts, shifts, atol=6e-5)
    assert 0 <= pair.actual_backlash < 2e-5


def test_torque_runs_along_the_shafts():
    # the input torque in the file is the one that makes the output 500 N·m without losses
    torques = [read_rexs(SEW, number).load.torque for number in SIZES]
    np.testing.assert_allclose(torques[0], 4.724562306435156, rtol=1e-15)
    np.testing.assert_allclose(torques[1] / torques[0], 67 / 23, rtol=1e-14)
    np.testing.assert_allclose(torques[2] / torques[1], 76 / 13, rtol=1e-14)
    np.testing.assert_allclose(torques[2] * 87 / 14, 500.0, rtol=1e-12)


@pytest.mark.parametrize("number", SIZES)
def test_the_real_stages_simulate(number):
    scene = read_rexs(SEW, number)
    scene = scene.without("gear_body") if scene.effect("gear_body") else scene
    dataset = simulate(scene)
    stiffness = float(dataset["mesh_stiffness_mean"])
    # the norm's gears stand on their bodies, these teeth here are clamped: finite elements put them at 2.1 to 2.3 of it
    norm = norm_stiffness(scene.pair).mesh * scene.pair.face_width
    assert 1.8 < stiffness / norm < 2.6
    # δ ≈ F/k: the contact law is not linear, its secant lies below its tangent
    ratio = float(dataset["transmission_error_mean"]) * stiffness / scene.F_bt
    assert 1 < ratio < 1.2


def test_bores_are_the_shafts_below_the_gears():
    # read off the shaft sections by eye: the pinions of stages 2 and 3 are cut into shafts of 14 and 18.4 mm
    scenes = [read_rexs(SEW, n) for n in SIZES]
    bores = [[member.bore_diameter for member in scene.pair.members] for scene in scenes]
    assert bores == [[10, 16], [None, 20], [None, 40]]
    assert [scene.effect("gear_body") is not None for scene in scenes] == [True, False, False]


def test_what_is_assumed_is_said():
    document = read_document(SEW)
    notes = stage_scene(document, find_stage(document, 2)).notes
    assert len(notes) == 6
    for word in (
        "bore of component 52: 20 mm",
        "addendum",
        "dedendum",
        "fillet radius",
        "material",
        "profile shift of component 52",
    ):
        assert any(word in note for note in notes), word


@pytest.mark.parametrize(("wanted", "number"), [("2", 2), (2, 2), (37, 2), ("id:6", 1), ("55", 3)])
def test_a_stage_is_found_by_number_or_id(wanted, number):
    assert find_stage(read_document(SEW), wanted).number == number


@pytest.mark.parametrize("wanted", [None, "4", "id:1", "first"])
def test_no_such_stage(wanted):
    with pytest.raises(InputError, match=r"1 \(id 6\), 2 \(id 37\), 3 \(id 55\)"):
        read_rexs(SEW, wanted)


def test_a_packed_file_is_the_same(tmp_path):
    packed = tmp_path / "gearbox.rexsz"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(SEW, SEW.name)
    assert read_rexs(packed, 3).pair == read_rexs(SEW, 3).pair


# -- everything a file may give ----------------------------------------------------------------------------------------


def test_a_full_stage_is_read_from_gear_flanks_tools_and_material(tmp_path):
    scene = read_rexs(write(tmp_path, MODEL))
    pair, (pinion, wheel) = scene.pair, scene.pair.gears
    assert scene.load.torque == 150.0  # the first load case
    assert pair.face_width == 30.0
    assert (pinion.profile_shift, pinion.dedendum, pinion.fillet_radius) == (0.2, 1.3, 0.25)
    assert pinion.addendum == 1.0
    # tip and root circle as given, whatever the profile shift that follows from the centre distance
    np.testing.assert_allclose([wheel.tip_radius, wheel.root_radius], [71.35, 64.5], rtol=1e-14)
    np.testing.assert_allclose(pair.actual_backlash, 0, atol=1e-12)
    assert (pair.material.youngs_modulus, pair.material.poisson_ratio) == (206.0, 0.29)


def test_notes_say_what_is_derived(tmp_path):
    document = read_document(write(tmp_path, MODEL))
    notes = stage_scene(document, find_stage(document, 1)).notes
    assert any("profile shift of component 12 derived" in note for note in notes)
    assert not any("material" in note for note in notes)


def test_real_backlash_is_kept_and_shifts_that_overlap_by_more_than_rounding_are_refused(tmp_path):
    before = '<attribute id="normal_pressure_angle" unit="deg">20</attribute>\n      <attribute id="tip_d'
    shift = '<attribute id="addendum_modification" unit="mm">{}</attribute>\n      '
    pair = read_rexs(write(tmp_path, change(before, shift.format(0.0) + before))).pair
    assert pair.profile_shifts == (0.2, 0.0)
    assert 0.02 < pair.actual_backlash < 0.5
    with pytest.raises(InputError, match="teeth overlap"):
        read_rexs(write(tmp_path, change(before, shift.format(0.6) + before)))


def test_a_namespace_changes_nothing(tmp_path):
    text = change("<model ", '<model xmlns="urn:rexs" ')
    assert read_rexs(write(tmp_path, text)) == read_rexs(write(tmp_path, MODEL))


UNITS = {
    "module in µm": ('unit="mm">3<', 'unit="mum">3000<'),
    "angle in rad": ('unit="deg">-15<', f'unit="rad">{-math.pi / 12!r}<'),
    "no spaces": ('unit="N / mm^2"', 'unit="N/mm^2"'),
    "modulus in MPa": ('unit="N / mm^2"', 'unit="MPa"'),
    "torque in kN m": ('unit="N m">150', 'unit="kN m">0.15'),
    "none": ('unit="">20<', 'unit="none">20<'),
}


@pytest.mark.parametrize(("old", "new"), UNITS.values(), ids=UNITS.keys())
def test_units_are_honoured(tmp_path, old, new):
    scene, expected = (read_rexs(write(tmp_path, text)) for text in (change(old, new), MODEL))
    # conversion rounds
    assert scene.load.torque == pytest.approx(expected.load.torque, rel=1e-15)
    for name in ("normal_module", "centre_distance", "helix_angle", "pressure_angle", "face_width"):
        assert getattr(scene.pair, name) == pytest.approx(getattr(expected.pair, name), rel=1e-14), name
    assert scene.pair.material == expected.pair.material
    assert scene.pair.pinion.teeth == 20


def test_a_shaft_thicker_than_the_root_is_no_bore(tmp_path):
    place = '<attribute id="u_coordinate_on_shaft" unit="mm">{}</attribute>'
    section = f"""<component id="51" name="" type="shaft_section">{place.format(20)}
      <attribute id="length" unit="mm">40</attribute>
      <attribute id="outer_diameter_begin" unit="mm">30</attribute>
      <attribute id="outer_diameter_end" unit="mm">40</attribute></component>"""
    relation = '<relation id="9" type="assembly"><ref id="1" role="assembly"/><ref id="51" role="part"/></relation>'
    text = change("</relations>", f"{relation}</relations>")
    text = change("</components>", f"{section}</components>", text)
    text = change(
        '<attribute id="number_of_teeth" unit="">20<',
        f'{place.format(30)}<attribute id="number_of_teeth" unit="">20<',
        text,
    )
    # a cone: a quarter of the way
    assert read_rexs(write(tmp_path, text)).pair.pinion.bore_diameter == 32.5
    thick = change('_begin" unit="mm">30<', '_begin" unit="mm">62<', text)
    assert read_rexs(write(tmp_path, thick)).pair.pinion.bore_diameter is None
    beside = change('unit="mm">20</attribute>', 'unit="mm">31</attribute>', text)
    assert read_rexs(write(tmp_path, beside)).pair.pinion.bore_diameter is None


# -- torque ------------------------------------------------------------------------------------------------------------


def test_torque_of_a_load_case_and_power_that_flows_out(tmp_path):
    path = write(tmp_path, MODEL)
    driven = read_rexs(path, load_case=8)
    # −60 N·m at +1000/min takes power out: the other gear drives, with the torque of the ratio
    assert (driven.pair.pinion.teeth, driven.pair.wheel.teeth) == (44, 20)
    assert driven.load.torque == pytest.approx(60 * 44 / 20, rel=1e-15)
    assert read_rexs(path, torque=42.0).load.torque == 42.0
    with pytest.raises(InputError, match="load cases in this file: 7, 8"):
        read_rexs(path, load_case=1)
    assert read_rexs(write(tmp_path, without_load_cases())).load.torque == 100.0


def test_torque_that_is_not_in_the_file_must_be_given(tmp_path):
    text = change('<attribute id="torque_around_u_axis" unit="N m">100</attribute>', "", without_load_cases())
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=r"component 10\.torque = missing.*--torque"):
        read_rexs(path)
    assert read_rexs(path, torque=5.0).load.torque == 5.0


def test_torque_is_not_guessed_where_a_shaft_branches(tmp_path):
    second = """<relation id="8" type="assembly"><ref id="2" role="assembly"/><ref id="4" role="part"/></relation>
    <relation id="9" type="assembly"><ref id="1" role="assembly"/><ref id="4" role="part"/></relation>
  </relations>"""
    text = change("</relations>", second, without_load_cases())
    text = change('<component id="10"', '<component id="4" type="external_load"><attribute id="transmits_torque" '
                  'unit="">true</attribute></component>\n<component id="10"', text)  # fmt: skip
    with pytest.raises(InputError, match="torque"):
        read_rexs(write(tmp_path, text))


# -- what must be refused ----------------------------------------------------------------------------------------------

FAULTS = {
    "no teeth": ('<attribute id="number_of_teeth" unit="">44</attribute>', "", "component 12.number_of_teeth"),
    "no module": ('<attribute id="normal_module" unit="mm">3</attribute>', "", "component 11.normal_module"),
    "no distance": ('<attribute id="center_distance" unit="mm">100</attribute>', "", "component 10.center_distance"),
    "unknown unit": ('unit="mm">100<', 'unit="inch">100<', "unit = 'inch'"),
    "no unit of length": ('unit="mm">100<', ">100<", "component 10.center_distance.unit"),
    "unit of another kind": ('unit="deg">15<', 'unit="mm">15<', "component 11.helix_angle_reference_diameter.unit"),
    "no number": ('unit="mm">100<', 'unit="mm">wide<', "'wide'"),
    "tip below root": ('unit="mm">142.7<', 'unit="mm">1<', "component 12.tip_diameter"),
    "ring gear": ('unit="">44<', 'unit="">-44<', "component 12.number_of_teeth"),
    "same hand": ('unit="deg">-15<', 'unit="deg">15<', "component 12.helix_angle_reference_diameter"),
    "other module": ('unit="">44</attribute>\n      <attribute id="normal_module" unit="mm">3<',
                     'unit="">44</attribute>\n      <attribute id="normal_module" unit="mm">3.1<',
                     "component 12.normal_module"),
    "flanks differ": ('<attribute id="addendum_modification_coefficient" unit="">0.2</attribute>\n    </component>\n'
                      '    <component id="22"',
                      '<attribute id="addendum_modification_coefficient" unit="">0.3</attribute>\n    </component>\n'
                      '    <component id="22"', "addendum_modification_coefficient"),
    "distance too small": ('unit="mm">100<', 'unit="mm">80<', "pair.centre_distance"),
    "no such component": ('id="12" role="gear_2"', 'id="99" role="gear_2"', "component 99"),
    "component twice": ('<component id="2" ', '<component id="1" ', "component 1"),
    "id of many digits": ('<component id="2" ', f'<component id="{"2" * 5000}" ', "must be a REXS file"),
    "version": ('version="1.6"', 'version="1.8"', "1.8"),
    "no version": (' version="1.6"', "", "missing"),
    "other XML": ("model", "modell", "modell"),
    "no XML": ("</model>", "", "must be a REXS file"),
    "no stage": ('type="stage"', 'type="stages"', "no cylindrical stage"),
    "entities": ("<model", '<!DOCTYPE model [<!ENTITY a "b">]>\n<model', "document type"),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "says"), FAULTS.values(), ids=FAULTS.keys())
def test_faults_are_one_line_naming_file_component_and_attribute(tmp_path, old, new, says):
    path = write(tmp_path, change(old, new))
    with pytest.raises(InputError) as fault:
        read_rexs(path)
    assert str(fault.value).startswith(f"{path}: ")
    assert says in str(fault.value)
    assert "\n" not in str(fault.value)


def packed(path, members, method=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return path


def test_size_is_limited_while_unpacking(tmp_path, monkeypatch):
    monkeypatch.setattr(rexs_document, "LARGEST", 1000)
    for path in (write(tmp_path, MODEL), packed(tmp_path / "large.rexsz", {"m.rexs": MODEL})):
        with pytest.raises(InputError, match="more than 1000 bytes"):
            read_document(path)


@pytest.mark.parametrize(
    ("members", "says"),
    [({}, "nothing"), ({"a.rexs": "", "b.rexs": ""}, "a.rexs, b.rexs"), ({"a.rexsx": "{}"}, "a.rexsx")],
)
def test_a_packed_file_holds_one_model(tmp_path, members, says):
    with pytest.raises(InputError, match=says):
        read_document(packed(tmp_path / "model.rexsz", members))


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_document(tmp_path / "none.rexs")
    with pytest.raises(InputError, match="damaged: must be a REXS file"):
        read_document(write(tmp_path, MODEL, "model.rexsz"))


# -- a ring -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("teeth", [66, -66])
def test_a_ring_gear_has_negative_teeth_in_a_scene(tmp_path, teeth):
    text = change('name="wheel" type="cylindrical_gear"', 'name="wheel" type="ring_gear"')
    for old, new in (
        ('number_of_teeth" unit="">44<', f'number_of_teeth" unit="">{teeth}<'),
        ('center_distance" unit="mm">100<', 'center_distance" unit="mm">71.5<'),
        ('unit="deg">-15<', 'unit="deg">15<'),
        ('tip_diameter" unit="mm">142.7<', 'tip_diameter" unit="mm">200.5<'),
        ('root_diameter" unit="mm">129.0<', 'root_diameter" unit="mm">213.0<'),
    ):
        text = change(old, new, text)
    pair = read_rexs(write(tmp_path, text)).pair
    assert (pair.pinion.teeth, pair.wheel.teeth, pair.centre_distance) == (20, -66, -71.5)
    assert 2 * pair.gears[1].tip_radius == pytest.approx(-200.5)
    assert 2 * pair.gears[1].root_radius == pytest.approx(-213.0)
    with pytest.raises(InputError, match="equal"):
        read_rexs(write(tmp_path, text.replace('unit="deg">15<', 'unit="deg">-15<', 1)))
