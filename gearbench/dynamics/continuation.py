"""Curves of solutions R(z, λ) = 0 followed around their folds: pseudo arc-length continuation.

Source: Keller (1977); Seydel, Practical Bifurcation and Stability Analysis, ch. 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

#: Residual (dimensionless) of a solution, Newton steps allowed, points of a curve at most.
TOLERANCE, NEWTON, POINTS = 1e-10, 12, 5000

#: R (n,), ∂R/∂z (n, n), ∂R/∂λ (n,)
System = Callable[[NDArray, float], tuple[NDArray, NDArray, NDArray]]


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A curve of solutions.

    Parameters
    ----------
    z
        Solutions (point, n).
    parameter
        λ (point,).
    ends
        Why it ends: it leaves the range of the parameter, exceeds the largest size, closes, or no next point is found.
    """

    z: NDArray
    parameter: NDArray
    ends: Literal["range", "size", "closed", "lost"]


def at_fixed(system: System, z: NDArray, parameter: float, steps: int = 4 * NEWTON) -> NDArray | None:
    """Solution near z at a fixed parameter, by Newton's method with halved steps; None where it does not converge."""
    residual, J, _ = system(z, parameter)
    for _ in range(steps):
        size = np.abs(residual).max()
        if size <= TOLERANCE:
            return z
        try:
            step = np.linalg.solve(J, residual)
        except np.linalg.LinAlgError:
            return None
        share = 1.0
        while share > 1e-3:
            new, J_new, _ = system(z - share * step, parameter)
            if np.abs(new).max() < size:
                break
            share /= 2
        else:
            return None
        z, residual, J = z - share * step, new, J_new
    return None


def follow(
    system: System, z: NDArray, start: float, way: int, step: float, longest: float, largest: float = np.inf
) -> Curve:
    """Curve of solutions from z at ``start``, at first with the parameter rising (``way`` 1) or falling (−1), in 0 … 1.

    Parameters
    ----------
    system
        In units in which all its unknowns and the parameter are of order one.
    z
        Solution at ``start``.
    start, way
        Parameter where it begins, and its sense there.
    step, longest
        First and longest step along the curve, the latter times the size of the solution where that exceeds 1.
    largest
        Size of a solution (largest unknown) beyond which it is not followed.
    """
    point = np.append(z, start)
    tangent = np.append(np.zeros(len(z)), float(way))
    found, shortest = [point], 1e-7 * step

    def curve(ends: Literal["range", "size", "closed", "lost"]) -> Curve:
        points = np.array(found)
        return Curve(z=points[:, :-1], parameter=points[:, -1], ends=ends)

    while len(found) < POINTS:
        try:
            tangent = _tangent(system, point, tangent)
        except np.linalg.LinAlgError:
            return curve("lost")
        new, steps = _correct(system, point + step * tangent, tangent)
        while new is None or np.linalg.norm(new - point) > 3 * step:
            step /= 2
            if step < shortest:
                return curve("lost")
            new, steps = _correct(system, point + step * tangent, tangent)
        back = np.linalg.norm(found[0] - point) < step and (found[0] - point) @ tangent > 0 and len(found) > 10
        point = new
        found.append(point)
        if not 0 <= point[-1] <= 1:
            return curve("range")
        size = float(np.abs(point[:-1]).max())
        if back or size > largest:
            return curve("closed" if back else "size")
        step = min(step * (1.5 if steps <= 4 else 0.7 if steps > 7 else 1.0), longest * max(1.0, size))
    return curve("lost")


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
