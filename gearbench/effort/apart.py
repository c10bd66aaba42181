"""Work in a process of its own: it finds no finite elements kept, and its largest memory is its own.

``python -m gearbench.effort.apart`` is that process: its orders come in as JSON, its answer is the last line printed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib import import_module
from typing import Any

from gearbench.errors import GearbenchError
from gearbench.interruption import raising
from gearbench.scene import Scene


def apart(work: Callable[..., Any], scene: Scene, *given: Any) -> Any:
    """Answer of ``work(scene, *given)`` in a process of its own; words, numbers and lists of them only.

    Raises
    ------
    GearbenchError
        If it fails there; with its last line.
    """
    order = {"work": [work.__module__, work.__qualname__], "scene": scene.to_toml(), "given": given}
    command = [sys.executable, "-m", "gearbench.effort.apart"]
    with raising():
        done = subprocess.run(command, input=json.dumps(order), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise GearbenchError(f"in a process of its own: {(done.stderr.strip() or 'no answer').splitlines()[-1]}")
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Do the work that the standard input names, with nothing kept on disk."""
    import tomllib

    from gearbench.scene_file import parse_scene

    order = json.loads(sys.stdin.read())
    with tempfile.TemporaryDirectory() as folder:
        os.environ["GEARBENCH_CACHE"] = folder
        module, name = order["work"]
        answer = getattr(import_module(module), name)(parse_scene(tomllib.loads(order["scene"])), *order["given"])
    print(f"\n{json.dumps(answer)}")


if __name__ == "__main__":
    main()
