"""Seeded mutations of text, of bytes and of netCDF files, with values that are hostile somewhere."""

from __future__ import annotations

import io
import re

import h5py
import numpy as np
from numpy.random import Generator

#: Names that are markup, formulas, paths or control characters somewhere.
NAMES = (
    "", " ", "a [/b] c", "[red]x[/red]", "<img src=x onerror=alert(1)>", "</script><script>alert(1)</script>",
    "$\\frac{$", "=cmd|' /C calc'!A0", "@SUM(1)", "../../etc/passwd", "/dev/full", "a\x01b", "\x1b[31mred",
    "line\nbreak", "\r\tx", "\u202egnp.exe", "𝔘𝔫𝔦", "%n%s{0}{x}", "x" * 5000, "|a|b|", "`a`", "nan", "1e5", "spur",
)  # fmt: skip
NUMBERS = (
    "0", "-1", "1", "3", "0.0", "-0.0", "1e-300", "5e-324", "-1e-9", "1e9", "1e100", "1.7e308", "-1e300", str(2**63),
    "1" + "0" * 400, "nan", "inf", "-inf", "89.99", "90.0", "180.0", "0.499999", "true", "[]", "{}", "[[1, 'a']]",
    "2024-02-29",
)  # fmt: skip
FACTORS = (1 + 1e-9, 0.999, 1.05, 0.8, 1.3, 2, 0.1, 10, 1e3, 1e-3, -1)
#: A number or a quoted text.
TOKEN = re.compile(r'-?\b\d[\d.]*\b|"[^"\n]*"')


def text(rng: Generator, whole: bytes) -> bytes:
    """TOML, XML or a table of numbers with one to three values or lines changed, or with other bytes."""
    if rng.random() < 0.15:
        return data(rng, whole)
    found = whole.decode()
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        found = _values(rng, found) if rng.random() < 0.75 else _lines(rng, found)
    return found.encode("utf-8", "surrogatepass")


def _values(rng: Generator, whole: str) -> str:
    """One value near the old one, or of another size or type."""
    places = list(TOKEN.finditer(whole))
    if not places:
        return whole
    old, kind = places[rng.integers(len(places))], rng.random()
    if kind < 0.6 and re.fullmatch(r"-?\d+(\.\d*)?", old[0]) and len(old[0]) < 300:
        factor = float(rng.choice(FACTORS))
        new = repr(float(old[0]) * factor) if "." in old[0] else str(round(int(old[0]) * factor))
    elif kind < 0.8:
        new = str(rng.choice(NUMBERS))
    else:
        name = str(rng.choice(NAMES))
        new = f'"{name.replace("<", "&lt;") if whole.startswith("<") else name}"'
    return whole[: old.start()] + new + whole[old.end() :]


def _lines(rng: Generator, whole: str) -> str:
    """A line left out, doubled, or with another word."""
    lines = whole.splitlines(keepends=True)
    at, kind = rng.integers(len(lines)), rng.random()
    if kind < 0.4:
        del lines[at]
    elif kind < 0.7:
        lines[at] *= int(rng.choice([2, 3, 30]))
    else:
        lines[at] = re.sub(r"(\w+)", rf"\1{rng.choice(['_', 's', ' ', 'ü', ',1.0'])}", lines[at], count=1)
    return "".join(lines)


def data(rng: Generator, whole: bytes) -> bytes:
    """Bytes with a few flipped, cut off, doubled, overwritten or put in."""
    found, kind = bytearray(whole), rng.integers(5)
    at, length = int(rng.integers(max(len(found), 1))), int(rng.integers(1, 40))
    if kind == 0:
        for place in rng.integers(max(len(found), 1), size=rng.integers(1, 6)):
            found[place : place + 1] = bytes(byte ^ 1 << int(rng.integers(8)) for byte in found[place : place + 1])
    elif kind == 1:
        del found[at : at + length if rng.random() < 0.5 else None]
    elif kind == 2:
        found[at:at] = found[at : at + length] * int(rng.integers(1, 50))
    elif kind == 3:
        found[at : at + length] = rng.integers(0, 256, length, dtype="uint8").tobytes()
    else:
        found[at:at] = (b"\x00", b"\xff\xfe", b"[" * 3000, b"9" * 5000, b"{a=" * 2000, b"\xef\xbb\xbf")[rng.integers(6)]
    return bytes(found)


def netcdf(rng: Generator, whole: bytes) -> bytes:
    """Bytes changed, or a variable replaced, renamed or given other numbers, units or types through HDF5."""
    if rng.random() < 0.4:
        return data(rng, whole)
    buffer = io.BytesIO(whole)
    with h5py.File(buffer, "r+") as file:
        name, kind = str(rng.choice(sorted(file))), rng.integers(5)
        old = file[name]
        if kind == 0 and old.dtype.kind == "f":
            numbers = (np.nan, np.inf, 0.0, -1.0, 1e300, 1e-3)
            values = old[...]
            values.flat[rng.integers(values.size)] = rng.choice(numbers)
            old[...] = values
        elif kind == 1:
            old.attrs[str(rng.choice(["units", "scale_factor", "_FillValue", "calendar"]))] = (
                "days since 2000", 3.0, "x", b"\xff\xfe", np.array([1.0, 2.0]),
            )[rng.integers(5)]  # fmt: skip
        elif kind == 2:
            file[str(rng.choice(NAMES[2:6]))] = old
        else:
            shape = old.shape
            del file[name]
            if kind == 3:
                dtype = ("S3", "float32", "bool", "complex128", h5py.string_dtype())[rng.integers(5)]
                file.create_dataset(name, shape[:1] if rng.random() < 0.3 else shape, dtype=dtype)
            else:
                file[name] = (h5py.ExternalLink("/etc/passwd", "/"), h5py.SoftLink("/" + name))[rng.integers(2)]
    return buffer.getvalue()
