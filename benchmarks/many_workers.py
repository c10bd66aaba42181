"""Many dask workers on one machine: what a design costs the search and the scheduler, and what losing workers costs.

``python -m benchmarks.many_workers`` starts a scheduler, a process with 64 workers of one thread each, and gives them
designs whose evaluation is a sleep. The processes are apart, so that the processor time of each is known. The workers
are in one process because 64 would not fit on a small machine; of the search and of the scheduler they ask the same.
"""

from __future__ import annotations

import asyncio
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from threading import Timer
from typing import Any

import numpy as np
import psutil

from gearbench import load_study
from gearbench.optimisation import engine
from gearbench.optimisation.problem import Evaluation
from gearbench.optimisation.racing import Rivals
from gearbench.optimisation.study import Design, OptimisationStudy, Robustness

ROOT = Path(__file__).parents[1]
WORKERS, DESIGNS = 64, 2000
#: Seconds that each evaluation sleeps; chosen so that 64 workers ask for more than one core gives, and for less.
SLEEPS = (0.1, 0.5)


def asleep(study: OptimisationStudy, design: Design, rivals: Rivals | None = None) -> Evaluation:
    """An evaluation that takes its time and no processor."""
    time.sleep(float(study.name))  # the_study
    numbers = (1.0,) * len(study.statistics)
    return Evaluation(violation=0.0, reason="", constraints=(1.0,) * len(study.constraints), statistics=numbers)


async def work(address: str, count: int) -> None:
    """Workers of one thread each, until the process is killed."""
    from distributed import Worker

    engine.evaluate = asleep
    async with Together([Worker(address, nthreads=1, dashboard=False) for _ in range(count)]):
        await asyncio.Event().wait()


class Together:
    """Workers that begin together."""

    def __init__(self, workers: list[Any]) -> None:
        self._workers = workers

    async def __aenter__(self) -> None:
        await asyncio.gather(*self._workers)

    async def __aexit__(self, *_: object) -> None:
        await asyncio.gather(*(worker.close() for worker in self._workers))


@contextmanager
def started(*words: str) -> Iterator[psutil.Process]:
    """A process of Python, killed at the end of the block."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, "-m", *words], cwd=ROOT, **quiet) as process:
        try:
            yield psutil.Process(process.pid)
        finally:
            process.kill()


def used(process: psutil.Process) -> float:
    """Processor time of a process [s]."""
    times = process.cpu_times()
    return times.user + times.system


def the_study(seconds: float) -> OptimisationStudy:
    """A study that races, whose name is the time of an evaluation."""
    study = load_study(ROOT / "examples" / "optimise_small.toml")
    return replace(study, name=str(seconds), robustness=Robustness(samples=1000, racing=True))


def the_rivals(study: OptimisationStudy) -> Rivals | None:
    """As many as a race has, of the size they have."""
    values = np.ones((len(study.responses), study.robustness.samples))
    return Rivals.of(study, [values] * 64, [(1.0,) * len(study.statistics)] * 64)


def run(workers: int = WORKERS, designs: int = DESIGNS) -> None:
    """Print what designs cost, evaluations of three lengths, and the last with half of the workers killed."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    scheduler_words = ("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", address.rsplit(":", 1)[1])
    half = ("benchmarks.many_workers", address, str(workers // 2))
    with ExitStack() as stack:
        scheduler = stack.enter_context(started(*scheduler_words, "--no-dashboard"))
        time.sleep(5)
        stack.enter_context(started(*half))
        lost = stack.enter_context(started(*half))
        dask = stack.enter_context(engine.Dask(address))
        while len(dask.client.nthreads()) < workers:
            time.sleep(0.5)
        asked = [(i % 5, i // 5 % 11, i // 55 % 6, i // 330 % 8, i // 2640 % 6, 0) for i in range(designs)]
        list(dask.evaluate(the_study(0.0), asked[:workers]))  # the workers prove themselves
        for seconds, kills in [*((s, False) for s in SLEEPS), (SLEEPS[-1], True)]:
            study = the_study(seconds)
            rivals, me = the_rivals(study), psutil.Process()
            before, began = (used(me), used(scheduler)), time.perf_counter()
            ideal = designs * seconds / workers
            with killing(lost, 0.3 * ideal) if kills else nullcontext():
                found = dict(dask.evaluate(study, asked, rivals))
            assert found.keys() == {*asked}
            wall = time.perf_counter() - began
            search, central = (1e3 * (used(p) - b) / designs for p, b in zip((me, scheduler), before, strict=True))
            how = f"{seconds:.2f} s each" + kills * ", half of the workers killed"
            times = f"search {search:.2f} ms, scheduler {central:.2f} ms"
            print(f"{how}: {wall:.1f} s (ideal {ideal:.1f}), processor time of a design: {times}", flush=True)


@contextmanager
def killing(process: psutil.Process, seconds: float) -> Iterator[None]:
    """In the block, after some seconds, a process is killed."""
    timer = Timer(seconds, process.kill)
    timer.start()
    try:
        yield
    finally:
        timer.join()


if __name__ == "__main__":
    if len(sys.argv) > 1:
        asyncio.run(work(sys.argv[1], int(sys.argv[2])))
    else:
        run()
