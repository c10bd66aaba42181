"""Scheduler and workers of dask on this machine, in processes that Ctrl-C in a terminal does not reach.

``python -m gearbench.optimisation.local_cluster N`` is the first of these processes. It prints the address of the
scheduler, and ends with all its workers when its standard input is closed: also where the program that started it was
killed.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread
from typing import Any

from gearbench.errors import GearbenchError
from gearbench.optimisation.child import start

#: Seconds that it may take to end.
END = 5.0


@contextmanager
def local_cluster(workers: int) -> Iterator[str]:
    """Address of a scheduler with ``workers`` workers of one thread each, ended at the end of the block.

    Raises
    ------
    GearbenchError
        If it cannot be started; with the last line that it printed.
    """
    with start(__name__, str(workers), share=workers, text=True, stderr=subprocess.DEVNULL) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            address = process.stdout.readline().strip()
            if "://" not in address:
                raise GearbenchError(f"the workers cannot be started: {address or 'no answer'}")
            yield address
        finally:
            process.stdin.close()
            try:
                process.wait(END)
            except subprocess.TimeoutExpired:
                process.kill()


def main() -> None:
    """Start the workers, and wait for the end of the standard input."""
    from distributed import LocalCluster

    ending = Thread(target=sys.stdin.read, daemon=True)
    ending.start()
    found: list[Any] = []

    def begin() -> None:
        """Print the address of the workers, or why there are none."""
        options: dict[str, Any] = {"dashboard_address": None, "silence_logs": 50}
        try:
            found.append(LocalCluster(n_workers=int(sys.argv[1]), threads_per_worker=1, **options))
        except Exception as error:
            print(" ".join(f"{error}".split())[:200], flush=True)
            os._exit(1)
        print(found[0].scheduler_address, flush=True)

    Thread(target=begin, daemon=True).start()
    ending.join()
    for cluster in found:
        cluster.close(timeout=END / 2)
    os._exit(0)  # without waiting for one that is being started


if __name__ == "__main__":
    main()
