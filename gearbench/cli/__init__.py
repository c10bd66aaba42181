"""The command line: ``gearbench COMMAND …``; one file a command."""

from __future__ import annotations

import os

# before numpy is loaded: the matrices are small, and the parallel work is done by gearbench's own threads
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from gearbench.cli.app import main

__all__ = ["main"]
