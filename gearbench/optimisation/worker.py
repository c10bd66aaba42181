"""Loaded by the dask workers that are started here: Ctrl-C is for the process that started them, which ends them."""

from __future__ import annotations

import signal


def dask_setup(_: object) -> None:
    """Ignore Ctrl-C, called by dask as the worker begins."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
