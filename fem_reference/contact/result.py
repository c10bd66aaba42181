"""Results of a mesh phase by contact finite elements, stored on disk."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from fem_reference.cache import cache_folder, code_version
from gearbench.files import write_text


@dataclass(frozen=True, kw_only=True)
class PhaseResult:
    """A mesh phase under each torque.

    Parameters
    ----------
    approach
        q [mm], rotation of the pinion beyond the conjugate position along the line of action, (torque,).
    stiffness
        ∂F_bt/∂q [N/mm], (torque,).
    share
        Tooth pair → share of the torque, (torque,).
    radius
        Tooth pair → radius on the pinion where it touches [mm], NaN where it does not, (torque,).
    """

    approach: list[float]
    stiffness: list[float]
    share: dict[int, list[float]]
    radius: dict[int, list[float]]


def joined(runs: Sequence[PhaseResult]) -> PhaseResult:
    """One result of several runs of torques of the same phase, in turn; a pair that a run leaves out is unloaded."""
    pairs = sorted({k for run in runs for k in run.share})
    return PhaseResult(
        approach=[q for run in runs for q in run.approach],
        stiffness=[k for run in runs for k in run.stiffness],
        share={k: [each for run in runs for each in run.share.get(k, [0.0] * len(run.approach))] for k in pairs},
        radius={k: [each for run in runs for each in run.radius.get(k, [math.nan] * len(run.approach))] for k in pairs},
    )


def kept(key: list[Any], compute: Callable[[], PhaseResult]) -> PhaseResult:
    """A result from the cache, if ``key`` and program are the same.

    Damaged entries are computed again.
    """
    digest = hashlib.sha256(json.dumps([*key, _code()], sort_keys=True, default=repr).encode()).hexdigest()[:32]
    path = cache_folder() / f"contact-{digest}.json"
    try:
        stored = json.loads(path.read_bytes())
        for name in ("share", "radius"):
            stored[name] = {int(k): values for k, values in stored[name].items()}
        return PhaseResult(**stored)
    except (OSError, ValueError, KeyError, TypeError):
        pass
    result = compute()
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(asdict(result)))
    return result


@cache
def _code() -> str:
    """Hash of the sources that determine a result."""
    total = hashlib.sha256(code_version().encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        if source.name != "cycle.py":
            total.update(source.read_bytes())
    return total.hexdigest()
