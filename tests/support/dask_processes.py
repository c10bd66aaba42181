"""Dask schedulers and workers in separate processes that a test can kill."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.support.paths import ROOT


@contextmanager
def dask(*words: str, path: Path = ROOT) -> Iterator[subprocess.Popen]:
    """Run a dask scheduler or worker that imports gearbench from ``path``."""
    environment = {**os.environ, "PYTHONPATH": str(path), "PYTHONSAFEPATH": "1"}
    quiet: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    command = [sys.executable, "-m", "distributed.cli.dask_" + words[0], *words[1:]]
    process = subprocess.Popen(command, env=environment, cwd="/", **quiet)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def scheduler() -> Iterator[tuple[str, subprocess.Popen]]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    with dask("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard") as process:
        wait_for(int(port))
        yield f"tcp://127.0.0.1:{port}", process


def wait_for(port: int) -> None:
    """Wait until a process listens at ``port`` of this machine, one minute at most."""
    for _ in range(600):
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
        except OSError:
            time.sleep(0.1)
        else:
            return
