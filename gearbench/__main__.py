"""``python -m gearbench``, and the program ``gearbench``."""

import os
import sys

from gearbench.cli import main


def run() -> None:
    """Run the command line and end the process at once.

    To shut the interpreter down takes a fifth of a second with all that was imported, and a signal that arrives
    meanwhile may crash it.
    """
    try:
        main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except OSError:
                code = code or 1
        os._exit(code)


if __name__ == "__main__":
    run()
