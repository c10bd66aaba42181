"""Points of the unit cube from which random errors are drawn, reproducible in any order and on any machine."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError

Sampler = Literal["sobol", "random", "latin_hypercube"]

#: Binary digits of the Sobol sequence: at most 2³⁰ points, on a grid of 2⁻³⁰.
SOBOL_BITS = 30


def unit_samples(
    sampler: Sampler, count: int, dimension: int, seed: int, *, start: int = 0, stop: int | None = None
) -> NDArray:
    """Points in the open cube (0, 1)^dimension, or some rows of them.

    Row i is the same bit for bit, however the rows are split into ranges. With "sobol" and "random" it does not depend
    on ``count`` either, so that a run can be extended; with "latin_hypercube" it necessarily does.

    Parameters
    ----------
    sampler
        "sobol": Sobol sequence, scrambled by a random linear matrix and a digital shift (Matoušek 1998); any count,
        best at powers of two. "random": pseudo-random numbers (PCG64). "latin_hypercube": one point in each of
        ``count`` slices of every axis (McKay 1979).
    count, dimension
        Number of points and of random variables.
    seed
        Non-negative whole number.
    start, stop
        Return the rows from ``start`` up to, not including, ``stop``; all by default.

    Returns
    -------
    Points (stop − start, dimension), strictly between 0 and 1, since normal quantiles are infinite at 0 and 1.

    Raises
    ------
    InputError
        If the sampler is unknown, a number is negative, or the range is not within the points.
    """
    stop = count if stop is None else stop
    if sampler not in _DRAW:
        raise InputError("sampler", sampler, f"must be one of {', '.join(get_args(Sampler))}")
    for name, value in (("samples", count), ("dimension", dimension), ("seed", seed)):
        if value < 0:
            raise InputError(name, value, "must not be negative")
    if not 0 <= start <= stop <= count:
        raise InputError("rows", f"{start} to {stop}", f"must lie within 0 to {count}")
    if dimension == 0 or start == stop:
        return np.empty((stop - start, dimension))
    # only pseudo-random numbers may be exactly 0, once in 2⁵³ numbers
    return np.clip(_DRAW[sampler](count, dimension, seed, start, stop), 2.0**-54, 1 - 2.0**-53)


def _sobol(count: int, dimension: int, seed: int, start: int, stop: int) -> NDArray:
    from scipy.stats import qmc

    if count > 2**SOBOL_BITS:
        raise InputError("samples", count, f'sampler "sobol" has {2**SOBOL_BITS} at most')
    sequence = qmc.Sobol(dimension, scramble=True, bits=SOBOL_BITS, rng=seed)
    # draw the first point separately, since SciPy warns if the first draw is not a power of two
    points = sequence.random(1)
    if start > 0:
        sequence.fast_forward(start - 1)
        points = np.empty((0, dimension))
    points = np.concatenate([points, sequence.random(stop - start - len(points))])
    return points + 2.0 ** -(SOBOL_BITS + 1)  # from the corners of the grid cells, which may be 0, to their middles


def _random(count: int, dimension: int, seed: int, start: int, stop: int) -> NDArray:
    # the generator advances by one step for each number
    return np.random.Generator(np.random.PCG64(seed).advance(start * dimension)).random((stop - start, dimension))


def _latin_hypercube(count: int, dimension: int, seed: int, start: int, stop: int) -> NDArray:
    from scipy.stats import qmc

    return qmc.LatinHypercube(dimension, rng=seed).random(count)[start:stop]


_DRAW = {"sobol": _sobol, "random": _random, "latin_hypercube": _latin_hypercube}
