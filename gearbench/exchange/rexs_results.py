"""Writer of results into a copy of a REXS file.

Since version 1.5, REXS has attributes for a curve over the mesh cycle: ``meshing_stiffness_characteristic`` [N / mm],
the mesh stiffness at the mesh positions, and ``rotational_meshing_position`` [deg]. Results without an attribute in the
version of the file become custom attributes ``custom_gearbench_…``, as the standard allows.
"""

from __future__ import annotations

import tomllib
import zipfile
from collections.abc import Iterable
from copy import deepcopy
from io import BytesIO
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, tostring

from gearbench.errors import InputError
from gearbench.exchange import PACKED, PLAIN
from gearbench.exchange.rexs import Stage
from gearbench.exchange.rexs_document import RexsDocument, children
from gearbench.files import check_target, write_bytes
from gearbench.lazy import xr

CUSTOM = "custom_gearbench_"
#: First minor version with attributes for curves over the mesh cycle.
CURVES_SINCE = 5


def write_results(document: RexsDocument, stage: Stage, dataset: xr.Dataset, target: str | Path) -> Path:
    """Write a copy of ``document`` with the mesh stiffness and transmission error of ``stage`` in it.

    Parameters
    ----------
    document, stage
        The model, and one of its stages.
    dataset
        Result of ``simulate`` for the stage.
    target
        File to write, ``.rexs`` or ``.rexsz``.

    Raises
    ------
    InputError
        If the Dataset is not a simulation of the stage, or the target cannot be written.
    """
    target = check_target(target)
    if not target.name.lower().endswith((*PLAIN, *PACKED)):
        raise InputError("output", str(target), "must end in .rexs (XML) or .rexsz (packed)")
    if "mesh_stiffness" not in dataset or "mesh_phase" not in dataset.coords:
        raise InputError("mesh_stiffness", "missing", "the result must come from gearbench simulate")
    root = deepcopy(document.root)
    space = root.tag.rpartition("model")[0]
    elements = {
        component.get("id"): component
        for group in children(root, "components")
        for component in children(group, "component")
    }
    degrees = "deg" if document.version >= "1.4" else "°"
    prefix = "" if int(document.version.split(".")[1]) >= CURVES_SINCE else CUSTOM
    for number, teeth, mesh in _meshes(document, stage, dataset):
        curves = (
            (f"{prefix}rotational_meshing_position", degrees, 360 / teeth * mesh["mesh_phase"].values),
            (f"{prefix}meshing_stiffness_characteristic", "N / mm", 1e3 * mesh["mesh_stiffness"].values),
            (f"{CUSTOM}static_transmission_error", "mum", mesh["transmission_error"].values),
            (f"{CUSTOM}phase_weight", "none", mesh["phase_weight"].values),
        )
        for name, unit, values in curves:
            _set(elements[str(number)], space, name, unit, [repr(float(value)) for value in values])
    for name in ("scene_sha256", "versions"):
        _set(elements[str(stage.component.id)], space, f"{CUSTOM}{name}", "none", str(dataset.attrs.get(name, "")))
    return _write(root, target)


def _meshes(document: RexsDocument, stage: Stage, dataset: xr.Dataset) -> list[tuple[int, int, xr.Dataset]]:
    """List cylindrical stage, teeth of the driving gear, and result of the meshes; refuse a result of other gears."""
    try:
        tables = tomllib.loads(str(dataset.attrs["scene"]))
        table = tables["pair"] if stage.planetary is None else tables["planetary"]
        names = ("pinion", "wheel") if stage.planetary is None else ("sun", "planet", "ring")
        teeth = [abs(int(table[gear]["teeth"])) for gear in names]
    except (KeyError, TypeError, ValueError, RecursionError):
        raise InputError("result", "scene", "its scene cannot be read") from None
    expected = [document.text(gear, "number_of_teeth") for gear in stage.gears]
    expected_teeth = sorted(abs(int(float(text[0]))) for text in expected if text is not None)
    if sorted(teeth) != expected_teeth:
        raise InputError(
            "result", "/".join(map(str, teeth)), f"must have the teeth of stage {stage.number}, {expected_teeth}"
        )
    if stage.planetary is None:
        return [(stage.component.id, teeth[0], dataset)]
    parts = stage.planetary.parts
    if dataset.sizes["mesh"] != len(parts):
        raise InputError("result", f"{dataset.sizes['mesh']} meshes", f"must have the {len(parts)} of the set")
    count = len(parts) // 2
    # the driving gear at the ring is a planet
    return [(part.id, teeth[n >= count], dataset.isel(mesh=n)) for n, part in enumerate(parts)]


def _set(element: Element, space: str, name: str, unit: str, value: str | Iterable[str]) -> None:
    """Set an attribute of a component, with the indentation of the file."""
    for old in [child for child in children(element, "attribute") if child.get("id") == name]:
        element.remove(old)
    indent = "\n      "
    if len(element):
        element[-1].tail = indent
    else:
        element.text = indent
    attribute = SubElement(element, f"{space}attribute", {"id": name, "unit": unit})
    attribute.tail = "\n    "
    if isinstance(value, str):
        attribute.text = value
        return
    attribute.text = f"{indent}  "
    array = SubElement(attribute, f"{space}array")
    array.text, array.tail = f"{indent}    ", indent
    for item in value:
        cell = SubElement(array, f"{space}c")
        cell.text, cell.tail = item, f"{indent}    "
    array[-1].tail = f"{indent}  "


def _write(root: Element, target: Path) -> Path:
    text = tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"
    if not target.name.lower().endswith(PACKED):
        return write_bytes(target, text)
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(f"{target.name.split('.')[0]}.rexs", text)
    return write_bytes(target, packed.getvalue())
