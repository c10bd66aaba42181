"""REXS files, as XML, as JSON or packed: their contents, safely read. Source: REXS 1.0 to 1.7 (rexs.info).

A model is a list of components with attributes, and of relations between them; a load spectrum may override attributes
for its load cases. Document types are refused, and with them entity expansion; packed files that grow too much, too.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import IO
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from gearbench.errors import InputError
from gearbench.exchange.rexs_json import parse_json
from gearbench.exchange.rexs_units import LENGTH, Dimension

VERSIONS = tuple(f"1.{minor}" for minor in range(8))
#: Other spellings of versions in files of the first years.
_SPELLINGS = MappingProxyType({"1.00": "1.0", "1.10": "1.1"})
#: Ends of names: XML, JSON and packed (REXS 1.5, file formats).
PLAIN = (".rexs", ".rexs.xml")
JSON = (".rexsj", ".rexs.json")
PACKED = (".rexsz", ".rexs.zip")
#: Largest size of the text [bytes], and how many times larger than the packed file it may be.
LARGEST, LARGEST_RATIO = 200_000_000, 200
#: Digits of an id at most: those of 8 bytes.
MOST_DIGITS = 18
#: Elements and comments at most, a hundred times those of a gearbox; each takes 2 µs and 90 bytes. REXS nests six deep.
MOST_ELEMENTS, DEEPEST = 1_000_000, 100


@dataclass(frozen=True)
class Component:
    """A component: its number, type, name and XML element."""

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
    """A relation: its type, and the number of the component in each role, in order."""

    kind: str
    refs: tuple[tuple[str, int], ...]

    def ids(self, role: str) -> list[int]:
        """Components in a role."""
        return [number for name, number in self.refs if name == role]


@dataclass(frozen=True, kw_only=True)
class RexsDocument:
    """A REXS model.

    Parameters
    ----------
    path
        Where it was read from.
    version
        "1.0" to "1.7".
    root
        The XML element ``model``.
    components, relations
        Its contents.
    load_cases
        Load case of the first load spectrum → component → its element in that load case.
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
        """Text and unit of an attribute, in a load case where that overrides it; None where it is absent or empty."""
        elements = [component.element]
        if case is not None and component.id in self.load_cases[case]:
            elements.insert(0, self.load_cases[case][component.id])
        for element in elements:
            for attribute in children(element, "attribute"):
                if attribute.get("id") == name and (attribute.text or "").strip():
                    return (attribute.text or "").strip(), attribute.get("unit") or ""
        return None

    def number(self, component: Component, name: str, dimension: Dimension, case: int | None = None) -> float | None:
        """Value of an attribute in the unit of ``dimension``; None where it is absent.

        Raises
        ------
        InputError
            If it is no finite number, or its unit is not one of the dimension's.
        """
        found = self.text(component, name, case)
        if found is None:
            return None
        text, unit = found
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

    def require(self, component: Component, name: str, dimension: Dimension) -> float:
        """Number of a required attribute; lengths must be positive.

        Raises
        ------
        InputError
            Also if it is absent, or a length is not positive.
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
        If it cannot be read, is no REXS of a known version, declares a document type (entities), or unpacks to too
        much.
    """
    path = Path(path)
    try:
        return _document(path, _parse(path))
    except InputError as error:
        raise error.in_file(str(path)) from None
    except OSError as error:
        raise InputError("", (error.strerror or "cannot be read").lower(), "must be a REXS file", str(path)) from None


def is_rexs(path: str | Path) -> bool:
    """Whether the name of a file says that it is REXS."""
    return str(path).lower().endswith((*PLAIN, *JSON, *PACKED))


def children(element: Element, tag: str) -> Iterator[Element]:
    """Child elements with a tag, whatever their namespace."""
    return (child for child in element if isinstance(child.tag, str) and child.tag.rpartition("}")[2] == tag)


