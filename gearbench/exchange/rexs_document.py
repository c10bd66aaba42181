"""Safe reader of REXS files: XML, JSON or packed. Source: REXS 1.0 to 1.7 (rexs.info).

A model has components with attributes, and relations between components. A load spectrum may override attributes in
its load cases. Files with a document type (DTD) are refused, which excludes entity expansion.
"""

from __future__ import annotations

import base64
import math
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from xml.etree.ElementTree import Element, TreeBuilder

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.exchange import JSON, PACKED, PLAIN
from gearbench.exchange.rexs_json import parse_json
from gearbench.exchange.rexs_units import LENGTH, Dimension

VERSIONS = tuple(f"1.{minor}" for minor in range(8))
#: Spelling of a version in early files → its number.
_SPELLINGS = MappingProxyType({"1.00": "1.0", "1.10": "1.1"})
#: Largest size of the text [bytes].
LARGEST = 50_000_000


@dataclass(frozen=True)
class Component:
    """Component of a model: number, type, name and XML element."""

    id: int
    kind: str
    name: str
    element: Element

    @property
    def label(self) -> str:
        """Name in messages."""
        return f"component {self.id}"


@dataclass(frozen=True)
class Relation:
    """Relation between components: its type, and pairs (role, component number) in file order."""

    kind: str
    refs: tuple[tuple[str, int], ...]

    def ids(self, role: str) -> list[int]:
        """Numbers of the components in a role."""
        return [number for name, number in self.refs if name == role]


@dataclass(frozen=True, kw_only=True)
class RexsDocument:
    """A REXS model.

    Parameters
    ----------
    path
        The file.
    version
        "1.0" to "1.7".
    root
        The XML element ``model``.
    components, relations
        Components by number, and relations in file order.
    load_cases
        Load case of the first load spectrum → component → XML element of the component in that load case.
    """

    path: Path
    version: str
    root: Element
    components: Mapping[int, Component]
    relations: tuple[Relation, ...]
    load_cases: Mapping[int, Mapping[int, Element]]

    def of_kind(self, kind: str) -> list[Component]:
        """All components of a type, in file order."""
        return [component for component in self.components.values() if component.kind == kind]

    def related(self, kind: str, role: str, number: int, other: str) -> list[Component]:
        """Components in the role ``other`` of the relations ``kind`` that have ``number`` in the role ``role``."""
        relations = [relation for relation in self.relations if relation.kind == kind and number in relation.ids(role)]
        return [self.components[i] for relation in relations for i in relation.ids(other)]

    def text(self, component: Component, name: str, case: int | None = None) -> tuple[str, str] | None:
        """Text and unit of an attribute, from the load case if that overrides it; None if absent or empty."""
        elements = [component.element]
        if case is not None and component.id in self.load_cases[case]:
            elements.insert(0, self.load_cases[case][component.id])
        for element in elements:
            for attribute in children(element, "attribute"):
                if attribute.get("id") == name and (attribute.text or "").strip():
                    return (attribute.text or "").strip(), attribute.get("unit") or ""
        return None

    def number(self, component: Component, name: str, dimension: Dimension, case: int | None = None) -> float | None:
        """Value of an attribute in the unit of ``dimension``; None if absent.

        Raises
        ------
        InputError
            If it is not a finite number, or its unit does not belong to the dimension.
        """
        text_and_unit = self.text(component, name, case)
        if text_and_unit is None:
            return None
        text, unit = text_and_unit
        key = f"{component.label}.{name}"
        factor = dimension.factor(unit)
        if factor is None:
            allowed = ", ".join(repr(known) for known in dimension.factors)
            raise InputError(f"{key}.unit", repr(unit), f"unknown unit: must be one of {allowed}")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(key, repr(text), "must be a finite number")
        return value * factor

    def vector(self, component: Component, name: str) -> NDArray:
        """Value of a vector attribute, (3,) [mm]; raises ``InputError`` if it is missing, or not three lengths."""
        for attribute in children(component.element, "attribute"):
            if attribute.get("id") == name:
                factor = LENGTH.factor(attribute.get("unit") or "mm")
                try:
                    values = np.array([value for array in children(attribute, "array") for value in _numbers(array)])
                except ValueError:
                    values = np.array([math.nan])
                if factor is None or len(values) != 3 or not np.isfinite(values).all():
                    raise InputError(f"{component.label}.{name}", values.tolist(), "must be three lengths")
                return factor * values
        raise InputError(f"{component.label}.{name}", "missing", "is required for shafts")

    def require(self, component: Component, name: str, dimension: Dimension) -> float:
        """Value of a required attribute; lengths must be positive.

        Raises
        ------
        InputError
            As in ``number``, and if the attribute is absent, or a length is not positive.
        """
        value, key = self.number(component, name, dimension), f"{component.label}.{name}"
        if value is None:
            raise InputError(key, "missing", f"is required ({component.kind} {component.name!r})")
        if dimension is LENGTH and value <= 0:
            raise InputError(key, value, "must be positive")
        return value


