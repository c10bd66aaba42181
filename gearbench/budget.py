"""Memory that a run may take: known before it is spent, and a run that needs more is refused in one line.

The budget is the least of ``--memory``, a share of the machine's (of a container's, where it is in one), and what the
limits of the process (``ulimit -v``) leave. Predictions are in the modules whose arrays they are.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gearbench.errors import InputError

#: Share of the machine's memory that may be used.
SHARE = 0.7
#: Environment variable of the budget in bytes: processes started here have the same one.
VARIABLE = "GEARBENCH_MEMORY"
#: Needs below this are not weighed against anything [bytes].
SMALL = 256e6

_UNITS = {"B": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12}
_CONTAINER = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
#: Runs side by side in this process, which share the budget.
_runs = 1


class MemoryBudgetError(InputError):
    """A run needs more memory than it may have."""


def parse_memory(text: str) -> float:
    """Bytes of a text such as "4GB" or "500 MB".

    Raises
    ------
    InputError
        If it is no such text.
    """
    found = re.fullmatch(r"\s*(\d{1,9}(?:\.\d{1,9})?)\s*(B|kB|MB|GB|TB)\s*", text)
    if found is None or not float(found[1]):
        raise InputError("memory", text, "must be a number with a unit, such as 4GB or 500MB")
    return float(found[1]) * _UNITS[found[2]]


def shown(size: float) -> str:
    """Bytes in words: 4.2 GB."""
    unit = next((unit for unit, factor in reversed(_UNITS.items()) if size >= factor), "B")
    return f"{size / _UNITS[unit]:.2g} {unit}" if size < 100 * _UNITS[unit] else f"{size / _UNITS[unit]:.0f} {unit}"


def memory_limit() -> float:
    """Bytes that a run may use."""
    limits = [SHARE * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    for path in _CONTAINER:
        with suppress(OSError, ValueError):
            limits.append(SHARE * float(Path(path).read_text(encoding="ascii")))
    with suppress(ValueError):
        limits.append(float(os.environ.get(VARIABLE, "")))
    limits += _of_process()
    return min(limits) / _runs


def _of_process() -> list[float]:
    """Memory that the limit of the address space leaves, if there is one."""
    import resource

    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    if most == resource.RLIM_INFINITY:
        return []
    try:
        taken = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        taken = 0
    return [max(SHARE * (most - taken), 0.0)]


def require(size: float, key: str, value: object, instead: str = "") -> None:
    """Refuse what needs more than the budget.

    Parameters
    ----------
    size
        Bytes that are needed.
    key, value
        As in ``InputError``: what needs them.
    instead
        What would fit, in words.

    Raises
    ------
    MemoryBudgetError
        With the need, the budget, and what would fit.
    """
    if size <= SMALL or size <= (limit := memory_limit()):
        return
    hint = f"; {instead}" if instead else ""
    raise MemoryBudgetError(key, value, f"needs about {shown(size)} of memory, {shown(limit)} are allowed{hint}")


@contextmanager
def shared(runs: int) -> Iterator[None]:
    """Inside, ``runs`` runs of this process side by side share the budget."""
    global _runs
    before, _runs = _runs, _runs * max(runs, 1)
    try:
        yield
    finally:
        _runs = before
