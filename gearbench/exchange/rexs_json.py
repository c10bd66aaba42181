"""Conversion of the JSON form of REXS to elements of the XML form, so that one reader serves both.

Source: REXS 1.4, annex, and 1.5 to 1.7, JSON syntax (spec.rexs.info). The key of an attribute's value is the name of
its type: "floating_point", "enum", …, with separate names for arrays, matrices and their base64 codes.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from gearbench.errors import InputError

#: Keys of an attribute other than that of its value.
_DESCRIBES = frozenset(("id", "unit", "origin"))
_MODEL = ("version", "applicationId", "applicationVersion", "date", "applicationLanguage")
_COMPONENT = ("id", "type", "name", "externalFile", "externalId")
#: Type of an array whose items are arrays; a matrix has rows instead.
_RAGGED = "array_of_integer_arrays"


def parse_json(data: bytes) -> Element:
    """Parse a file in the JSON form; return the root element ``model``.

    Raises
    ------
    InputError
        If the file is not a model.
    ValueError, RecursionError
        If the file is not JSON.
    """
    content = json.loads(data.decode("utf-8-sig"))
    model = content.get("model") if isinstance(content, dict) else None
    if not isinstance(model, dict):
        raise InputError("model", "missing", "must be a REXS model")
    root = _element(None, "model", model, _MODEL)
    relations = SubElement(root, "relations")
    for relation in _objects(model, "relations"):
        element = _element(relations, "relation", relation, ("id", "type", "order"))
        for ref in _objects(relation, "refs"):
            _element(element, "ref", ref, ("id", "role", "hint"))
    _components(SubElement(root, "components"), model)
    spectra = model.get("load_spectrum")
    for spectrum in _objects({"load_spectrum": [spectra] if isinstance(spectra, dict) else spectra}, "load_spectrum"):
        element = _element(root, "load_spectrum", spectrum, ("id",))
        for case in _objects(spectrum, "load_cases"):
            _components(_element(element, "load_case", case, ("id",)), case)
        if isinstance(spectrum.get("accumulation"), dict):
            _components(SubElement(element, "accumulation"), spectrum["accumulation"])
    return root


def _objects(owner: dict[str, Any], key: str) -> Iterator[dict[str, Any]]:
    """Yield the objects of a list; none if the list is absent."""
    objects = owner.get(key)
    objects = [] if objects is None else objects
    if not isinstance(objects, list) or not all(isinstance(each, dict) for each in objects):
        raise InputError(key, type(objects).__name__, "must be a list of objects")
    yield from objects


def _element(parent: Element | None, tag: str, given: dict[str, Any], names: tuple[str, ...]) -> Element:
    """Make an element with the given ``names`` as text attributes."""
    kept = {name: _text(given[name]) for name in names if given.get(name) is not None}
    return Element(tag, kept) if parent is None else SubElement(parent, tag, kept)


def _components(parent: Element, owner: dict[str, Any]) -> None:
    for component in _objects(owner, "components"):
        element = _element(parent, "component", component, _COMPONENT)
        for attribute in _objects(component, "attributes"):
            found = _element(element, "attribute", attribute, ("id", "unit", "origin"))
            for kind, value in attribute.items():
                if kind not in _DESCRIBES:
                    _value(found, kind, value)


def _value(attribute: Element, kind: str, value: Any) -> None:
    """Put a value into its attribute in the XML form."""
    if isinstance(value, dict):  # base64
        sizes = {name: _text(size) for name, size in value.items() if name != "value"}
        coded = SubElement(attribute, "matrix" if "matrix" in kind else "array", sizes)
        coded.text = _text(value.get("value", ""))
    elif isinstance(value, list):
        rows = [row for row in value if isinstance(row, list)]
        if rows and len(rows) == len(value):
            outer, part = ("array_of_arrays", "array") if kind == _RAGGED else ("matrix", "r")
            table = SubElement(attribute, outer)
            for row in rows:
                _cells(SubElement(table, part), row)
        else:
            _cells(SubElement(attribute, "array"), value)
    else:
        attribute.text = _text(value)


def _cells(parent: Element, values: list[Any]) -> None:
    for value in values:
        SubElement(parent, "c").text = _text(value)


def _text(value: Any) -> str:
    """Format a scalar as in XML."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str | int | float):
        return str(value)
    raise InputError("", type(value).__name__, "must be a number, a text, true or false")
