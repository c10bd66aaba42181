"""Memory budget: the memory of a run is predicted before it starts, and a run that needs too much is refused.

The budget is the least of ``--memory``, a share of the memory of the machine or container, and the rest of the process
limit (``ulimit -v``). The functions here predict memory from numbers of positions, segments and columns, which the
callers count.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

from gearbench.errors import InputError

#: Share of the machine's memory that may be used.
SHARE = 0.7
#: Environment variable with the budget in bytes; child processes inherit it.
VARIABLE = "GEARBENCH_MEMORY"
#: Smaller needs are never refused [bytes].
SMALL = 256e6

_UNITS = {"B": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12}
_CONTAINER = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


class MemoryBudgetError(InputError):
    """Error: a run needs more memory than the budget allows."""


def parse_memory(text: str) -> float:
    """Read bytes from a text such as "4GB" or "500 MB".

    Raises
    ------
    InputError
        If the text is not a number with a unit.
    """
    match = re.fullmatch(r"\s*(\d{1,9}(?:\.\d{1,9})?)\s*(B|kB|MB|GB|TB)\s*", text)
    if match is None or not float(match[1]):
        raise InputError("memory", text, "must be a number with a unit, such as 4GB or 500MB")
    return float(match[1]) * _UNITS[match[2]]


def shown(size: float) -> str:
    """Format bytes with a unit: 4.2 GB."""
    unit = next((unit for unit, factor in reversed(_UNITS.items()) if size >= factor), "B")
    return f"{size / _UNITS[unit]:.2g} {unit}" if size < 100 * _UNITS[unit] else f"{size / _UNITS[unit]:.0f} {unit}"


def memory_limit() -> float:
    """Memory that a run may use [bytes]."""
    limits = [SHARE * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    for path in _CONTAINER:
        with suppress(OSError, ValueError):
            limits.append(SHARE * float(Path(path).read_text(encoding="ascii")))
    with suppress(ValueError):
        limits.append(float(os.environ.get(VARIABLE, "")))
    limits += _of_process()
    return min(limits)


def _of_process() -> list[float]:
    """Memory that the limit of the address space leaves [bytes], in a list that is empty without a limit."""
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
    """Refuse a run that needs more memory than the budget.

    Parameters
    ----------
    size
        Needed memory [bytes].
    key, value
        Input that causes the need, as in ``InputError``.
    instead
        Text that says what would fit.

    Raises
    ------
    MemoryBudgetError
        If ``size`` exceeds the budget; names both, and ``instead``.
    """
    if size <= SMALL or size <= (limit := memory_limit()):
        return
    hint = f"; {instead}" if instead else ""
    raise MemoryBudgetError(key, value, f"needs about {shown(size)} of memory, {shown(limit)} are allowed{hint}")


def room() -> float:
    """Memory up to which no run is refused [bytes]."""
    return max(memory_limit(), SMALL)


def require_each(bytes_each: float, count: int, key: str, of: str) -> None:
    """Refuse ``count`` items of ``bytes_each`` bytes if they exceed the budget.

    Parameters
    ----------
    key
        Name of an item in the singular, e.g. "speed".
    of
        Text on the contents of an item.

    Raises
    ------
    MemoryBudgetError
        If the items do not fit; says how many would.
    """
    fits = int(room() / bytes_each)
    require(
        bytes_each * count, key, f"{count} {key}s × {of}", f"{fits} {key}s would fit" if fits else f"less than {of} fit"
    )


# -- memory of runs: most numbers held at the same time, as measured, with a reserve of a tenth to a third -------------
#: Size of a number [bytes].
_NUMBER = 8
#: Contact problem: numbers per two segments of a position (if tooth pairs are coupled), per segment and column of Ψ
#: (coupled, uncoupled), and per segment for contact lines, gaps, laws and results (coupled, uncoupled).
_SQUARE, _COLUMN, _SEGMENT = 3.4, (2.5, 3.4), (62.0, 30.0)
#: Solution that is kept while others are solved, and joined with them at the end: numbers per segment of a position,
#: and per position.
_KEPT_SEGMENT, _KEPT_POSITION = 4.0, 60.0
#: Mesh cycles of unlike teeth: numbers per position of a cycle, per position of the waves of orders computed at once,
#: per order, and per mode of the gaps of a cycle.
_CYCLE, _WAVE, _ORDER, _MODE = 5.0, 4.4, 9.5, 1.7
#: Number of orders computed at once: their waves are one array.
ORDERS_AT_ONCE = 4000
#: Ritz system: numbers per two functions of the section (spur, helical tooth), per two right-hand sides, and for the
#: rest.
_FUNCTIONS, _SIDES, _REST = (10.0, 14.0), 7.0, 3e4
#: Response over speed: numbers per mesh, speed and order, for curves over time, or for the variables and those per
#: bearing.
_CURVES, _VARIABLES, _BEARING = 48.0, 42.0, 7.0
#: Response with loss of contact: numbers per speed, row and step of the period, for both sweeps.
_STEP = 90.0
#: Error samples of a response: numbers per order and speed of a block.
_SPEED = 2.0


def position_memory(pairs: int, segments: int, columns: int, *, coupled: bool) -> float:
    """Memory of the contact problem of one position [bytes]."""
    n = pairs * segments
    # the compliance of an uncoupled pair is reduced if it has more columns than segments
    square = n * n if coupled else n * segments * (columns > segments)
    return _NUMBER * (_SQUARE * square + n * (_COLUMN[not coupled] * columns + _SEGMENT[not coupled]))


def result_memory(segments: int) -> float:
    """Memory of the results of one position in a sweep [bytes]."""
    return _NUMBER * (_KEPT_SEGMENT * segments + _KEPT_POSITION)


def batch_memory(segments: int, modes: int, rank: int, blocks: int, *, linearised: bool) -> float:
    """Memory of one position of error samples solved together [bytes]: products of columns, or the dense matrix."""
    of_samples = 2 * rank * rank if linearised else segments * rank * (rank + 1) / 2 + modes * blocks * rank
    return _NUMBER * (of_samples + segments * (4 * rank + 4 * modes))


def gaps_memory(segments: int, errors: int) -> float:
    """Memory of the gaps of random errors at one position [bytes]."""
    return _NUMBER * 4 * segments * errors


def cycles_memory(positions: int, cycles: int, orders: float, modes: int) -> float:
    """Memory of mesh cycles with gaps that are sums of ``modes``, and of their spectrum up to ``orders`` [bytes]."""
    count = cycles * orders
    numbers = cycles * positions * _CYCLE + min(count, ORDERS_AT_ONCE) * positions * _WAVE + count * _ORDER
    return _NUMBER * (numbers + cycles * modes * _MODE)


def order_memory() -> float:
    """Memory of one order of mesh cycles [bytes]."""
    return _NUMBER * _ORDER


def ritz_memory(functions: float, sides: float, *, helical: bool) -> float:
    """Memory of a solid tooth with ``functions`` of its section and ``sides`` right-hand sides [bytes]."""
    return _NUMBER * (_FUNCTIONS[helical] * functions**2 + _SIDES * sides**2 + _REST)


def sector_memory(entries: float) -> float:
    """Memory of finite elements with ``entries`` matrix entries before summation, to a factor of two [bytes]."""
    return 150e6 + 120 * 2.5 * entries


def speed_memory(orders: int, meshes: int, bearings: int) -> float:
    """Memory of one speed in a linear response [bytes]."""
    return _NUMBER * meshes * (orders + 1) * max(_CURVES, _VARIABLES + _BEARING * bearings)


def nonlinear_memory(steps: int, harmonics: int, bearings: int, rows: int) -> float:
    """Memory of one speed in a response with loss of contact, with ``steps`` of the period [bytes]."""
    return _NUMBER * (_STEP * rows * steps + 2 * _BEARING * harmonics * (1 + bearings))


def sample_memory(harmonics: int, block: int, rows: int) -> float:
    """Memory of one error sample at a block of speeds [bytes]."""
    return _NUMBER * (4.5 * rows * (rows + 1) * (harmonics + 1) + _SPEED * block)
