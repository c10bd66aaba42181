"""What is said where gmsh cannot be loaded."""

from __future__ import annotations

import importlib.util
import os
import signal
import sys
from threading import Thread

import pytest

from fem_reference import environment
from fem_reference.environment import MissingDependencyError, explain, gmsh_model, import_gmsh, missing_system_packages

pytestmark = pytest.mark.filterwarnings("error")


def test_missing_library_names_every_package(monkeypatch):
    absent = {"libGLU.so.1", "libXft.so.2", "libgomp.so.1"}
    monkeypatch.setattr(environment, "loads", lambda library: library not in absent)
    assert missing_system_packages() == ("libglu1-mesa", "libxft2", "libgomp1")
    text = explain(OSError("libGLU.so.1: cannot open shared object file: No such file or directory"))
    assert text == "gmsh needs libGLU.so.1, which is missing: apt-get install libglu1-mesa libxft2 libgomp1"


def test_import_error_is_explained(monkeypatch):
    class Broken:
        def find_spec(self, name, path=None, target=None):
            if name == "gmsh":
                raise OSError("libGLU.so.1: cannot open shared object file")
            return None

    monkeypatch.setattr(environment, "find_spec", lambda name: object())
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    with pytest.raises(MissingDependencyError, match="libglu1-mesa"):
        import_gmsh()


def test_gmsh_that_is_not_installed(monkeypatch):
    monkeypatch.setattr(environment, "find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'gearbench\[fem\]"):
        import_gmsh()


def test_probing_does_not_load_gmsh():
    code = "import sys; from fem_reference.environment import missing_system_packages as m; m(); "
    code += "assert 'gmsh' not in sys.modules and 'skfem' not in sys.modules"
    import subprocess

    subprocess.run([sys.executable, "-c", code], check=True)
    assert importlib.util.find_spec("gmsh") is not None


def test_a_broken_pipe_and_ctrl_c_stay_exceptions_once_gmsh_has_started():
    def mesh() -> None:
        with gmsh_model("empty"):
            pass

    thread = Thread(target=mesh)  # meshes are made in threads too
    thread.start()
    thread.join()
    reader, writer = os.pipe()
    os.close(reader)
    with pytest.raises(BrokenPipeError), os.fdopen(writer, "wb", buffering=0) as pipe:
        pipe.write(b"x")
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
