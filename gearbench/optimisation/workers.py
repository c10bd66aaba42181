"""Evaluation of designs side by side: by processes of this machine, or by any executor of ``concurrent.futures``.

Workers are processes, because most of an evaluation is Python code, which runs on one thread per process at a time.
They must run the same software as the calling process: every task carries its versions and the hash of its sources.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed
from contextlib import contextmanager
from functools import cache, partial
from importlib.util import find_spec
from itertools import groupby
from pathlib import Path
from typing import TypeVar

from gearbench.effects.registry import installed
from gearbench.errors import GearbenchError, InputError
from gearbench.optimisation.problem import Evaluation, evaluate, macro_geometry
from gearbench.optimisation.racing import Incumbents
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.processes import Processes
from gearbench.results.provenance import versions
from gearbench.threads import single_threaded_blas

Result = TypeVar("Result")

#: Largest number of designs with the same macro-geometry in one task of a worker.
LARGEST_SHARE = 8


@contextmanager
def worker_processes(count: int) -> Iterator[Executor | None]:
    """Context with an executor of ``count`` processes; None for one, because this process does the work then."""
    if count == 1:
        yield None
        return
    with Processes(count) as processes:
        yield processes


def evaluations(
    executor: Executor | None,
    study: OptimisationStudy,
    designs: Sequence[Design],
    incumbents: Incumbents | None = None,
) -> Iterator[tuple[Design, Evaluation]]:
    """Yield designs with their evaluations as they are finished; see ``problem.evaluate`` and ``side_by_side``."""
    # designs of the same teeth go to one worker, which computes the compliance of these teeth once
    ordered = sorted(designs, key=lambda design: macro_geometry(study, design))
    groups = [list(group) for _, group in groupby(ordered, key=lambda design: macro_geometry(study, design))]
    shares = [group[i : i + LARGEST_SHARE] for group in groups for i in range(0, len(group), LARGEST_SHARE)]
    return side_by_side(executor, study, partial(evaluate, study, incumbents=incumbents), shares)


def side_by_side(
    executor: Executor | None,
    study: OptimisationStudy,
    function: Callable[[Design], Result],
    shares: Sequence[Sequence[Design]],
) -> Iterator[tuple[Design, Result]]:
    """Yield designs of ``study`` with ``function(design)`` as they are finished.

    A share is a list of designs that one worker takes one after the other. Without ``executor``, this process does the
    work. The designs of a worker process that ends are given to another one.

    Raises
    ------
    GearbenchError
        If a second worker process ends when it is given one of these designs alone.
    InputError
        If a worker runs other software than this process.
    """
    if executor is None:
        for design in (design for share in shares for design in share):
            yield design, _apply(identity(), function, [design])[0]
        return
    futures: dict[Future[list[Result]], Sequence[Design]] = {}
    lost: list[Design] = []
    try:
        futures |= {executor.submit(_apply, identity(), function, share): share for share in shares}
        for future in as_completed(futures):
            if isinstance(future.exception(), BrokenExecutor):
                lost += futures[future]
            else:
                yield from zip(futures[future], future.result(), strict=True)
        for design in lost:  # one at a time: a second loss is due to this design, and all the memory is free for it
            again = executor.submit(_apply, identity(), function, [design])
            if isinstance(again.exception(), BrokenExecutor):
                values = ", ".join(f"{name} = {value}" for name, value in study.values(design).items())
                raise GearbenchError(f"the design {values} ended two worker processes: too little memory?")
            yield design, again.result()[0]
    except BrokenExecutor:  # an executor that does not start its workers again
        raise GearbenchError("a worker process has ended: too little memory? --resume continues the search") from None
    finally:
        for future in futures:
            future.cancel()


@single_threaded_blas()
def _apply(asked_by: dict[str, str], function: Callable[[Design], Result], designs: Sequence[Design]) -> list[Result]:
    """Apply ``function`` to ``designs`` in a worker that runs the software of the calling process."""
    require_same(asked_by)
    return [function(design) for design in designs]


@cache
def identity() -> dict[str, str]:
    """Software of this process: versions of Python and packages, and the SHA-256 of the sources.

    The sources are those of gearbench, fem_reference (finite elements), and the effects of other installed packages.
    """
    package = Path(__file__).parents[1]
    paths = [*package.rglob("*.py"), *(package.parent / "fem_reference").rglob("*.py")]
    origins = (find_spec(entry.module) for entry in installed().values())
    paths += [Path(spec.origin) for spec in origins if spec is not None and spec.origin is not None]
    files = sorted(hashlib.sha256(path.read_bytes()).digest() for path in paths)
    return {"versions": versions(), "sources": hashlib.sha256(b"".join(files)).hexdigest()}


# computed now, when this process loads its code, because the files may change while it runs
identity()


def require_same(asked_by: dict[str, str]) -> None:
    """Refuse tasks from a process that runs other software.

    Raises
    ------
    InputError
        If the software differs; names the machine, and the versions if they differ.
    """
    this_process = identity()
    if asked_by == this_process:
        return
    difference = "has other source files of gearbench"
    if asked_by["versions"] != this_process["versions"]:
        difference = f"has {this_process['versions']}, the search {asked_by['versions']}"
    raise InputError("worker", platform.node(), f"{difference}: install the same there and restart the worker")
