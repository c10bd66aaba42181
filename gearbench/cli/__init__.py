"""The command line: ``gearbench COMMAND …``; one file a command."""

from __future__ import annotations

import os

from gearbench.interruption import ending

# before numpy is loaded: the matrices are small, and the parallel work is done by gearbench's own threads
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__all__ = ["main"]


def main() -> None:
    """Run the command line, which ends by ``SystemExit``; from its first import on Ctrl-C ends it with one line."""
    with ending():
        from gearbench.cli import app

        app.main()
