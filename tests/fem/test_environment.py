"""What is said where gmsh cannot be loaded."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest

from fem_reference import environment
from fem_reference.environment import MissingDependencyError, explain, import_gmsh, missing_system_packages

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


SIGNALS = """
import os, signal
from threading import Thread
from fem_reference.environment import gmsh_model

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts jobs in the background without it

def mesh():
    with gmsh_model("empty"):
        pass

thread = Thread(target=mesh)  # meshes are made in threads too
thread.start()
thread.join()
reader, writer = os.pipe()
os.close(reader)
try:
    os.write(writer, b"x")
except BrokenPipeError:
    print("broken pipe")
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    print("interrupt")
"""


def test_a_broken_pipe_and_ctrl_c_stay_exceptions_once_gmsh_has_started():
    done = subprocess.run([sys.executable, "-c", SIGNALS], capture_output=True, text=True)
    assert (done.stdout, done.stderr, done.returncode) == ("broken pipe\ninterrupt\n", "", 0)
