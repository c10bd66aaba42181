from __future__ import annotations

import math

import numpy as np
import pytest

from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material
from tests.support.gears import standard_gear

STEEL = Material()


@pytest.fixture(scope="session")
def steel() -> Material:
    return STEEL


@pytest.fixture(scope="session")
def spur() -> Gear:
    """Standard spur gear, m = 1, z = 17, narrow: cheap to solve."""
    return standard_gear()


@pytest.fixture(scope="session")
def law():
    """Compression of one steel tooth per unit line load [mm²/N] at depth t and half-width a: Weber & Banaschek 1953."""

    def compression(t: np.ndarray | float, half_width: float) -> np.ndarray:
        E, nu = STEEL.E, STEEL.nu
        return 2 * (1 - nu**2) / (math.pi * E) * (np.log(2 * np.asarray(t) / half_width) - nu / (2 * (1 - nu)))

    return compression
