"""Table ``[planetary.dynamics]``: masses and torsional supports of the members, for the response over speed."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass as table

from gearbench.errors import InputError
from gearbench.schema import STRICT

Positive = Annotated[float, Field(gt=0.0, le=1e12)]


@table(frozen=True, kw_only=True, config=STRICT)
class RigidMember:
    """A member of a set; by default its mass and inertia are those of a steel disc or ring.

    Parameters
    ----------
    mass
        Mass [kg].
    inertia
        Inertia about the axis with everything that turns with it [kg·m²]; for the carrier without the planets, for a
        stepped planet with both gears.
    torsional_stiffness
        Stiffness of the shaft between the member and the drive, load or housing [N·m/rad]. By default a held
        member cannot turn, and other members turn freely under a constant torque.
    """

    mass: Positive | None = None
    inertia: Positive | None = None
    torsional_stiffness: Positive | None = None


@table(frozen=True, kw_only=True, config=STRICT)
class PlanetaryDynamics:
    """Masses and damping of a set, for ``response``.

    Parameters
    ----------
    damping_ratio
        Damping ratio of every mode.
    sun, planet, ring, carrier
        Members. By default the carrier is a steel disc up to the pins, half as thick as the gears.
    """

    damping_ratio: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.05
    sun: RigidMember = RigidMember()
    planet: RigidMember = RigidMember()
    ring: RigidMember = RigidMember()
    carrier: RigidMember = RigidMember()

    def __post_init__(self) -> None:
        if (given := self.planet.torsional_stiffness) is not None:
            raise InputError("planet.torsional_stiffness", given, "is for sun, ring and carrier: planets turn freely")
