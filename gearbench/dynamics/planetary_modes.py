"""Natural frequencies and modes of a planetary set: rigid members on springs in the plane, in the carrier's frame.

Motions of a member are x, y and u = rθ on its base circle, of a planet ζ outwards, η ahead, and u (Lin and Parker,
Analytical characterization of the unique properties of planetary gear free vibration, J. Vib. Acoust. 121, 1999).
Gyroscopic terms of a carrier that turns fast are left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError

#: Share of a mode's motion below which a member is at rest.
_AT_REST = 1e-6
#: Kinds of modes: all planets alike and central members turn; central members move across; planets alone; others.
ROTATIONAL, TRANSLATIONAL, PLANET, MIXED = "rotational", "translational", "planet", "mixed"


@dataclass(frozen=True, kw_only=True)
class RigidMember:
    """A member of a set.

    Parameters
    ----------
    mass, inertia
        m, and I/r² on the base circle, of the carrier on the circle of the pins [kg].
    support, torsion
        Stiffness of its bearing across the axis, of a planet that of its pin, and of what holds it from turning, on the
        same circle [N/m].
    """

    mass: float
    inertia: float
    support: float = 0.0
    torsion: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "inertia"):
            if not getattr(self, name) > 0:
                raise InputError(name, getattr(self, name), "must be greater than 0")


@dataclass(frozen=True, kw_only=True)
class PlanetaryModes:
    """Modes by ascending frequency.

    Parameters
    ----------
    frequency
        (mode,) [Hz].
    shape
        Motions of carrier, ring, sun, and the planets, (mode, member, 3), of unit modal mass [kg^-½].
    kind
        "rotational", "translational", "planet" or "mixed", of each mode.
    """

    frequency: NDArray
    shape: NDArray
    kind: tuple[str, ...]

    def of(self, kind: str) -> NDArray:
        """Frequencies of the modes of a kind [Hz]."""
        return self.frequency[[each == kind for each in self.kind]]


def planetary_modes(
    *,
    sun: RigidMember,
    ring: RigidMember,
    carrier: RigidMember,
    planet: RigidMember,
    angles: Sequence[float],
    mesh_stiffness: tuple[float, float],
    pressure_angles: tuple[float, float],
) -> PlanetaryModes:
    """Modes of a set with equal planets at the ``angles`` [rad].

    Parameters
    ----------
    sun, ring, carrier, planet
        Members.
    angles
        Places of the planets.
    mesh_stiffness, pressure_angles
        Mean stiffness [N/m] and working pressure angle [rad] of the meshes with the sun and with the ring.

    Raises
    ------
    InputError
        If a mass or a stiffness is not positive.
    """
    if min(mesh_stiffness) <= 0 or planet.support <= 0:
        raise InputError("mesh_stiffness", [*mesh_stiffness, planet.support], "meshes and pins must be stiff: above 0")
    central = (carrier, ring, sun)
    members = (*central, *(planet for _ in angles))
    mass = np.concatenate([[each.mass, each.mass, each.inertia] for each in members])
    K = np.diag(
        np.concatenate([[each.support, each.support, each.torsion] for each in central] + [[0.0] * 3] * len(angles))
    )
    for number, angle in enumerate(angles):
        for stiffness, row in zip(
            (planet.support, planet.support, *mesh_stiffness), _springs(angle, *pressure_angles), strict=True
        ):
            a = np.zeros(len(mass))
            a[:9], a[9 + 3 * number : 12 + 3 * number] = row[:9], row[9:]
            K += stiffness * np.outer(a, a)
    root = 1 / np.sqrt(mass)
    values, vectors = np.linalg.eigh(root[:, None] * K * root)
    rounding = 1e-12 * values[-1]
    shape = (root[:, None] * vectors).T.reshape(len(mass), len(members), 3)
    share = (vectors.T.reshape(shape.shape)[:, :3] ** 2).sum(axis=1)
    return PlanetaryModes(
        frequency=np.sqrt(np.where(values > rounding, values, 0.0)) / (2 * math.pi),
        shape=shape,
        kind=tuple(_kind(across=x + y, turning=u) for x, y, u in share),
    )


def _springs(angle: float, of_sun: float, of_ring: float) -> NDArray:
    """Stretch of a pin outwards and ahead, of meshes with sun and ring, by carrier, ring, sun and planet, (4, 12)."""
    c, s = math.cos(angle), math.sin(angle)
    rows = np.zeros((4, 4, 3))
    rows[0, 0], rows[0, 3] = (c, s, 0.0), (-1.0, 0.0, 0.0)
    rows[1, 0], rows[1, 3] = (-s, c, 1.0), (0.0, -1.0, 0.0)
    rows[2, 2] = -math.sin(angle - of_sun), math.cos(angle - of_sun), 1.0
    rows[2, 3] = -math.sin(of_sun), -math.cos(of_sun), 1.0
    rows[3, 1] = -math.sin(angle + of_ring), math.cos(angle + of_ring), 1.0
    rows[3, 3] = math.sin(of_ring), -math.cos(of_ring), -1.0
    return rows.reshape(4, 12)


def _kind(*, across: float, turning: float) -> str:
    if max(across, turning) < _AT_REST:
        return PLANET
    if min(across, turning) >= _AT_REST:
        return MIXED
    return ROTATIONAL if turning > across else TRANSLATIONAL
