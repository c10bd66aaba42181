from __future__ import annotations

import math

import numpy as np
import pytest

from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Member, Pair

STEEL = Material()


@pytest.fixture(scope="session")
def steel() -> Material:
    return STEEL


@pytest.fixture(scope="session")
def case1() -> Pair:
    pinion, wheel = Member(teeth=33, addendum=0.99), Member(teeth=75, addendum=0.99)
    return Pair(normal_module=12.0, face_width=90.0, centre_distance=650.0, pinion=pinion, wheel=wheel)


@pytest.fixture(scope="session")
def case2() -> Pair:
    return Pair(
        normal_module=2.676,
        helix_angle=25.648,
        face_width=20.0,
        centre_distance=128.0,
        pinion=Member(teeth=17, addendum=1.15, dedendum=1.65),
        wheel=Member(teeth=71, addendum=1.13, dedendum=1.62),
    )


@pytest.fixture(scope="session")
def spur() -> Gear:
    """Standard spur gear, m = 1, z = 17, narrow: cheap to solve."""
    return gear(17)


def gear(teeth: int, width: float = 4.0, helix: float = 0.0, shift: float = 0.0, fillet: float = 0.38) -> Gear:
    return Gear(
        teeth=teeth,
        normal_module=1.0,
        pressure_angle=20.0,
        helix_angle=helix,
        face_width=width,
        profile_shift=shift,
        addendum=1.0,
        dedendum=1.25,
        fillet_radius=fillet,
    )


@pytest.fixture(scope="session")
def law():
    """Compression of one steel tooth per unit line load [mm²/N] at depth t and half-width a: Weber & Banaschek 1953."""

    def compression(t: np.ndarray | float, half_width: float) -> np.ndarray:
        E, nu = STEEL.E, STEEL.nu
        return 2 * (1 - nu**2) / (math.pi * E) * (np.log(2 * np.asarray(t) / half_width) - nu / (2 * (1 - nu)))

    return compression
