"""REXS as JSON: the same models as in the XML form, from the files in tests/data converted by the specification."""

import base64
import json
import zipfile
from dataclasses import replace
from xml.etree.ElementTree import parse

import numpy as np
import pytest

from gearbench.errors import InputError
from gearbench.exchange import is_rexs
from gearbench.exchange.rexs import read_rexs, stages
from gearbench.exchange.rexs_document import read_document
from gearbench.exchange.rexs_results import write_results
from gearbench.exchange.rexs_system import system_scene
from gearbench.scene import Resolution
from gearbench.simulation import simulate
from tests.support.paths import DATA

SEW = DATA / "sew_3_stage_cylindrical_gearbox_1.0.rexs"
STAGE = DATA / "stage_1.6.rexs"
ENUMS = ("bearing_type", "axial_force_absorption", "type_of_basic_rack")


def number(text):
    return int(text) if text.lstrip("+-").isdecimal() else float(text)


def value(attribute, coded):
    """Value of an attribute under the name of its type (REXS 1.5, JSON syntax)."""
    array = attribute.find("array")
    if array is not None:
        cells = [cell.text for cell in array.findall("c")]
        try:
            values = [float(cell) for cell in cells]
        except ValueError:
            return {"string_array": cells}
        if coded:
            text = base64.b64encode(np.array(values, dtype="<f8").tobytes()).decode()
            return {"floating_point_array_coded": {"code": "float64", "value": text}}
        return {"floating_point_array": values}
    matrix = attribute.find("matrix")
    if matrix is not None:
        return {"floating_point_matrix": [[float(c.text) for c in row.findall("c")] for row in matrix.findall("r")]}
    text = attribute.text or ""
    if text in ("true", "false"):
        return {"boolean": text == "true"}
    try:
        found = number(text)
    except ValueError:
        return {"enum" if attribute.get("id") in ENUMS else "string": text}
    return {"integer" if isinstance(found, int) else "floating_point": found}


def components(parent, coded):
    return [
        {
            "id": int(c.get("id")),
            "type": c.get("type"),
            "name": c.get("name"),
            "attributes": [
                {"id": a.get("id"), "unit": a.get("unit"), **value(a, coded)} for a in c.findall("attribute")
            ],
        }
        for c in parent.findall("component")
    ]


def converted(path, *, coded=False):
    """The model of an XML file as JSON."""
    root = parse(path).getroot()
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]
    relations = [
        {
            "id": int(r.get("id")),
            "type": r.get("type"),
            **({"order": int(r.get("order"))} if r.get("order") else {}),
            "refs": [{"id": int(f.get("id")), "role": f.get("role"), "hint": f.get("hint")} for f in r.findall("ref")],
        }
        for r in root.find("relations").findall("relation")
    ]
    model = dict(root.attrib) | {"relations": relations, "components": components(root.find("components"), coded)}
    spectrum = root.find("load_spectrum")
    if spectrum is not None:
        cases = [
            {"id": int(case.get("id")), "components": components(case, coded)} for case in spectrum.findall("load_case")
        ]
        model["load_spectrum"] = {"id": int(spectrum.get("id")), "load_cases": cases}
    return {"model": model}


def written(folder, model, name="model.rexsj", encoding="utf-8"):
    path = folder / name
    path.write_text(model if isinstance(model, str) else json.dumps(model), encoding=encoding)
    return path


def scene_text(document, stage):
    """Scene of a stage with shafts, bearings and the other meshes, without the name of the file."""
    mapping = system_scene(document, stage)[0].to_mapping()
    text = json.dumps(mapping).replace(document.path.name, "")
    return text.replace(document.path.name.split(".rexs")[0], "")


