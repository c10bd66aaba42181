"""REXS 1.0 to 1.7: the same stage in the dialect of each version is the same scene.

The files are written by hand after the specification (spec.rexs.info, 1.4 to 1.7) and the changes between the versions
in its database; only 1.0 is also tested on a file of another program, in test_rexs.py.
"""

import zipfile
from dataclasses import replace

import pytest

from gearbench.errors import InputError
from gearbench.exchange import is_rexs
from gearbench.exchange.rexs import read_rexs
from gearbench.exchange.rexs_document import read_document
from tests.support.paths import DATA

#: One stage in the dialect of REXS 1.6.
MODEL = (DATA / "stage_1.6.rexs").read_text(encoding="utf-8")


def load(path):
    """Its scene, without the name, which is that of the file."""
    return replace(read_rexs(path), name="")


EXPECTED = load(DATA / "stage_1.6.rexs")
#: How a tool stands in it: as that of a step that works on the gear.
STEP = MODEL[MODEL.index('    <relation id="6"') : MODEL.index('    <relation id="7"')]


def replaced(text, *changes):
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


def until_1_2(version):
    """Angles in °, "none" for no unit (until 1.3); one type for all flanks, tools referred to in order (until 1.2)."""
    tool = """    <relation id="6" type="ordered_reference" order="1">
      <ref hint="cylindrical_gear" id="11" role="origin"/>
      <ref hint="hob" id="31" role="referenced"/>
    </relation>
"""
    return replaced(
        MODEL, (STEP, tool), ("cylindrical_gear_flank", "flank_geometry"), ('unit="deg"', 'unit="°"'),
        ('unit=""', 'unit="none"'), ('version="1.6"', f'version="{version}"'),
    )  # fmt: skip


def steps_of_flanks(text):
    """From 1.3 on each flank has its own steps, with settings of their own."""
    steps = "".join(
        f"""    <relation id="{60 + flank}" type="manufacturing_step" order="1">
      <ref hint="cylindrical_gear_flank" id="{flank}" role="workpiece"/>
      <ref hint="hob" id="31" role="tool"/>
      <ref hint="cylindrical_gear_manufacturing_settings" id="{flank + 50}" role="manufacturing_settings"/>
    </relation>
"""
        for flank in (21, 22)
    )
    settings = "".join(
        f"""    <component id="{flank + 50}" name="step" type="cylindrical_gear_manufacturing_settings">
      <attribute id="machining_allowance" unit="mm">0.1</attribute>
    </component>
"""
        for flank in (21, 22)
    )
    return replaced(text, (STEP, steps), ("  </components>\n", f"{settings}  </components>\n"))


def version_1_3():
    changes = (('unit="deg"', 'unit="°"'), ('unit=""', 'unit="none"'), ('version="1.6"', 'version="1.3"'))
    return steps_of_flanks(replaced(MODEL, *changes))


def version_1_4():
    """Arrays may be coded (1.4)."""
    coded = '<attribute id="custom_x" unit="mm"><array code="float64">AAAAAAAA8D8=</array></attribute>'
    changes = (
        ('version="1.6"', 'version="1.4"'),
        ('<attribute id="center_d', f'{coded}\n      <attribute id="center_d'),
    )
    return steps_of_flanks(replaced(MODEL, *changes))


def version_1_5(version="1.5"):
    """The origin of a value, and references to other files (1.5); several spectra and an accumulation."""
    more = """    <accumulation>
      <component id="10"><attribute id="custom_damage" unit="">0.4</attribute></component>
    </accumulation>
  </load_spectrum>
  <load_spectrum id="2">
    <load_case id="7">
      <component id="3"><attribute id="torque_around_u_axis" unit="N m">999</attribute></component>
    </load_case>
  </load_spectrum>
"""
    changes = (
        ('version="1.6"', f'version="{version}"'),
        ('id="center_distance" unit="mm"', 'id="center_distance" unit="mm" origin="user_defined"'),
        ('<component id="11" ', '<component id="11" externalFile="gear.rexs" externalId="4" '),
        ("  </load_spectrum>\n", more),
    )
    return steps_of_flanks(replaced(MODEL, *changes))


DIALECTS = {
    "1.0": until_1_2("1.0"),
    "1.00, as in early files": until_1_2("1.00"),
    "1.1": until_1_2("1.1"),
    "1.2": until_1_2("1.2"),
    "1.3": version_1_3(),
    "1.4": version_1_4(),
    "1.5": version_1_5(),
    "1.6": MODEL,
    "1.7": version_1_5("1.7"),
}


@pytest.mark.parametrize("name", DIALECTS)
def test_a_stage_is_the_same_in_every_version(tmp_path, name):
    path = tmp_path / "model.rexs"
    path.write_text(DIALECTS[name], encoding="utf-8")
    assert read_document(path).version == name[:3]
    scene = load(path)
    assert scene == EXPECTED
    # not by what is assumed where the tool is not found: 1.25 and 0.38
    assert (scene.pair.pinion.dedendum, scene.pair.pinion.fillet_radius) == (1.3, 0.25)
    assert scene.load.torque == 150.0


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path):
    path = tmp_path / "model.rexs"
    path.write_text(MODEL, encoding="utf-8-sig")
    assert load(path) == EXPECTED


@pytest.mark.parametrize("name", ["model.rexs", "model.rexs.xml", "MODEL.REXS"])
def test_names_of_the_xml_form(tmp_path, name):
    (tmp_path / name).write_text(MODEL, encoding="utf-8")
    assert is_rexs(name)
    assert read_rexs(tmp_path / name).pair.pinion.teeth == 20


@pytest.mark.parametrize("name", ["model.rexsz", "model.rexs.zip"])
@pytest.mark.parametrize("model", ["model.rexs", "gearbox/model.rexs.xml"])
def test_a_packed_model_may_stand_beside_the_files_that_it_refers_to(tmp_path, name, model):
    with zipfile.ZipFile(tmp_path / name, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("gears/pinion.gde", "<gde/>")
        archive.writestr(model, MODEL)
        archive.writestr("casing/mesh.inp", "*NODE\n" * 100_000)  # far above the ratio allowed: not unpacked
    assert load(tmp_path / name) == EXPECTED


def test_tools_that_do_not_agree_are_named(tmp_path):
    second = """    <component id="32" name="worm" type="hob">
      <attribute id="addendum_coefficient_reference_profile" unit="none">1.2</attribute>
    </component>
  </components>
"""
    another = '    <relation id="61" type="ordered_reference" order="2">\n      <ref id="11" role="origin"/>\n'
    another += '      <ref id="32" role="referenced"/>\n    </relation>\n  </relations>\n'
    text = replaced(until_1_2("1.2"), ("  </components>\n", second), ("  </relations>\n", another))
    (tmp_path / "model.rexs").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"component 31\.addendum_coefficient_reference_profile|component 32"):
        read_rexs(tmp_path / "model.rexs")
