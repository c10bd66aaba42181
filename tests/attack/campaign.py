"""Many attacked inputs of a kind by seed, and all that went wrong."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.attack.inputs import KINDS
from tests.attack.judge import Ending, faults, shoot


def attack(kind: str, seed: int) -> tuple[Ending, list[str]]:
    """One attacked input in a folder of its own."""
    import contextlib

    rng = np.random.default_rng([seed, *kind.encode()])
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        folder = Path(name)
        made = KINDS[kind](rng, folder)
        given = frozenset(path.name for path in folder.iterdir())
        ending = shoot(made.arguments)
        return ending, faults(ending, folder, given, made.targets)


def failures(kind: str, seeds: range) -> Iterator[str]:
    """A line for each attacked input that did not end as it must."""
    for seed in seeds:
        _, found = attack(kind, seed)
        if found:
            yield f"{kind} {seed}: {found[0]}"
