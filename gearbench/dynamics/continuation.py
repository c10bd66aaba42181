"""Curves of solutions R(z, λ) = 0 followed around their folds: pseudo arc-length continuation.

Source: Keller (1977); Seydel, Practical Bifurcation and Stability Analysis, ch. 4.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import GearbenchError

#: Residual (dimensionless) of a solution, Newton steps allowed, points of a curve at most.
TOLERANCE, NEWTON, POINTS = 1e-10, 12, 20000

#: R (n,), ∂R/∂z (n, n), ∂R/∂λ (n,)
System = Callable[[NDArray, float], tuple[NDArray, NDArray, NDArray]]


def at_fixed(system: System, z: NDArray, parameter: float) -> NDArray | None:
    """Solution near z at a fixed parameter, by Newton's method with halved steps; None where it does not converge."""
    residual, J, _ = system(z, parameter)
    for _ in range(8 * NEWTON):
        size = np.abs(residual).max()
        if size <= TOLERANCE:
            return z
        step = np.linalg.solve(J, residual)
        share = 1.0
        while share > 1e-4:
            new, J_new, _ = system(z - share * step, parameter)
            if np.abs(new).max() < size:
                break
            share /= 2
        else:
            return None
        z, residual, J = z - share * step, new, J_new
    return None


def follow(
    system: System, z: NDArray, start: float, end: float, step: float, longest: float
) -> tuple[NDArray, NDArray]:
    """Points (point, n) and parameters (point,) of the curve through the solution z at ``start``, until ``end``.

    Parameters
    ----------
    system
        In units in which all its unknowns and the parameter are of order one.
    z
        Solution at ``start``.
    start, end
        Parameter, where the curve begins and ends.
    step, longest
        First and longest step along the curve.

    Raises
    ------
    GearbenchError
        If the curve cannot be followed to its end.
    """
    point = np.append(z, start)
    tangent = np.append(np.zeros(len(z)), np.sign(end - start))
    found, shortest = [point], 1e-7 * step
    while len(found) < POINTS:
        tangent = _tangent(system, point, tangent)
        new, steps = _correct(system, point + step * tangent, tangent)
        while new is None or np.linalg.norm(new - point) > 3 * step:
            step /= 2
            if step < shortest:
                raise GearbenchError(f"the curve of responses cannot be followed beyond {point[-1]:.6g} of its range")
            new, steps = _correct(system, point + step * tangent, tangent)
        point = new
        found.append(point)
        if (point[-1] - end) * np.sign(end - start) >= 0:
            curve = np.array(found)
            return curve[:, :-1], curve[:, -1]
        if (point[-1] - start) * np.sign(end - start) < -0.5 * abs(end - start):
            break
        step = min(step * (1.5 if steps <= 4 else 0.7 if steps > 7 else 1.0), longest)
    raise GearbenchError(f"the curve of responses does not reach its end after {len(found)} points")


def _tangent(system: System, point: NDArray, before: NDArray) -> NDArray:
    _, J, along = system(point[:-1], point[-1])
    A = np.vstack([np.column_stack([J, along]), before])
    b = np.zeros(len(point))
    b[-1] = 1.0
    t = np.linalg.solve(A, b)
    return t / np.linalg.norm(t)


def _correct(system: System, guess: NDArray, tangent: NDArray) -> tuple[NDArray | None, int]:
    """Solution in the plane through the guess across the tangent, and the steps it took; None where there is none."""
    point = guess
    residual, J, along = system(point[:-1], point[-1])
    full = np.append(residual, tangent @ (point - guess))
    for count in range(NEWTON):
        size = np.linalg.norm(full)
        if np.abs(full).max() <= TOLERANCE:
            return point, count
        try:
            move = np.linalg.solve(np.vstack([np.column_stack([J, along]), tangent]), full)
        except np.linalg.LinAlgError:
            return None, count
        # flanks that part or touch at a step of the period bend the residual: shorter steps, if need be
        for share in (1.0, 0.5, 0.25, 0.1, 0.03):
            trial = point - share * move
            residual, J, along = system(trial[:-1], trial[-1])
            full = np.append(residual, tangent @ (trial - guess))
            if np.linalg.norm(full) < size:
                break
        point = trial
    return None, NEWTON
