"""Results on disk: what is hashed, damage, concurrent writers."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fem_reference import cache
from fem_reference.cache import cached_compliance, digest, entry
from fem_reference.section import Body
from gearbench.compliance.flank import FlankCompliance


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path / "kept"))
    return tmp_path / "kept"


@pytest.fixture
def counted(monkeypatch):
    """A stand-in for the FE computation that counts its calls."""
    calls = []

    def compute(body, material, accuracy, order):
        calls.append(accuracy)
        blocks = np.full((1, 4, 4), accuracy) + np.eye(4)
        return FlankCompliance(
            gear=body.gear, order=(2, 2), blocks=blocks, error=accuracy / 2, correction=0.1 * blocks,
            attrs={"solver": "none"},
        )  # fmt: skip

    monkeypatch.setattr(cache, "refined_compliance", compute)
    return calls


def test_second_time_comes_from_disk(folder, counted, spur, steel):
    body = Body(gear=spur)
    assert not entry(body, steel, 0.01, (2, 2)).exists()
    first = cached_compliance(body, steel, 0.01, (2, 2))
    assert entry(body, steel, 0.01, (2, 2)).exists()
    second = cached_compliance(body, steel, 0.01, (2, 2))
    assert counted == [0.01]
    assert_array_equal(first.blocks, second.blocks)
    assert_array_equal(first.correction, second.correction)
    assert second.error == first.error
    assert second.attrs == {"solver": "none", "cached": True}
    assert [p.suffix for p in folder.iterdir()] == [".npz"]


def test_everything_that_matters_is_in_the_hash(spur, steel, monkeypatch):
    body = Body(gear=spur)
    base = digest(body, steel, 0.01, (5, 8))
    others = [
        digest(Body(gear=replace(spur, fillet_radius=0.3)), steel, 0.01, (5, 8)),
        digest(Body(gear=spur, bore_radius=4.0), steel, 0.01, (5, 8)),
        digest(Body(gear=spur, bore_radius=4.0, rest="free"), steel, 0.01, (5, 8)),
        digest(body, replace(steel, poisson_ratio=0.29), 0.01, (5, 8)),
        digest(body, steel, 0.001, (5, 8)),
        digest(body, steel, 0.01, (5, 9)),
    ]
    monkeypatch.setattr(cache, "code_version", lambda: "another version")
    others.append(digest(body, steel, 0.01, (5, 8)))
    assert len({base, *others}) == 8


@pytest.mark.parametrize("damage", ["cut", "empty", "garbage", "flipped"])
def test_damaged_entry_is_computed_anew(folder, counted, spur, steel, damage):
    body = Body(gear=spur)
    kept = cached_compliance(body, steel, 0.01, (2, 2))
    (path,) = folder.iterdir()
    data = path.read_bytes()
    if damage == "flipped":  # a whole file with other numbers in it
        with np.load(path) as stored:
            np.savez(path, arrays=stored["arrays"] * 1.001, meta=stored["meta"], checksum=stored["checksum"])
    else:
        path.write_bytes({"cut": data[: len(data) // 2], "empty": b"", "garbage": b"\0" * 500}[damage])
    again = cached_compliance(body, steel, 0.01, (2, 2))
    assert counted == [0.01, 0.01]
    assert_array_equal(again.blocks, kept.blocks)
    cached_compliance(body, steel, 0.01, (2, 2))
    assert len(counted) == 2


def test_cache_that_cannot_be_written_only_warns(monkeypatch, tmp_path, counted, spur, steel):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("GEARBENCH_CACHE", str(blocked))
    with pytest.warns(UserWarning, match="cannot keep the result"):
        found = cached_compliance(Body(gear=spur), steel, 0.01, (2, 2))
    assert found.error == 0.005


def test_every_source_that_finite_elements_import_is_in_the_hash():
    """Modules of gearbench that a refined compliance imports, one from the other: all but the texts of errors."""
    root = Path(cache.__file__).parents[1]
    seen, waiting = set(), [root / "fem_reference" / "refinement.py"]
    while waiting:
        for node in ast.walk(_without_type_checking(waiting.pop())):
            if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith(
                ("gearbench", "fem_reference")
            ):
                continue
            base = root.joinpath(*node.module.split("."))
            found = [base.with_suffix(".py"), *(base / f"{alias.name}.py" for alias in node.names)]
            new = {path for path in found if path.exists()} - seen
            seen |= new
            waiting += new
    mine = {path.relative_to(root / "gearbench").as_posix() for path in seen if path.is_relative_to(root / "gearbench")}
    assert mine - {"errors.py"} == set(cache.SOURCES)


def _without_type_checking(path: Path) -> ast.Module:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            node.body = []
    return tree
