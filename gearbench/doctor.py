"""Check of gearbench's requirements on this machine, with remedies for missing ones."""

from __future__ import annotations

import os
import platform
import shutil
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, metadata, version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.errors import InputError, install_extra

if TYPE_CHECKING:
    from packaging.requirements import Requirement

#: Extras for developers, which users do not need.
DEVELOPMENT = ("all", "dev", "docs")


@dataclass(frozen=True)
class Finding:
    """Result for one requirement: name, what was found, whether that is fine, whether it is needed, remedy."""

    name: str
    found: str
    fine: bool
    needed: bool = True
    remedy: str = ""


def examine() -> list[Finding]:
    """Check Python, packages, effects of other packages, shared libraries, processors, CalculiX and kernels."""
    findings = _packages() + _effects() + _shared_libraries()
    findings.append(Finding("processors", f"{os.cpu_count()}", True))
    return [*findings, _calculix(), _kernel_cache()]


def _packages() -> list[Finding]:
    """Check Python and the packages in gearbench's metadata; a package of several extras counts for the first."""
    from packaging.requirements import Requirement
    from packaging.specifiers import SpecifierSet

    try:
        of_gearbench = metadata("gearbench")
    except PackageNotFoundError:
        return [Finding("gearbench", "not installed", False, remedy="pip install .")]
    needed = of_gearbench["Requires-Python"]
    fine = SpecifierSet(needed).contains(platform.python_version())
    findings = [Finding("Python", platform.python_version(), fine, remedy=f"needs {needed}")]
    extras, seen = ["", *(of_gearbench.get_all("Provides-Extra") or ())], {"gearbench"}
    for extra in (name for name in extras if name not in DEVELOPMENT):
        for text in of_gearbench.get_all("Requires-Dist") or ():
            asked = Requirement(text)
            if asked.name not in seen and (asked.marker is None or asked.marker.evaluate({"extra": extra})):
                seen.add(asked.name)
                findings.append(_package(asked, extra))
    return findings


def _package(asked: Requirement, extra: str) -> Finding:
    remedy = install_extra(extra) if extra else f"pip install '{asked.name}{asked.specifier}'"
    try:
        there = version(asked.name)
    except PackageNotFoundError:
        return Finding(asked.name, "not installed", False, needed=not extra, remedy=remedy)
    fine = asked.specifier.contains(there, prereleases=True)
    return Finding(asked.name, there, fine, needed=not extra, remedy=f"needs {asked.specifier}: {remedy}")


def _effects() -> list[Finding]:
    """Check the effects from other packages."""
    from gearbench.effects.registry import effect_class, installed

    findings = []
    for name, entry in installed().items():
        origin = f"of {entry.dist.name} {entry.dist.version}" if entry.dist is not None else entry.value
        try:
            effect_class(name)
            findings.append(Finding(f"effect {name}", origin, True))
        except InputError as error:
            findings.append(Finding(f"effect {name}", origin, False, needed=False, remedy=str(error)))
    return findings


def _shared_libraries() -> list[Finding]:
    """Check the shared libraries that gmsh loads (as Debian packages), if gmsh is installed."""
    if find_spec("gmsh") is None:
        return []
    from fem_reference.environment import missing_system_packages

    missing = missing_system_packages()
    state = "all present" if not missing else f"missing: {' '.join(missing)}"
    return [Finding("libraries for gmsh", state, not missing, remedy=f"apt-get install {' '.join(missing)}")]


def _calculix() -> Finding:
    """Check CalculiX, which only contact finite elements need."""
    path = shutil.which("ccx")
    return Finding(
        "CalculiX", path or "not installed", path is not None, needed=False, remedy="apt-get install calculix-ccx"
    )


def _kernel_folder() -> Path:
    """Folder in which numba stores compiled kernels."""
    return Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).parent / "contact" / "__pycache__")


def is_first_run() -> bool:
    """Whether the contact solver still has to be compiled here, which takes about a minute."""
    return next(_kernel_folder().rglob("_kernels.solve_position*.nbi"), None) is None


def _kernel_cache() -> Finding:
    """Check whether numba can write to the folder of compiled kernels."""
    folder = _kernel_folder()
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    remedy = "set NUMBA_CACHE_DIR to a writable folder, or every run compiles anew"
    return Finding("cache of compiled kernels", str(folder), os.access(existing, os.W_OK), remedy=remedy)
