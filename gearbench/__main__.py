"""Entry point of ``python -m gearbench`` and of the program ``gearbench``."""

import gc
import os
import sys

from gearbench.cli import main

#: Packages that NumPy, numba and xarray import only because they are installed; explore and dask schedulers need some.
UNUSED = ("charset_normalizer", "cffi", "coverage", "yaml", "dask")


def run() -> None:
    """Run the command line as a process that starts and ends quickly.

    The process ends without shutting down the interpreter. A shutdown with all imported modules takes a fifth of a
    second, and a signal that arrives meanwhile may crash it.
    """
    # fewer garbage collections: they would search all imported modules for nothing
    gc.set_threshold(200_000)
    for name in () if sys.argv[1:2] == ["explore"] or "--scheduler" in " ".join(sys.argv) else UNUSED:
        sys.modules.setdefault(name, None)  # type: ignore[arg-type]
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
