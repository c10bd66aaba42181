"""The explorer, served by a process of its own."""

import os
import re
import subprocess
import sys

import pytest

from gearbench.results.netcdf import save
from tests.support.explore_designs import front


@pytest.fixture
def explored():
    """Start ``gearbench explore FILE…`` in a process of its own: its address."""
    processes = []

    def start(*files):
        command = [sys.executable, "-m", "gearbench", "explore", *map(str, files), "--port", "0"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, "NO_COLOR": "1"})
        processes.append(process)
        return re.match(r"http://localhost:\d+/", process.stdout.readline())[0]

    yield start
    for process in processes:
        process.terminate()
        process.wait(20)
        process.stdout.close()


@pytest.fixture
def served(explored, tmp_path):
    """Start the explorer over so many designs: its address."""

    def start(count):
        save(front(count), tmp_path / "front.nc")
        return explored(tmp_path / "front.nc")

    return start