def _parse(path: Path) -> Element:
    if not str(path).lower().endswith(PACKED):
        if path.stat().st_size > LARGEST:
            raise InputError("", f"{path.stat().st_size} bytes", f"must be at most {LARGEST} bytes")
        with path.open("rb") as file:
            return _parse_text(path.name, file)
    try:
        with zipfile.ZipFile(path) as archive:
            member = _model(archive)
            size, packed = member.file_size, member.compress_size
            if size > LARGEST or size > LARGEST_RATIO * max(packed, 1):
                allowed = f"must be at most {LARGEST} bytes and {LARGEST_RATIO} times its packed size"
                raise InputError("", f"unpacks from {packed} to {size} bytes", allowed)
            with archive.open(member) as file:
                return _parse_text(member.filename, file)
    except InputError:
        raise
    except OSError as error:
        if error.errno is not None:  # of the disk; bzip2 has none
            raise
        raise InputError("", "a damaged ZIP file", f"must be a packed REXS file ({error})") from None
    except Exception as error:  # zipfile passes on whatever its decompressors raise: zlib.error, LZMAError, EOFError
        raise InputError("", "a damaged ZIP file", f"must be a packed REXS file ({error})") from None


def _model(archive: zipfile.ZipFile) -> zipfile.ZipInfo:
    """The one model of a packed file; the files that it refers to, which may stand beside it, are never unpacked."""
    members = [member for member in archive.infolist() if not member.is_dir()]
    models = [member for member in members if member.filename.lower().endswith((*PLAIN, *JSON))]
    if len(models) != 1:
        names = ", ".join(member.filename for member in (models or members)[:5]) or "nothing"
        raise InputError("", f"holds {names}", "a packed REXS file must hold one .rexs file")
    return models[0]


def _parse_text(name: str, file: IO[bytes]) -> Element:
    if not name.lower().endswith(JSON):
        return parse_xml(file)
    data = file.read(LARGEST + 1)
    if len(data) > LARGEST:  # whatever the header of a ZIP file says
        raise InputError("", f"more than {LARGEST} bytes", "too large")
    return parse_json(data)


class _Bounded(TreeBuilder):
    """Builds the tree, as long as it stays within ``MOST_ELEMENTS`` and ``DEEPEST``."""

    def __init__(self) -> None:
        super().__init__(insert_comments=True)
        self._count = self._depth = 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self._counted()
        self._depth += 1
        if self._depth > DEEPEST:
            raise InputError("", f"elements nested more than {DEEPEST} deep", "refused: REXS nests six deep")
        return super().start(tag, attrs)

    def end(self, tag: str) -> Element:
        self._depth -= 1
        return super().end(tag)

    def comment(self, text: str | None) -> Element:
        self._counted()
        return super().comment(text)

    def _counted(self) -> None:
        self._count += 1
        if self._count > MOST_ELEMENTS:
            raise InputError("", f"more than {MOST_ELEMENTS} elements", "too large")


def parse_xml(file: IO[bytes]) -> Element:
    """Root element, comments kept; the size in the header of a ZIP file is not relied on."""
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import DefusedXMLParser

    parser = DefusedXMLParser(target=_Bounded(), forbid_dtd=True)
    try:
        read = 0
        while block := file.read(1 << 20):
            read += len(block)
            if read > LARGEST:
                raise InputError("", f"more than {LARGEST} bytes", "too large")
            parser.feed(block)
        return parser.close()
    except InputError:
        raise
    except DefusedXmlException:
        raise InputError("", "declares a document type", "rejected for security: REXS files need no DTD") from None
    except (ParseError, LookupError, ValueError) as error:  # the last two: encodings that are not known
        raise InputError("", "not XML", str(error)) from None


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
        for spectrum in islice(children(root, "load_spectrum"), 1)  # numbers of load cases begin anew in each
        for case in children(spectrum, "load_case")
    }
    return RexsDocument(
        path=path, version=version, root=root, components=components, relations=tuple(relations), load_cases=cases
    )


def _id(element: Element, kind: str) -> int:
    text = element.get("id") or ""
    if not text.isdecimal() or len(text) > MOST_DIGITS:
        raise InputError(f"{kind}.id", repr(text), f"must be a whole number of at most {MOST_DIGITS} digits")
    return int(text)
