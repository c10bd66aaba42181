"""A process that evaluates designs, one after the other.

Messages are pickled and go through its standard input and output: once for all designs of a generation what they have
in common, then design by design. It ends when its input is closed, so also where the program that started it was
killed.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from contextlib import suppress

from gearbench.errors import GearbenchError
from gearbench.optimisation.child import start
from gearbench.optimisation.problem import Evaluation, evaluate
from gearbench.optimisation.racing import Rivals
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.threads import single_threaded_blas

#: What all designs of a generation have in common.
Common = tuple[OptimisationStudy, Rivals | None]


class LostError(GearbenchError):
    """A worker has ended."""


class Worker:
    """A worker, started here; used by one thread at a time.

    Parameters
    ----------
    share
        Number of workers, which share the memory.
    """

    def __init__(self, share: int) -> None:
        self._process = start(__name__, share=share)
        self._told: Common | None = None

    def evaluate(self, common: Common, design: Design) -> Evaluation:
        """As ``problem.evaluate``.

        Raises
        ------
        LostError
            If the process has ended.
        MemoryBudgetError
            As ``problem.evaluate``.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            pickle.dump(
                (None if self._told is common else common, design), self._process.stdin, pickle.HIGHEST_PROTOCOL
            )
            self._process.stdin.flush()
            self._told = common
            answer = pickle.load(self._process.stdout)
        except (OSError, EOFError, ValueError, pickle.UnpicklingError):
            raise LostError("a worker process has ended: with --threads 1 there are none") from None
        if isinstance(answer, Exception):
            raise answer
        return answer

    def end(self) -> None:
        """End it at once, whatever it is doing."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with suppress(OSError):
                pipe.close()


@single_threaded_blas()
def main() -> None:
    """Answer until the standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what anything prints is no answer
    common: Common | None = None
    with suppress(EOFError, BrokenPipeError):
        while True:
            told, design = pickle.load(requests)
            common = told or common
            assert common is not None
            study, rivals = common
            answer: Evaluation | Exception
            try:
                answer = evaluate(study, design, rivals)
            except Exception as error:
                answer = error
            pickle.dump(answer, answers, pickle.HIGHEST_PROTOCOL)
            answers.flush()
    os._exit(0)  # what nobody reads any more stays unwritten


if __name__ == "__main__":
    main()
