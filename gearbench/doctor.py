"""What this machine has of what gearbench needs, and how to get what is missing."""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

_CORE = ("numpy", "scipy", "numba", "xarray", "h5netcdf", "h5py", "pydantic", "typer", "rich", "matplotlib")
_EXTRAS = {"fem": ("scikit-fem", "gmsh", "meshio", "pypardiso"), "optimise": ("pymoo", "dask", "distributed")}


@dataclass(frozen=True)
class Finding:
    """One thing looked at: what, what was found, whether that is fine, whether it is needed, and what to do."""

    what: str
    found: str
    fine: bool
    needed: bool = True
    remedy: str = ""


def examine() -> list[Finding]:
    """All findings: Python, packages, shared libraries, processors, and the cache of compiled kernels."""
    found = [Finding("Python", platform.python_version(), sys.version_info >= (3, 11), remedy="needs 3.11 or newer")]
    found += [_package(name, "") for name in _CORE]
    for extra, names in _EXTRAS.items():
        found += [_package(name, extra) for name in names]
    found += _shared_libraries()
    found.append(Finding("processors", f"{os.cpu_count()}", True))
    found.append(_kernel_cache())
    return found


def _package(name: str, extra: str) -> Finding:
    try:
        return Finding(name, version(name), True)
    except PackageNotFoundError:
        install = f"pip install 'gearbench[{extra}]'" if extra else f"pip install {name}"
        return Finding(name, "not installed", False, needed=not extra, remedy=install)


def _shared_libraries() -> list[Finding]:
    """Shared libraries that gmsh loads, as Debian packages; nothing where gmsh is not installed."""
    if find_spec("gmsh") is None:
        return []
    from fem_reference.environment import missing_system_packages

    missing = missing_system_packages()
    found = "all there" if not missing else f"missing: {' '.join(missing)}"
    return [Finding("libraries for gmsh", found, not missing, remedy=f"apt-get install {' '.join(missing)}")]


def _kernel_cache() -> Finding:
    """Where numba keeps compiled kernels, and whether it can write there."""
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).parent / "contact" / "__pycache__")
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    remedy = "set NUMBA_CACHE_DIR to a writable folder, or every run compiles anew"
    return Finding("cache of compiled kernels", str(folder), os.access(existing, os.W_OK), remedy=remedy)
