"""One contact problem under other loads, and its solutions: their units, and how to split and to stack them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.problem import ContactProblem, ContactSolution, under_shares

_ARRAYS = tuple(field.name for field in fields(ContactSolution) if field.name != "corrected")
#: Arrays of a solution that scale with the units of force and displacement, which are proportional to the load.
_PROPORTIONAL = {"force", "approach", "coarse_approach"}


def under_force(problem: ContactProblem, force: float) -> ContactProblem:
    """``problem`` under another normal force F_bn [N], with the unit of displacement proportional to it."""
    f = force / problem.force
    loaded = under_shares(problem, np.full(len(problem.gap), f))
    # the share of the cells stays 1: force and unit are scaled instead
    return replace(loaded, force=force, length_scale=problem.length_scale * f, cells=problem.cells)


def in_full_load_units(solution: ContactSolution, share: NDArray) -> ContactSolution:
    """Multiply forces and approaches of a solution by the ``share`` of the load, (position,).

    A problem from ``under_shares`` keeps the units of the full load, and its forces sum to 1: its ``solution`` holds
    forces and approaches divided by the share.
    """
    return replace(solution, **{name: (getattr(solution, name).T * share).T for name in _PROPORTIONAL})


def split_positions(solution: ContactSolution, counts: Sequence[int]) -> list[ContactSolution]:
    """Split one solution into several, of ``counts`` positions each."""
    parts, ends = [], np.cumsum(counts)
    for first, last in zip(ends - counts, ends, strict=True):
        arrays = {name: getattr(solution, name)[first:last] for name in _ARRAYS}
        # ``corrected`` counts positions of the whole solution: the first part takes it, so that the sum stays right
        parts.append(ContactSolution(**arrays, corrected=0 if parts else solution.corrected))
    return parts


def stack_loads(solution: ContactSolution, loads: int) -> ContactSolution:
    """Reshape the arrays of a solution from (load · position, …) to (load, position, …)."""
    arrays = {name: getattr(solution, name) for name in _ARRAYS}
    return replace(solution, **{name: x.reshape(loads, -1, *x.shape[1:]) for name, x in arrays.items()})
