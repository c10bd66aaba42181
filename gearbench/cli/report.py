"""Report of an unexpected error: a file to send to the developers."""

from __future__ import annotations

import os
import platform
import shlex
import sys
import tempfile
import traceback
from pathlib import Path


def write_report(error: BaseException) -> Path:
    """Write command line, versions and traceback to a new file in the temporary folder; return its path.

    Raises
    ------
    OSError
        If no temporary folder is writable.
    """
    from gearbench.results.provenance import git_revision, versions

    head = [
        f"command: gearbench {shlex.join(sys.argv[1:])}",
        f"folder: {Path.cwd()}",
        f"versions: {versions()}, revision {git_revision()}",
        f"system: {platform.platform()}",
    ]
    handle, name = tempfile.mkstemp(prefix="gearbench-report-", suffix=".txt")
    with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
        file.write("\n".join([*head, "", "".join(traceback.format_exception(error))]))
    return Path(name)
