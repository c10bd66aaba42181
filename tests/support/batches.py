"""A batch of error samples solved on one thread."""

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.batch import Batch, BatchSolution, chunks, solve_one_chunk


def solve_batch(batch: Batch, draws: NDArray) -> BatchSolution:
    """Solve every position for ``draws``, errors minus their means (sample, error), on this thread."""
    parts = [solve_one_chunk(batch, chunk) for chunk in chunks(draws)]
    names = ("approach", "stiffness", "force", "slope")
    joined = {name: np.concatenate([getattr(p, name) for p in parts], axis=-1)[..., : len(draws)] for name in names}
    return BatchSolution(**joined, rescued=sum(part.rescued for part in parts))
