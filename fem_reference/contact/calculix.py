"""Run CalculiX on an input deck and read what it printed."""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fem_reference.environment import MissingDependencyError
from gearbench.interruption import raising

_NUMBER = re.compile(r"[-+]?(?:\d+\.\d*(?:E[-+]\d+)?|nan)", re.IGNORECASE)


class ContactError(RuntimeError):
    """CalculiX did not solve the contact; the message quotes the end of its output."""


@dataclass(frozen=True, kw_only=True)
class StepResult:
    """Printed results of one load step.

    Parameters
    ----------
    motions
        (u_x, u_y) of the nodes of their own that gears and pins move with [mm].
    force
        Tooth pair → (F_x, F_y) of the contact [N].
    moment
        Tooth pair → moment of its contact about the origin, without sign [N mm].
    centre
        Tooth pair → middle of its contact area (x, y) [mm]; NaN where the flanks do not touch.
    """

    motions: list[tuple[float, float]]
    force: dict[str, tuple[float, float]]
    moment: dict[str, float]
    centre: dict[str, tuple[float, float]]

    @property
    def rotation(self) -> float:
        """q = r_b φ of the driving gear [mm]."""
        return self.motions[0][0]


def executable() -> str:
    """Path of CalculiX.

    Raises
    ------
    MissingDependencyError
        If it is not installed; names the Debian package.
    """
    path = shutil.which("ccx")
    if path is None:
        raise MissingDependencyError("CalculiX (ccx) is not installed: apt-get install calculix-ccx")
    return path


@cache
def version() -> str:
    """Version of CalculiX, such as "2.20"."""
    # ccx -v ends with a code that is not zero
    out = subprocess.run([executable(), "-v"], capture_output=True, text=True, check=False, timeout=60).stdout
    match = re.search(r"\d+\.\d+", out)
    return match.group() if match else "unknown"


def run(text: str, pairs: Sequence[str], *, threads: int = 1) -> list[StepResult]:
    """Results of the load steps of a deck, in order; ``pairs`` names the tooth pairs in the order of the deck.

    Raises
    ------
    ContactError
        If CalculiX does not converge.
    MissingDependencyError
        If it is not installed.
    """
    with tempfile.TemporaryDirectory(prefix="gearbench-ccx-") as folder:
        Path(folder, "pair.inp").write_text(text, encoding="ascii")
        environment = {**os.environ, "OMP_NUM_THREADS": str(threads), "CCX_NPROC_STIFFNESS": str(threads)}
        with raising():
            done = subprocess.run(
                [executable(), "pair"], cwd=folder, env=environment, capture_output=True, text=True, check=False
            )
        printed = Path(folder, "pair.dat")
        steps = read(printed.read_text(encoding="ascii", errors="replace") if printed.exists() else "", pairs)
    if len(steps) < text.count("*END STEP"):
        words = [line.strip() for line in done.stdout.splitlines() if "error" in line.lower()]
        raise ContactError(
            f"CalculiX stopped in load step {len(steps) + 1}: {' '.join(words[-3:]) or 'no reason given'}"
        )
    return steps


def read(printed: str, pairs: Sequence[str]) -> list[StepResult]:
    """Ends of the load steps, each of time 1, in the text that CalculiX printed (.dat)."""
    steps: dict[int, StepResult] = {}
    for part in re.split(r"displacements \(vx,vy,vz\)", printed)[1:]:
        blocks = part.split("statistics for slave set")
        if len(blocks) != len(pairs) + 1:
            break
        first, *rows = blocks[0].splitlines()
        time, motions = _numbers(first)[0], [_numbers(row) for row in rows if row.strip()]
        if not math.isclose(time, round(time), rel_tol=1e-6):  # a part of a load step that CalculiX cut
            continue
        force, moment, centre = {}, {}, {}
        for k, block in zip(pairs, blocks[1:], strict=True):
            lines = [line for line in block.splitlines() if line.strip()]
            total, middle = _numbers(lines[2]), _numbers(lines[4])
            touching = abs(total[5]) > 0
            force[k], moment[k] = (total[0], total[1]), abs(total[5])
            centre[k] = (middle[0], middle[1]) if touching else (math.nan, math.nan)
        # the last one at this time: a step may end with a very short increment
        steps[round(time)] = StepResult(
            motions=[(x, y) for x, y, _ in motions], force=force, moment=moment, centre=centre
        )
    return list(steps.values())


def _numbers(line: str) -> list[float]:
    return [float(text) for text in _NUMBER.findall(line)]
