"""Computed compliances on disk, under a hash of everything that determines them.

One file per result, written atomically: readers and concurrent writers see a complete file or none. An
unreadable or damaged entry is computed again and replaced.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import warnings
import zipfile
from dataclasses import asdict, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.refinement import Level, default_order, refined_compliance, solved
from fem_reference.section import Body
from gearbench.compliance.flank import FlankCompliance
from gearbench.compliance.lugs import LugReduction
from gearbench.errors import InputError
from gearbench.files import write_bytes
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material

#: Sources of the gearbench package that determine a result.
SOURCES = (
    "budget.py",
    "compiled.py",
    "schema.py",
    "threads.py",
    *(f"geometry/{name}.py" for name in ("blank", "cutter", "fillet", "gear", "involute", "material", "rack")),
    *(f"geometry/{name}.py" for name in ("ring_conditions", "section", "web")),
    *(
        f"compliance/{name}.py"
        for name in (
            "_chain_kernels",
            "bases",
            "chain",
            "flank",
            "lapack",
            "local",
            "lugs",
            "outline",
            "section",
            "solid",
        )
    ),
)


def cache_folder() -> Path:
    """Folder of the entries: $GEARBENCH_CACHE, or "gearbench" in the user's cache folder."""
    if chosen := os.environ.get("GEARBENCH_CACHE"):
        return Path(chosen)
    import platformdirs

    return Path(platformdirs.user_cache_dir("gearbench", appauthor=False))


def cached_compliance(
    body: Body,
    material: Material,
    accuracy: float = 0.01,
    order: tuple[int, int] | None = None,
) -> FlankCompliance:
    """``refined_compliance``, from the cache if available."""
    path = entry(body, material, accuracy, order)
    found = load(path, body.gear)
    if found is None:
        found = refined_compliance(body, material, accuracy, order)
        store(path, found)
    return found


def cached_between(body: Body, material: Material, level: int, *, across: bool) -> FlankCompliance:
    """Compliance between all teeth of a gear at one level, from the cache if available; see ``refinement.solved``."""
    path, order = cache_folder() / f"between-{digest(body, material, level, across)}.npz", default_order(body.gear)
    found = load(path, body.gear)
    if found is None:
        whole = abs(body.gear.teeth) // 2
        found = solved(Level(body=body, number=level, waves=order[1]), material, order, whole, across=across)
        store(path, found)
    return found


def entry(
    body: Body,
    material: Material,
    accuracy: float = 0.01,
    order: tuple[int, int] | None = None,
) -> Path:
    """File of ``cached_compliance``."""
    key = digest(body, material, accuracy, order or default_order(body.gear))
    return cache_folder() / f"flank-{key}.npz"


def digest(body: Body, material: Material, *settings: Any) -> str:
    """Hash of geometry, material, accuracy and other settings, program and library versions."""
    inputs = {"body": asdict(body), "material": asdict(material), "settings": settings, "code": code_version()}
    return hashlib.sha256(json.dumps(inputs, sort_keys=True, default=repr).encode()).hexdigest()[:32]


@cache
def code_version() -> str:
    """Hash of the sources that determine a result, and of the libraries that mesh and discretise."""
    import gearbench.geometry

    package = Path(next(iter(gearbench.geometry.__path__))).parent
    sources = [*Path(__file__).parent.glob("*.py"), *(package / name for name in SOURCES)]
    total = hashlib.sha256()
    for source in sorted(sources):
        total.update(source.name.encode() + source.read_bytes())
    for package in ("gmsh", "scikit-fem", "numpy"):
        try:
            total.update(f"{package} {version(package)}".encode())
        except PackageNotFoundError:
            continue
    return total.hexdigest()


def _payload(result: FlankCompliance) -> dict[str, Any]:
    meta = {"order": list(result.order), "error": result.error, "attrs": dict(result.attrs)}
    text = json.dumps(meta, sort_keys=True)
    correction = np.zeros_like(result.blocks) if result.correction is None else result.correction
    arrays = {"arrays": np.ascontiguousarray([result.blocks, correction])}
    if result.anchors is not None:
        arrays |= {"reach": result.anchors.reach, "own": result.anchors.own}
    return {**arrays, "meta": np.array(text), "checksum": np.array(_checksum(arrays, text))}


def _checksum(arrays: dict[str, np.ndarray], meta: str) -> str:
    return hashlib.sha256(b"".join(each.tobytes() for each in arrays.values()) + meta.encode()).hexdigest()


def store(path: Path, result: FlankCompliance) -> None:
    """Write atomically; warn if the cache cannot be written."""
    buffer = io.BytesIO()
    np.savez(buffer, **_payload(result))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, buffer.getvalue())
    except (OSError, InputError) as error:
        warnings.warn(f"cannot keep the result in {path.parent}: {error}", stacklevel=3)


def load(path: Path, gear: Gear) -> FlankCompliance | None:
    """Return the entry, or None if it is missing or damaged."""
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files if name not in ("meta", "checksum")}
            text, checksum = str(stored["meta"]), str(stored["checksum"])
        if checksum != _checksum(arrays, text):
            return None
        meta, (blocks, correction) = json.loads(text), arrays.pop("arrays")
        anchors = LugReduction(**arrays) if arrays else None
        order = (int(meta["order"][0]), int(meta["order"][1]))
        attrs = {**meta["attrs"], "cached": True}
        error = float(meta["error"])
        found = FlankCompliance(gear=gear, order=order, blocks=blocks, error=error, attrs=attrs, anchors=anchors)
        return replace(found, correction=None if anchors else correction)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
