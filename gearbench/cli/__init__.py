"""The command line: ``gearbench COMMAND …``; one file a command."""

from __future__ import annotations

from gearbench.cli.app import main

__all__ = ["main"]
