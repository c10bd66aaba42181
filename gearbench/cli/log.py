"""Output of ``--verbose``: the log of gearbench and fem_reference, on stderr."""

from __future__ import annotations

import logging
import sys

#: Packages whose log is shown.
_LOGGERS = ("gearbench", "fem_reference")
_FORMAT = "%(relativeCreated)7.0f ms  %(message)s"
_NAME = "gearbench.cli"


def begin(verbose: bool) -> bool:
    """Show the log from now on, if ``verbose``, and return ``verbose``; times count from the import of ``logging``."""
    end()
    if verbose:
        handler = logging.StreamHandler(sys.stderr)
        handler.set_name(_NAME)
        handler.setFormatter(logging.Formatter(_FORMAT))
        for name in _LOGGERS:
            logging.getLogger(name).addHandler(handler)
            logging.getLogger(name).setLevel(logging.DEBUG)
    return verbose


def end() -> None:
    """Stop showing the log."""
    for logger in map(logging.getLogger, _LOGGERS):
        for handler in [handler for handler in logger.handlers if handler.get_name() == _NAME]:
            logger.removeHandler(handler)
            logger.setLevel(logging.NOTSET)
