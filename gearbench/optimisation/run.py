"""Run of a study: in every generation, ask for designs, evaluate the new ones, store them, tell the search."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from gearbench.lazy import xr
from gearbench.optimisation.archive import Archive
from gearbench.optimisation.dataset import front_dataset
from gearbench.optimisation.problem import Evaluation
from gearbench.optimisation.racing import Incumbents, spread
from gearbench.optimisation.search import Search
from gearbench.optimisation.store import FRONT, Store
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.study_file import check_study
from gearbench.optimisation.workers import evaluations, worker_processes
from gearbench.results.netcdf import save
from gearbench.threads import default_threads


@dataclass(frozen=True, kw_only=True)
class Progress:
    """Progress of a run.

    Parameters
    ----------
    generation, generations
        Number of finished generations, and of all generations.
    fraction
        Finished share of the run, including the part done of the current generation, 0 to 1.
    restored
        Number of generations read from disk instead of computed.
    asked, evaluated, feasible
        Number of designs asked for so far, of distinct designs evaluated, and of feasible ones among these.
    hypervolume
        Share of the box from 0 to the reference point that the front dominates. The reference point is 1.1 times the
        worst objectives of the first generation with feasible designs.
    elapsed, evaluated_here
        Seconds since the start of this process, and number of designs it has evaluated.
    """

    generation: int
    generations: int
    fraction: float
    restored: int
    asked: int
    evaluated: int
    feasible: int
    hypervolume: float
    elapsed: float
    evaluated_here: int

    @property
    def remaining(self) -> float | None:
        """Remaining seconds at the speed so far; None before anything is evaluated."""
        start = self.restored / self.generations
        if self.evaluated_here == 0 or self.fraction <= start:
            return None
        return self.elapsed * (1 - self.fraction) / (self.fraction - start)


def optimise(
    study: OptimisationStudy,
    *,
    directory: str | Path | None = None,
    resume: bool = False,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[Progress], None] = lambda _: None,
) -> xr.Dataset:
    """Search for the Pareto-optimal designs of a study.

    Parameters
    ----------
    study
        The study, see ``gearbench.read_study``.
    directory
        Folder that takes every finished generation, and the result at the end; by default nothing is stored.
    resume
        Continue the search in ``directory``; the result equals that of an uninterrupted run.
    threads
        Number of worker processes, each of which evaluates one design at a time; by default the number of processors.
    executor
        Executor of ``concurrent.futures`` that evaluates the designs instead, e.g. one of ``dask.distributed``.
    progress
        Called after each evaluation and each generation.

    Returns
    -------
    Dataset of all evaluated designs over ``design`` (variables, objectives, constraints, mean, standard deviation and
    maximum of the responses, ``feasible``, ``reason``, ``on_front``, ``in_population``) and of the history over
    ``generation`` (``evaluated``, ``hypervolume``, …). It depends on the study alone, not on the workers.

    Raises
    ------
    InputError
        If the study cannot be run, or the folder cannot be used.
    GearbenchError
        If a worker process ends unexpectedly.
    OSError
        If a generation cannot be stored; earlier ones are kept.
    """
    check_study(study)
    with ExitStack() as stack:
        store = None if directory is None else stack.enter_context(Store(directory, study, resume=resume))
        workers = executor or stack.enter_context(worker_processes(threads or default_threads()))
        run = _Run(study, store, workers, progress)
        run.search()
        dataset = run.dataset()
        if store is not None:
            save(dataset, store.folder / FRONT)
        return dataset


class _Run:
    """Running search: it asks, evaluates, stores and tells, and reports its progress."""

    def __init__(
        self,
        study: OptimisationStudy,
        store: Store | None,
        workers: Executor | None,
        progress: Callable[[Progress], None],
    ) -> None:
        self._study, self._store, self._workers, self._progress = study, store, workers, progress
        self._archive, self._search = Archive(study), Search(study)
        self._start = time.perf_counter()
        self._designs_asked = self._restored = self._evaluated = 0

    def dataset(self) -> xr.Dataset:
        """Dataset of all designs and of the history of the search."""
        return front_dataset(self._archive, self._search.population, time.perf_counter() - self._start)

    def search(self) -> None:
        """Run all generations."""
        for generation in range(1, self._study.algorithm.generations + 1):
            designs = self._search.ask()
            if not designs:  # the design space is exhausted
                break
            self._search.tell(self._generation(generation, designs))
            self._designs_asked += len(designs)
            self._report(0.0)

    def _generation(self, generation: int, designs: Sequence[Design]) -> list[Evaluation]:
        """Results of the ``designs`` of ``generation`` (from 1): read from the store, or computed and stored."""
        stored = self._store.read(generation, designs) if self._store is not None else None
        if stored is not None:
            self._restored += 1
            return self._archive.add(designs, dict(zip(designs, stored, strict=True)))
        unknown = self._archive.unknown(designs)
        new: dict[Design, Evaluation] = {}
        feasible = 0
        for design, result in evaluations(self._workers, self._study, unknown, self._incumbents() if unknown else None):
            new[design] = result
            feasible += result.feasible
            self._evaluated += 1
            self._report(len(new) / len(unknown), len(new), feasible)
        results = self._archive.add(designs, new)
        if self._store is not None:
            self._store.write(generation, designs, results)
        return results

    def _incumbents(self) -> Incumbents | None:
        """Designs of the front to race against; those read from disk are evaluated again to have their samples."""
        archive = self._archive
        if not self._study.robustness.racing or not archive.front:
            return None
        # evenly by rank in the first objective
        chosen = [archive.front[i] for i in spread(archive.front_objectives[:, 0])]
        missing = {archive.designs[i]: i for i in chosen if i not in archive.responses}
        for design, result in evaluations(self._workers, self._study, list(missing)):
            assert result.values is not None
            archive.responses[missing[design]] = result.values
        values = [archive.responses[i] for i in chosen]
        return Incumbents.of(self._study, values, [archive.results[i].statistics for i in chosen])

    def _report(self, part: float, new: int = 0, feasible: int = 0) -> None:
        """Report progress.

        Of the current generation the share ``part`` is done, with ``new`` designs of which ``feasible`` are feasible.
        """
        archive, generations = self._archive, self._study.algorithm.generations
        done = len(archive.asked)  # one entry per finished generation
        self._progress(
            Progress(
                generation=done,
                generations=generations,
                fraction=min(1.0, (done + part) / generations),
                restored=self._restored,
                asked=self._designs_asked,
                evaluated=len(archive.designs) + new,
                feasible=(archive.feasible_found or [0])[-1] + feasible,
                hypervolume=(archive.hypervolumes or [0.0])[-1],
                elapsed=time.perf_counter() - self._start,
                evaluated_here=self._evaluated,
            )
        )