@pytest.mark.parametrize("name", [SEW.with_suffix(".rexsj").name, "gearbox3.rexs.json", "gearbox3.rexsz"])
@pytest.mark.parametrize("coded", [False, True])
def test_a_gearbox_is_the_same_in_both_forms(tmp_path, name, coded):
    text = json.dumps(converted(SEW, coded=coded))
    path = tmp_path / name
    if name.endswith("z"):
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("gearbox.rexsj", text)
    else:
        path.write_text(text, encoding="utf-8-sig")  # with the mark that the standard asks for
    assert is_rexs(path)
    xml, document = read_document(SEW), read_document(path)
    assert [stage.component.id for stage in stages(document)] == [stage.component.id for stage in stages(xml)]
    for stage in (1, 2, 3):
        assert scene_text(document, stage) == scene_text(xml, stage)


def test_load_cases_come_from_the_spectrum(tmp_path):
    path = written(tmp_path, converted(STAGE))
    assert list(read_document(path).load_cases) == [7, 8]
    for case in (7, 8):
        assert read_rexs(path, load_case=case).load == read_rexs(STAGE, load_case=case).load
    several = converted(STAGE)
    several["model"]["load_spectrum"] = [several["model"]["load_spectrum"], {"id": 2, "load_cases": [{"id": 9}]}]
    assert list(read_document(written(tmp_path, several)).load_cases) == [7, 8]


def test_results_of_a_stage_go_into_the_xml_form(tmp_path):
    path = written(tmp_path, converted(STAGE))
    document = read_document(path)
    dataset = simulate(replace(read_rexs(path), resolution=Resolution(positions=8, segments=4)))
    again = read_document(write_results(document, stages(document)[0], dataset, tmp_path / "out.rexs"))
    (stage,) = stages(again)
    kept = {a.get("id") for a in stage.component.element}
    assert {"center_distance", "meshing_stiffness_characteristic"} <= kept
    with pytest.raises(InputError, match=r"must end in \.rexs"):
        write_results(document, stages(document)[0], dataset, tmp_path / "out.rexsj")
    for text in ("[pair", "[pair]\npinion = 3", "", '[pair]\npinion.teeth = "a"\nwheel.teeth = 3'):
        with pytest.raises(InputError, match=r"^result = scene: its scene cannot be read$"):
            write_results(document, stages(document)[0], dataset.assign_attrs(scene=text), tmp_path / "no.rexs")


def changed(change):
    model = converted(STAGE)
    change(model["model"])
    return model


@pytest.mark.parametrize(
    ("model", "says"),
    [
        ("<model/>", "must be a REXS file"),
        ("", "must be a REXS file"),
        ("[]", "must be a REXS model"),
        ('{"model": 3}', "must be a REXS model"),
        ('{"model": {"version": "1.5", "components": [3]}}', "components = list: must be a list of objects"),
        ('{"model": {"version": "1.5", "relations": {"id": 1}}}', "relations = dict: must be a list of objects"),
        ('{"model": {"version": ["1.5"]}}', "must be a number, a text, true or false"),
        ('{"model": ' + "[" * 200_000 + "]" * 200_000 + "}", "must be a REXS file"),
        (changed(lambda m: m.update(version="2.0")), "must be one of 1.0"),
        (changed(lambda m: m["components"][0].update(id="one")), "must be a whole number"),
        (changed(lambda m: m["relations"][0]["refs"][0].update(id=99)), "no such component"),
        ('{"model": {"version": NaN}}', "must be one of 1.0"),
    ],
)
def test_faults_are_one_line(tmp_path, model, says):
    path = written(tmp_path, model)
    with pytest.raises(InputError) as fault:
        read_rexs(path)
    assert says in str(fault.value)
    assert str(fault.value).startswith(str(path))
    assert "\n" not in str(fault.value)


def test_a_coded_array_of_another_kind_is_named(tmp_path):
    model = converted(SEW, coded=True)
    for component in model["model"]["components"]:
        for attribute in component["attributes"]:
            if "floating_point_array_coded" in attribute:
                attribute["floating_point_array_coded"]["code"] = "float16"
    with pytest.raises(InputError, match="must be three lengths"):
        system_scene(read_document(written(tmp_path, model)), 1)
