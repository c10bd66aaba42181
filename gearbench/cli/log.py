"""Output of ``--verbose``: the log of gearbench and its finite elements, on the error stream."""

from __future__ import annotations

import logging
import sys

#: The packages that log; nothing is shown of others.
_LOGGERS = ("gearbench", "fem_reference")
_FORMAT = "%(relativeCreated)7.0f ms  %(message)s"
_NAME = "gearbench.cli"


def begin(wanted: bool) -> bool:
    """Show the log from now on, if it is wanted; time counts from the start of the program."""
    end()
    if wanted:
        handler = logging.StreamHandler(sys.stderr)
        handler.set_name(_NAME)
        handler.setFormatter(logging.Formatter(_FORMAT))
        for name in _LOGGERS:
            logging.getLogger(name).addHandler(handler)
            logging.getLogger(name).setLevel(logging.DEBUG)
    return wanted


def end() -> None:
    """Show it no longer."""
    for logger in map(logging.getLogger, _LOGGERS):
        for handler in [handler for handler in logger.handlers if handler.get_name() == _NAME]:
            logger.removeHandler(handler)
            logger.setLevel(logging.NOTSET)
