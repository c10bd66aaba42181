"""The workers of a dask scheduler that have proved that they compute what this process does."""

from __future__ import annotations

import logging
import time
from typing import Any

from gearbench.errors import GearbenchError, InputError
from gearbench.optimisation.proof import Proof, difference, prove
from gearbench.optimisation.scheduler import persistently
from gearbench.optimisation.study import OptimisationStudy

_LOG = logging.getLogger(__name__)

#: Seconds that is waited for a worker, and for its proof: the first time on a machine it compiles its kernels.
WAIT = 600.0
#: Seconds of silence after which is said what is waited for, and between two looks.
SILENCE, LOOK = 10.0, 0.1


class Crew:
    """Workers by their proofs.

    Parameters
    ----------
    client
        Client of the scheduler.
    scheduler
        As the user named it.
    """

    def __init__(self, client: Any, scheduler: str) -> None:
        self._client, self._scheduler = client, scheduler
        self._asked: dict[str, Any] = {}
        self._proven: set[str] = set()
        self._refused: set[str] = set()
        self._ours: Proof | None = None
        self._begun = False

    def proven(self, study: OptimisationStudy) -> dict[str, int]:
        """Threads of each worker that may evaluate designs of ``study``, by its address; at least one worker.

        Workers that are new are asked for their proof. The first call waits for the proofs of all that are there.

        Raises
        ------
        InputError
            If a worker differs, in the first call; later it is left out, with a line in the log.
        GearbenchError
            If there is no worker after ``WAIT`` seconds; says which is missing, workers or proofs.
        """
        start, said = time.monotonic(), False
        while True:
            connected: dict[str, int] = persistently(self._client.nthreads, self._client)
            self._ask(study, connected)
            self._judge()
            found = {address: threads for address, threads in connected.items() if address in self._proven}
            if found and (self._begun or not self._asked):
                self._begun = True
                return found
            waited = time.monotonic() - start
            if waited > WAIT:
                raise GearbenchError(f"{self._missing()} within {WAIT / 60:.0f} min")
            if waited > SILENCE and not said:
                said = True
                _LOG.warning("gearbench: %s; waiting up to %.0f min", self._missing(), WAIT / 60)
            time.sleep(LOOK)

    def _missing(self) -> str:
        """What is waited for."""
        if self._asked:
            first = next(iter(self._asked))
            return f"worker {first} of {self._scheduler} has not proved itself yet (the first time it compiles kernels)"
        others = " that may be used" if self._refused else ""
        return f"no worker{others} is connected to the scheduler {self._scheduler}"

    def _ask(self, study: OptimisationStudy, connected: dict[str, int]) -> None:
        """Ask new workers for their proofs, and forget those that have left."""
        for address in self._asked.keys() - connected.keys():
            del self._asked[address]
        for address in connected.keys() - self._asked.keys() - self._proven - self._refused:
            self._asked[address] = self._client.submit(prove, study, workers=[address], pure=False)
        if self._asked and self._ours is None:
            self._ours = prove(study)

    def _judge(self) -> None:
        """Compare the proofs that have come with that of this process."""
        for address, future in list(self._asked.items()):
            if not future.done():
                continue
            del self._asked[address]
            if future.status == "cancelled":
                raise OSError("connection lost")
            fault = self._difference(future) if future.status == "finished" else _failed(future)
            if not fault:
                self._proven.add(address)
                continue
            self._refused.add(address)
            if not self._begun:
                raise InputError("scheduler", self._scheduler, f"worker {address} is refused: {fault}")
            _LOG.warning("gearbench: worker %s is refused: %s", address, fault)

    def _difference(self, future: Any) -> str:
        """What is not as in this process, "" where nothing is."""
        assert self._ours is not None
        return difference(persistently(future.result, self._client), self._ours)


def _failed(future: Any) -> str:
    """Why a worker could not prove itself."""
    error = future.exception()
    return f"it cannot evaluate a design ({type(error).__name__}: {' '.join(str(error).split())[:120]})"
