"""Programs in processes of their own, to be interrupted or killed."""

import os
import signal
import subprocess
from functools import partial
from pathlib import Path

from tests.support.paths import ROOT


def start(*command: object, folder: Path | None = None) -> subprocess.Popen[str]:
    """A program that hears Ctrl-C, though it may be started by a shell's background, which hands down deafness."""
    heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "preexec_fn": heard, "start_new_session": True}
    return subprocess.Popen([*map(str, command)], text=True, cwd=folder, env=environment, **pipes)


def end(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Exit code, less than zero after a signal, and what the error stream says."""
    try:
        _, err = process.communicate(timeout=300)
    finally:
        process.kill()
    return process.returncode, err
