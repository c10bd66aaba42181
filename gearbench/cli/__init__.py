"""Command line ``gearbench COMMAND …``; every command has its module."""

from __future__ import annotations

import os

from gearbench.interruption import ending

# set before numpy is loaded: matrices are small, and gearbench's own threads do the parallel work.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__all__ = ["main"]


def main() -> None:
    """Run the command line, which ends with ``SystemExit``; Ctrl-C ends it with one line, even during imports."""
    with ending():
        from gearbench.cli import app

        app.main()
