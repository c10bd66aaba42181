"""Import gmsh, or say which system packages are missing."""

from __future__ import annotations

import ctypes
import re
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

from gearbench.errors import install_extra

#: Shared libraries that the gmsh wheel needs beyond a bare system, with the Debian packages that bring them.
LIBRARIES: dict[str, str] = {
    "libGLU.so.1": "libglu1-mesa",
    "libGL.so.1": "libgl1",
    "libXrender.so.1": "libxrender1",
    "libXcursor.so.1": "libxcursor1",
    "libXfixes.so.3": "libxfixes3",
    "libXext.so.6": "libxext6",
    "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1",
    "libX11.so.6": "libx11-6",
    "libfontconfig.so.1": "libfontconfig1",
    "libgomp.so.1": "libgomp1",
    "libstdc++.so.6": "libstdc++6",
    "libz.so.1": "zlib1g",
}

_LOCK = threading.RLock()


class MissingDependencyError(ImportError):
    """The finite element reference cannot run here; the message names the packages to install."""


def missing_system_packages() -> tuple[str, ...]:
    """Debian packages of shared libraries that gmsh needs and that cannot be loaded.

    Only the libraries are tried, not gmsh.
    """
    return tuple(package for library, package in LIBRARIES.items() if not loads(library))


def loads(library: str) -> bool:
    """Whether a shared library can be loaded."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def import_gmsh() -> Any:
    """Import and return the gmsh module.

    Raises
    ------
    MissingDependencyError
        If gmsh is not installed, or a shared library it needs is missing; names the packages.
    """
    if find_spec("gmsh") is None:
        raise MissingDependencyError(f"gmsh is not installed: {install_extra('fem')}")
    try:
        import gmsh
    except OSError as error:
        raise MissingDependencyError(explain(error)) from error
    return gmsh


def explain(error: OSError) -> str:
    """One line for the loader's error: the missing library, and every package to install."""
    found = re.search(r"(lib[\w+.-]*\.so[\w.]*)", str(error))
    packages = list(missing_system_packages())
    named = LIBRARIES.get(found.group(1)) if found else None
    if named and named not in packages:
        packages.append(named)
    if not packages:
        return f"gmsh cannot be loaded: {error}"
    library = found.group(1) if found else "a shared library"
    return f"gmsh needs {library}, which is missing: apt-get install {' '.join(packages)}"


@contextmanager
def _signals_kept() -> Iterator[None]:
    """Keep the handlers of SIGINT and SIGPIPE, which gmsh resets to the system's as it starts.

    The system's handlers end the process at Ctrl-C and at a write to a process that has ended. ``signal.signal`` works
    in the main thread only, so the C functions below it are called.
    """
    get, put = ctypes.pythonapi.PyOS_getsig, ctypes.pythonapi.PyOS_setsig
    get.restype = put.restype = ctypes.c_void_p
    put.argtypes = [ctypes.c_int, ctypes.c_void_p]
    before = {number: get(number) for number in (signal.SIGINT, signal.SIGPIPE)}
    try:
        yield
    finally:
        for number, handler in before.items():
            put(number, handler)


@contextmanager
def gmsh_model(name: str) -> Iterator[Any]:
    """Context manager of gmsh with an empty, silent model; one at a time per process, from any thread."""
    gmsh = import_gmsh()
    with _LOCK:
        own = not gmsh.isInitialized()
        if own:
            # interruptible=True would install a signal handler, which only the main thread may do
            with _signals_kept():
                gmsh.initialize(argv=["gmsh"], readConfigFiles=False, run=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add(name)
        try:
            yield gmsh
        finally:
            if own:
                gmsh.finalize()
            else:
                gmsh.model.remove()
