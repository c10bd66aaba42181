"""Designs and their results by gear, in a temporary database: beyond a few megabytes it is on disk, not in memory.

It belongs to one search and ends with it. What an interrupted search had found is in its ``store``.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache, partial
from weakref import finalize

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import GearbenchError
from gearbench.optimisation.problem import Evaluation, gear_key
from gearbench.optimisation.study import Design, OptimisationStudy

#: Kilobytes of the database that are kept in memory, and gears whose keys are.
CACHE, KEYS = 32_000, 10_000
#: Designs that are read at a time.
BATCH = 10_000

_TABLES = """
CREATE TABLE design (
    number INTEGER PRIMARY KEY, gear BLOB UNIQUE NOT NULL, code BLOB NOT NULL, known BLOB NOT NULL,
    reason TEXT NOT NULL, samples INTEGER NOT NULL, generation INTEGER NOT NULL
);
CREATE TABLE response (number INTEGER PRIMARY KEY, value BLOB NOT NULL);
CREATE TABLE asked (generation INTEGER PRIMARY KEY, number BLOB NOT NULL);
"""


class Register:
    """Each different gear once, numbered from 0 in the order it was first asked for.

    Every method raises ``GearbenchError`` if the folder for temporary files is full.

    Parameters
    ----------
    study
        The study.
    """

    def __init__(self, study: OptimisationStudy) -> None:
        self._study = study
        self._key = lru_cache(maxsize=KEYS)(partial(gear_key, study))
        # one thread at a time uses it; it may be closed by another
        self._database = sqlite3.connect("", isolation_level=None, check_same_thread=False)
        finalize(self, self._database.close)
        self._count = 0
        with self._told():
            for pragma in ("journal_mode = OFF", "synchronous = OFF", f"cache_size = -{CACHE}"):
                self._database.execute(f"PRAGMA {pragma}")
            self._database.executescript(_TABLES)

    def __len__(self) -> int:
        return self._count

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Faults of the disk in one line."""
        try:
            yield
        except sqlite3.OperationalError as error:
            reason = "the folder for temporary files cannot hold the designs of the search"
            raise GearbenchError(f"{reason} ({error}): set SQLITE_TMPDIR") from None

    def number(self, design: Design) -> int | None:
        """Number of the gear that ``design`` is; None where it is not known."""
        with self._told():
            row = self._database.execute("SELECT number FROM design WHERE gear = ?", (self._key(design),)).fetchone()
        return None if row is None else row[0]

    def unknown(self, designs: Sequence[Design]) -> list[Design]:
        """Those of ``designs`` that are not known, each different gear once."""
        found: dict[bytes, Design] = {}
        for design in designs:
            found.setdefault(self._key(design), design)
        return [design for design in found.values() if self.number(design) is None]

    def add(self, generation: int, designs: Sequence[Design], results: Sequence[Evaluation]) -> None:
        """Add gears that are not known, first asked for in ``generation``."""
        rows = [
            (
                self._count + i,
                self._key(design),
                np.array(design, dtype=float).tobytes(),
                np.array([result.violation, *result.constraints, *result.statistics]).tobytes(),
                result.reason,
                result.samples,
                generation,
            )
            for i, (design, result) in enumerate(zip(designs, results, strict=True))
        ]
        with self._told():
            self._database.execute("BEGIN")
            self._database.executemany("INSERT INTO design VALUES (?, ?, ?, ?, ?, ?, ?)", rows)
            self._database.execute("COMMIT")
        self._count += len(rows)

    def design(self, number: int) -> Design:
        """The design of a number, as it was first asked for."""
        return next(self._read("WHERE number = ?", number))[0]

    def result(self, number: int) -> Evaluation:
        """The result of a number."""
        return next(self._read("WHERE number = ?", number))[1]

    def batches(self) -> Iterator[list[tuple[Design, Evaluation, int]]]:
        """All designs in their order, their results and the generations they were first asked for, some at a time."""
        for first in range(0, self._count, BATCH):
            yield list(self._read("WHERE number >= ? AND number < ? ORDER BY number", first, first + BATCH))

    def _read(self, which: str, *numbers: int) -> Iterator[tuple[Design, Evaluation, int]]:
        kinds = [float if variable.kind == "real" else int for variable in self._study.variables]
        limits = len(self._study.constraints)
        with self._told():
            rows = self._database.execute(
                f"SELECT code, known, reason, samples, generation FROM design {which}", numbers
            )
            for code, known, reason, samples, generation in rows:
                violation, *values = np.frombuffer(known).tolist()
                design = tuple(kind(x) for kind, x in zip(kinds, np.frombuffer(code).tolist(), strict=True))
                result = Evaluation(
                    violation=violation,
                    reason=reason,
                    constraints=tuple(values[:limits]),
                    statistics=tuple(values[limits:]),
                    samples=samples,
                )
                yield design, result, generation

    def note_asked(self, generation: int, numbers: Sequence[int]) -> None:
        """Note the designs that a generation asked for."""
        with self._told():
            blob = np.array(numbers, dtype="int64").tobytes()
            self._database.execute("INSERT INTO asked VALUES (?, ?)", (generation, blob))

    def asked(self) -> Iterator[NDArray]:
        """Of each generation the numbers of the designs it asked for, (member,)."""
        with self._told():
            for (blob,) in self._database.execute("SELECT number FROM asked ORDER BY generation"):
                yield np.frombuffer(blob, dtype="int64")

    def keep_responses(self, number: int, values: NDArray) -> None:
        """Keep the responses of a design to all error samples, (response, sample)."""
        with self._told():
            row = number, np.ascontiguousarray(values).tobytes()
            self._database.execute("INSERT OR REPLACE INTO response VALUES (?, ?)", row)

    def responses(self, number: int) -> NDArray | None:
        """Responses that were kept of a design, (response, sample); None where none are."""
        with self._told():
            row = self._database.execute("SELECT value FROM response WHERE number = ?", (number,)).fetchone()
        return None if row is None else np.frombuffer(row[0]).reshape(len(self._study.responses), -1)

    def drop_responses(self, numbers: Sequence[int]) -> None:
        """Forget the responses of designs."""
        with self._told():
            self._database.executemany("DELETE FROM response WHERE number = ?", ((n,) for n in numbers))
