"""The involute function and its inverse."""

from __future__ import annotations

import math


def inv(angle: float) -> float:
    """Involute function inv α = tan α − α, α in rad."""
    return math.tan(angle) - angle


def inverse_involute(value: float) -> float:
    """Angle α [rad] with inv α = ``value`` ≥ 0, to the relative precision ε/α² at which tan α − α can be evaluated.

    Newton's method on the convex function tan α − α, started above the root so that it falls monotonically.

    Raises
    ------
    ValueError
        If ``value`` is negative.
    """
    if value < 0:
        raise ValueError(f"inv α = {value}: must not be negative")
    if value == 0:
        return 0.0
    # inv α > α³/3 and inv α > tan α − π/2: both bounds lie above the root
    alpha = min((3 * value) ** (1 / 3), math.atan(value + math.pi / 2))
    for _ in range(50):
        step = (inv(alpha) - value) / math.tan(alpha) ** 2
        alpha -= step
        if abs(step) <= 1e-16 * alpha:
            break
    return alpha
