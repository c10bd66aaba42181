"""One contact problem under several loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact import problem as single
from gearbench.contact.problem import ContactProblem, ContactSolution

_ARRAYS = tuple(field.name for field in fields(ContactSolution) if field.name != "polished")
#: Arrays of a solution in units that are proportional to the load.
_PROPORTIONAL = {"force", "approach", "coarse_approach"}


def under(problem: ContactProblem, force: float) -> ContactProblem:
    """``problem`` under another normal force F_bn [N], with the unit of displacement proportional to it."""
    f = force / problem.force
    loaded = single.under(problem, np.full(len(problem.gap), f))
    return replace(loaded, force=force, length_scale=problem.length_scale * f, along=problem.along)


def in_own_units(solution: ContactSolution, share: NDArray) -> ContactSolution:
    """Convert a solution to units of the full load, of which each position carries its ``share`` (position,)."""
    own = {name: (getattr(solution, name).T * share).T for name in _PROPORTIONAL}
    return replace(solution, **own)


def parted(solution: ContactSolution, counts: Sequence[int]) -> list[ContactSolution]:
    """Split one solution into several, of ``counts`` positions each."""
    found, ends = [], np.cumsum(counts)
    for first, last in zip(ends - counts, ends, strict=True):
        own = {name: getattr(solution, name)[first:last] for name in _ARRAYS}
        found.append(ContactSolution(**own, polished=0 if found else solution.polished))
    return found


def stacked(solution: ContactSolution, loads: int) -> ContactSolution:
    """Reshape the arrays of a solution from (load · position, …) to (load, position, …)."""
    own = {name: getattr(solution, name) for name in _ARRAYS}
    return replace(solution, **{name: x.reshape(loads, -1, *x.shape[1:]) for name, x in own.items()})