def read_document(path: str | Path) -> RexsDocument:
    """Read a REXS file: ``.rexs`` (XML), ``.rexsj`` (JSON) or packed ``.rexsz``.

    Raises
    ------
    InputError
        If the file cannot be read, is not REXS of a known version, declares a document type, or is too large.
    """
    path = Path(path)
    try:
        return _document(path, _parse(path))
    except InputError as error:
        raise error.in_file(str(path)) from None
    except OSError as error:
        raise InputError("", (error.strerror or str(error)).lower(), "must be a REXS file", str(path)) from None
    except Exception as error:  # XML, JSON and ZIP readers raise all kinds
        raise InputError("", "damaged", f"must be a REXS file ({error})", str(path)) from None


def _numbers(array: Element) -> list[float]:
    """Read an array from single items, or from base64 of little-endian numbers (REXS 1.4)."""
    code = array.get("code")
    if code is None:
        return [float(item.text or "") for item in children(array, "c")]
    if code not in ("float32", "float64"):
        raise ValueError(code)
    text = "".join((array.text or "").split())
    raw = base64.b64decode(text + "=" * (-len(text) % 4), validate=True)
    return np.frombuffer(raw, dtype=np.dtype(code).newbyteorder("<")).tolist()


def children(element: Element, tag: str) -> Iterator[Element]:
    """Child elements with a tag, in any namespace."""
    return (child for child in element if isinstance(child.tag, str) and child.tag.rpartition("}")[2] == tag)


def _parse(path: Path) -> Element:
    """Parse a file of any form; return its root element."""
    name = path.name
    if name.lower().endswith(PACKED):
        with zipfile.ZipFile(path) as archive:
            name = _model(archive)
            with archive.open(name) as file:
                data = file.read(LARGEST + 1)
    else:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise InputError("", f"more than {LARGEST} bytes", "too large")
    return (parse_json if name.lower().endswith(JSON) else _parse_xml)(data)


def _model(archive: zipfile.ZipFile) -> str:
    """Name of the only model in a packed file, which may also contain files that the model refers to."""
    members = [member.filename for member in archive.infolist() if not member.is_dir()]
    models = [name for name in members if name.lower().endswith((*PLAIN, *JSON))]
    if len(models) != 1:
        names = ", ".join((models or members)[:5]) or "nothing"
        raise InputError("", f"holds {names}", "a packed REXS file must hold one .rexs file")
    return models[0]


def _parse_xml(data: bytes) -> Element:
    """Parse XML with its comments; return the root element."""
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import DefusedXMLParser

    parser = DefusedXMLParser(target=TreeBuilder(insert_comments=True), forbid_dtd=True)
    try:
        parser.feed(data)
        return parser.close()
    except DefusedXmlException:
        raise InputError("", "declares a document type", "rejected for security: REXS files need no DTD") from None


def _document(path: Path, root: Element) -> RexsDocument:
    if root.tag.rpartition("}")[2] != "model":
        raise InputError("", f"root element {root.tag}", "must be a REXS model")
    version = root.get("version") or "missing"
    version = _SPELLINGS.get(version, version)
    if version not in VERSIONS:
        raise InputError("version", version, f"must be one of {', '.join(VERSIONS)}")
    components: dict[int, Component] = {}
    for group in children(root, "components"):
        for element in children(group, "component"):
            number = _id(element, "component")
            if number in components:
                raise InputError(f"component {number}", "given twice", "each number at most once")
            components[number] = Component(number, element.get("type") or "", element.get("name") or "", element)
    relations = []
    for group in children(root, "relations"):
        for element in children(group, "relation"):
            refs = tuple((ref.get("role") or "", _id(ref, "ref")) for ref in children(element, "ref"))
            for _, number in refs:
                if number not in components:
                    raise InputError(
                        f"relation {element.get('id')}", f"refers to component {number}", "no such component"
                    )
            relations.append(Relation(element.get("type") or "", refs))
    cases = {
        _id(case, "load_case"): {_id(element, "component"): element for element in children(case, "component")}
        for spectrum in islice(children(root, "load_spectrum"), 1)  # each numbers its load cases from the start
        for case in children(spectrum, "load_case")
    }
    return RexsDocument(
        path=path, version=version, root=root, components=components, relations=tuple(relations), load_cases=cases
    )


def _id(element: Element, kind: str) -> int:
    text = element.get("id") or ""
    if not text.isdecimal():
        raise InputError(f"{kind}.id", repr(text), "must be a whole number")
    return int(text)
