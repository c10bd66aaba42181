"""One contact problem under many loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact import problem as single
from gearbench.contact.problem import ContactProblem, ContactSolution

_ARRAYS = tuple(field.name for field in fields(ContactSolution) if field.name != "polished")
#: Those in units that are proportional to the load.
PROPORTIONAL = {"force", "approach", "coarse_approach"}


def under(problem: ContactProblem, force: float) -> ContactProblem:
    """``problem`` under another normal force F_bn [N], with the unit of displacement proportional to it."""
    f = force / problem.force
    loaded = single.under(problem, np.full(len(problem.gap), f))
    return replace(loaded, force=force, length_scale=problem.length_scale * f, along=problem.along)


def parted(
    solution: ContactSolution, shares: Sequence[float] | NDArray, counts: Sequence[int]
) -> list[ContactSolution]:
    """One solution, in the units of a whole load, as those under ``shares`` of it, ``counts`` positions each."""
    found, ends = [], np.cumsum(counts)
    for share, first, last in zip(shares, ends - counts, ends, strict=True):
        own = {name: getattr(solution, name)[first:last] for name in _ARRAYS}
        own |= {name: own[name] * share for name in PROPORTIONAL}
        found.append(ContactSolution(**own, polished=0 if found else solution.polished))
    return found
