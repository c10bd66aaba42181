"""Reader of matrices punched by Nastran: DMIG entries of a bulk data file.

Source: MSC Nastran Quick Reference Guide, bulk data entry DMIG. A header ``NAME, 0, IFO, TIN, TOUT, POLAR, , NCOL``
declares a matrix; every column is an entry ``NAME, GJ, CJ, , G1, C1, A1, B1``, continued by ``G2, C2, A2, B2`` and so
on. Fields are 8 or (with ``*``) 16 characters wide, or separated by commas.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from gearbench.errors import InputError

#: Grid point and component 1 … 6; the component of a scalar point is 0.
Place = tuple[int, int]

#: Forms of a matrix (IFO): square, and symmetric with one triangle punched.
SQUARE, SYMMETRIC = 1, 6
#: Types of a matrix (TIN) that are read: real in single and double precision, and 0 for the default.
REAL = (0, 1, 2)
#: Exponent of a number: 1.5+7 and 1.5D+07 mean 1.5E7.
_EXPONENT = re.compile(r"(?<=[\d.])[DdEe]?([+-]\d+)$")


@dataclass
class Punched:
    """Punched entries of a matrix.

    Parameters
    ----------
    symmetric
        Whether only one triangle is punched.
    entries
        (row, column) → value.
    """

    symmetric: bool
    entries: dict[tuple[Place, Place], float] = field(default_factory=dict)

    @property
    def places(self) -> list[Place]:
        """All rows and columns with entries, in ascending order."""
        return sorted({place for entry in self.entries for place in entry})


def read_dmig(text: str) -> dict[str, Punched]:
    """Read the real square matrices of a punch file by name; entries other than DMIG are ignored.

    Raises
    ------
    InputError
        With an empty key and the line number, if an entry is invalid.
    """
    matrices: dict[str, Punched] = {}
    for number, fields in _entries(text):
        try:
            _add(matrices, fields)
        except InputError as error:
            raise InputError("", f"line {number}", error.allowed) from None
    return matrices


def _entries(text: str) -> Iterator[tuple[int, list[str]]]:
    """Line number and fields of each DMIG entry, continuations included; the first field is the name."""
    current: tuple[int, list[str]] | None = None
    for number, line in enumerate(text.splitlines(), 1):
        line = line.partition("$")[0].rstrip()
        if not line.strip():
            continue
        head, fields = _fields(line)
        if head.upper().rstrip("*") == "DMIG":
            if current:
                yield current
            current = number, fields
        elif current and (not head or head[0] in "*+"):
            current[1].extend(fields)
        else:
            if current:
                yield current
            current = None
    if current:
        yield current


def _fields(line: str) -> tuple[str, list[str]]:
    """First field of a line, and all its data fields, blank ones included."""
    if "," in line:
        head, *fields = (part.strip() for part in line.split(","))
        # a field after the last data field names the continuation
        count = 4 if "*" in head else 8
        return head, (fields + [""] * count)[:count]
    line = line.expandtabs(8)
    head = line[:8].strip()
    width = 16 if "*" in head else 8
    return head, [line[k : k + width].strip() for k in range(8, 72, width)]


def _add(matrices: dict[str, Punched], fields: list[str]) -> None:
    """Add an entry to ``matrices``: the header of a matrix, or a column."""
    name = fields[0].upper()
    if fields[1] == "0":
        form, kind = _whole(fields[2]), _whole(fields[3])
        if form not in (SQUARE, SYMMETRIC):
            raise InputError("", "", f"{name} of form {form}: must be square (1) or symmetric (6)")
        if kind not in REAL:
            raise InputError("", "", f"{name} of type {kind}: must be real (1 or 2)")
        if name in matrices:
            raise InputError("", "", f"{name} declared twice")
        matrices[name] = Punched(symmetric=form == SYMMETRIC)
        return
    if name not in matrices:
        raise InputError("", "", f"a column of {name or 'no name'} before its header, DMIG {name} 0 …")
    column = _whole(fields[1]), _component(fields[2])
    for k in range(4, len(fields), 4):
        grid, component, value = fields[k : k + 3]
        if not (grid or component or value):
            continue
        row, entries = (_whole(grid), _component(component)), matrices[name].entries
        if (row, column) in entries or (matrices[name].symmetric and (column, row) in entries):
            raise InputError("", "", f"{name} at {row}, {column} given twice")
        entries[row, column] = _number(value)


def _component(text: str) -> int:
    number = _whole(text or "0")
    if number > 6:
        raise InputError("", "", f"component {number}: must be 0 to 6")
    return number


def _whole(text: str) -> int:
    if not re.fullmatch(r"\d{1,9}", text):
        raise InputError("", "", f"{text!r} must be a whole number")
    return int(text)


def _number(text: str) -> float:
    try:
        return float(_EXPONENT.sub(r"E\1", text))
    except ValueError:
        raise InputError("", "", f"{text!r} must be a number") from None
