"""Processes started here: with the code and the packages of this one, out of reach of Ctrl-C in a terminal."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

from gearbench.budget import VARIABLE, memory_limit


def start(module: str, *arguments: str, share: int, **options: Any) -> subprocess.Popen:
    """Run a module as a process, whose standard input and output are pipes; it is to end when its input is closed.

    Parameters
    ----------
    module, arguments
        Its name, and what it is told.
    share
        Number of evaluations that go on side by side in it and the others: each may use that part of the memory.
    options
        Further ones of ``subprocess.Popen``.
    """
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    environment[VARIABLE] = f"{memory_limit() / share:.0f}"
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=environment,
        start_new_session=True,
        **options,
    )
