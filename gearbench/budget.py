"""Memory that a run may take: known before it is spent, and a run that needs more is refused in one line.

The budget is the least of ``--memory``, a share of the machine's (of a container's, where it is in one), and what the
limits of the process (``ulimit -v``) leave. What runs take is predicted here, from numbers of positions, segments and
columns; who has the arrays counts these.
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


def room() -> float:
    """Bytes that nothing is refused for."""
    return max(memory_limit(), SMALL)


def require_each(each: float, count: int, key: str, of: str) -> None:
    """Refuse more than the memory holds of what takes ``each`` bytes.

    Parameters
    ----------
    key
        In the singular, as it is given: "speed".
    of
        What each of them has, in words.

    Raises
    ------
    MemoryBudgetError
        Naming the number that would fit.
    """
    fits = int(room() / each)
    require(each * count, key, f"{count} {key}s × {of}", f"{fits} {key}s would fit" if fits else f"less than {of} fit")


@contextmanager
def shared(runs: int) -> Iterator[None]:
    """Inside, ``runs`` runs of this process side by side share the budget."""
    global _runs
    before, _runs = _runs, _runs * max(runs, 1)
    try:
        yield
    finally:
        _runs = before


# -- what runs take: numbers that are kept at the same time, at most; measured, with a tenth to a third in reserve -----
#: Bytes of a number.
_NUMBER = 8
#: A contact problem: for each two segments of a position where all pairs of teeth move each other, for each segment and
#: column of Ψ (of pairs that move each other, and of others), and for each segment (contact lines, gaps, laws, results;
#: likewise).
_SQUARE, _COLUMN, _SEGMENT = 3.4, (2.5, 3.4), (62.0, 30.0)
#: A solution that is kept while others are solved, and put together at the end: for each segment of a position, and for
#: each position.
_KEPT_SEGMENT, _KEPT_POSITION = 4.0, 60.0
#: Mesh cycles of unlike teeth: for each position of a cycle, for each position of the waves of orders found at once,
#: for each order, and for each mode of the gaps of a cycle.
_CYCLE, _WAVE, _ORDER, _MODE = 5.0, 4.4, 9.5, 1.7
#: Orders found at once: their waves are an array of their own.
ORDERS_AT_ONCE = 4000
#: A Ritz system: for each two functions of the section of a spur and of a helical tooth, for each two right-hand sides,
#: and for the rest.
_FUNCTIONS, _SIDES, _REST = (10.0, 14.0), 7.0, 3e4
#: A response over speed, for each mesh, speed and order: curves over time; or the variables, and those of each bearing.
_CURVES, _VARIABLES, _BEARING = 48.0, 42.0, 7.0
#: The same for each speed and step of the period with loss of contact, its two sweeps together, beside x and f of rows.
_STEP = 76.0
#: Scattered samples of it, for each order and for each speed of a block.
_SPEED = 2.0


def position_memory(pairs: int, segments: int, columns: int, *, coupled: bool) -> float:
    """Memory [bytes] of the contact problem of one position."""
    n = pairs * segments
    # of pairs that deflect by themselves, the compliance of each is reduced where it has more columns than segments
    square = n * n if coupled else n * segments * (columns > segments)
    return _NUMBER * (_SQUARE * square + n * (_COLUMN[not coupled] * columns + _SEGMENT[not coupled]))


def result_memory(segments: int) -> float:
    """Memory [bytes] that the results of one position take among those of a sweep."""
    return _NUMBER * (_KEPT_SEGMENT * segments + _KEPT_POSITION)


def batch_memory(segments: int, modes: int, rank: int, blocks: int, *, linearised: bool) -> float:
    """Memory [bytes] of one position of samples solved side by side: products of columns, or the matrix of all."""
    own = 2 * rank * rank if linearised else segments * rank * (rank + 1) / 2 + modes * blocks * rank
    return _NUMBER * (own + segments * (4 * rank + 4 * modes))


def gaps_memory(segments: int, errors: int) -> float:
    """Memory [bytes] of the gaps of random errors on one position."""
    return _NUMBER * 4 * segments * errors


def cycles_memory(positions: int, cycles: int, orders: float, modes: int) -> float:
    """Memory [bytes] of mesh cycles whose gaps are sums of ``modes``, and of their orders up to a mesh order."""
    count = cycles * orders
    numbers = cycles * positions * _CYCLE + min(count, ORDERS_AT_ONCE) * positions * _WAVE + count * _ORDER
    return _NUMBER * (numbers + cycles * modes * _MODE)


def order_memory() -> float:
    """Memory [bytes] of one order of mesh cycles."""
    return _NUMBER * _ORDER


def ritz_memory(functions: float, sides: float, *, helical: bool) -> float:
    """Memory [bytes] of a solid tooth of so many functions of its section, and right-hand sides."""
    return _NUMBER * (_FUNCTIONS[helical] * functions**2 + _SIDES * sides**2 + _REST)


def sector_memory(entries: float) -> float:
    """Memory [bytes] of finite elements of so many entries, before they are summed; good to a factor of two."""
    return 150e6 + 120 * 2.5 * entries


def speed_memory(orders: int, meshes: int, bearings: int) -> float:
    """Memory [bytes] that a speed takes in a linear response of so many orders."""
    return _NUMBER * meshes * (orders + 1) * max(_CURVES, _VARIABLES + _BEARING * bearings)


def nonlinear_memory(steps: int, harmonics: int, bearings: int, rows: int) -> float:
    """Memory [bytes] that a speed takes where flanks part, with so many steps of the period and orders."""
    return _NUMBER * ((_STEP + 32 * rows) * steps + 2 * _BEARING * harmonics * (1 + bearings))


def sample_memory(harmonics: int, block: int, rows: int) -> float:
    """Memory [bytes] that a sample takes among others, at a block of speeds."""
    return _NUMBER * (4.5 * rows * (rows + 1) * (harmonics + 1) + _SPEED * block)
