"""Random errors of ``manufacturing_errors`` that are not one shape on the flank.

They are numbers of other gap effects that vary, run-out and wobble, pitch errors, centre distance and tooth thickness.
The gap of an error is a sum of modes, each multiplied by an amount in every sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass as plain_dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects, GapEffect
from gearbench.effects.distributions import Distribution
from gearbench.effects.shape import Gears
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.keys import value_at, with_values
from gearbench.schema import STRICT

TwoSided = Literal["uniform_two_sided", "normal_two_sided"]

#: Deviations of a number, divided by the amplitude, at which the change of the gap is computed if it is not linear; at
#: deviation 0 the change is 0.
NODES = np.array([-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0])
#: Relative difference from a straight line up to which a change is linear but for rounding.
STRAIGHT = 1e-9


@dataclass(frozen=True, kw_only=True, config=STRICT)
class VariedKey:
    """A number of another gap effect that varies about its value in the scene.

    Parameters
    ----------
    key
        Key of the number below ``effects``, such as "tip_relief.pinion.amount" or "profile_curve.pinion.polynomial.1"
        (list items count from 0).
    amplitude
        f in the unit of the key.
    distribution
        Distribution over ±f.
    """

    key: Annotated[str, Field(min_length=3, max_length=200)]
    amplitude: Annotated[float, Field(gt=0.0, le=20000.0)]
    distribution: TwoSided = "normal_two_sided"

    def check(self, pair: Pair, effects: Effects) -> None:
        """Check that the key names a number of a gap effect, and that the effect allows both extreme values.

        Raises
        ------
        InputError
            If one of these does not hold.
        """
        self.effect(effects, 0.0)
        for sign, share in (("−", -1.0), ("+", 1.0)):
            try:
                self.effect(effects, share * self.amplitude).check(pair, effects)
            except InputError as error:
                allowed = f"{error.key} {error.allowed}" if error.key else error.allowed
                raise InputError("key", f"{self.key} {sign} {self.amplitude:g}", allowed) from None

    def effect(self, effects: Effects, deviation: float) -> GapEffect:
        """The effect with the number increased by ``deviation``.

        Raises
        ------
        InputError
            If there is no such number, or the effect does not allow its value.
        """
        name, _, path = self.key.partition(".")
        effect = effects.get(name)
        if not isinstance(effect, GapEffect) or not path:
            names = ", ".join(n for n, e in effects.items() if isinstance(e, GapEffect) and n != "manufacturing_errors")
            allowed = f"must be a number of a gap effect of the scene: {names or 'there is none'}"
            raise InputError("key", self.key, allowed)
        value = value_at(effect, path)
        if not isinstance(value, float):
            raise InputError("key", self.key, f"must be a number that is given in effects.{name}")
        return with_values(effect, {path: value + deviation})

    def modes(self, lines: ContactLines, effects: Effects) -> NDArray:
        """Change of the gap [mm]: per unit of the number (…, 1) if linear, otherwise at each of ``NODES`` (…, node)."""
        nominal = self.effect(effects, 0.0).gap(lines)
        changes = np.stack(
            [self.effect(effects, node * self.amplitude).gap(lines) - nominal for node in NODES], axis=-1
        )
        straight = changes[..., -1:] * NODES
        if np.abs(changes - straight).max() <= STRAIGHT * np.abs(changes).max():
            return changes[..., -1:] / self.amplitude
        return changes

    def amounts(self, modes: int, deviation: NDArray) -> NDArray:
        """Amounts (sample, mode) of ``modes`` modes at a ``deviation`` (sample, 1), linear between the nodes."""
        if modes == 1:
            return deviation
        # each mode has the amount 1 at its node, 0 at the others and at 0
        values = np.insert(np.eye(len(NODES)), len(NODES) // 2, 0.0, axis=0)
        nodes = np.insert(NODES, len(NODES) // 2, 0.0)
        return np.stack([np.interp(deviation[:, 0] / self.amplitude, nodes, column) for column in values.T], axis=-1)


@dataclass(frozen=True, kw_only=True, config=STRICT)
class RunOut:
    """Run-out or wobble with random amplitude and phase.

    Parameters
    ----------
    amplitude
        F_r [µm], twice the amplitude of the wave along the line of action.
    distribution
        Distribution in units of F_r.
    gear
        Gears that have the error, drawn independently.
    """

    amplitude: Annotated[float, Field(gt=0.0, le=1000.0)]
    distribution: Distribution = "uniform"
    gear: Gears = "both"


@dataclass(frozen=True, kw_only=True, config=STRICT)
class PitchKind:
    """Random pitch errors: an index deviation for each tooth, within ±f/2, so that no pitch deviates by more than f.

    Parameters
    ----------
    amplitude
        f [µm]; by default the single pitch tolerance of the ISO class.
    distribution
        Distribution over ±f/2.
    gear
        Gears that have the error, drawn independently.
    cost
        Relative cost of a tolerance one class finer.
    """

    amplitude: Annotated[float, Field(ge=0.0, le=1000.0)] | None = None
    distribution: TwoSided = "normal_two_sided"
    gear: Gears = "both"
    cost: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0


@dataclass(frozen=True, kw_only=True, config=STRICT)
class SizeScatter:
    """Centre distance or tooth thickness that varies about the middle of its permissible deviations.

    Parameters
    ----------
    amplitude
        f [µm]; by default half the range of the permissible deviations.
    distribution
        Distribution over ±f.
    """

    amplitude: Annotated[float, Field(gt=0.0, le=5000.0)] | None = None
    distribution: TwoSided = "normal_two_sided"

    def variable(self, name: str, deviations: tuple[float, float]) -> RandomVariable:
        """Random variable of a size with lower and upper ``deviations`` [µm]."""
        lower, upper = deviations
        if self.amplitude is None and upper == lower:
            raise InputError(f"{name}.amplitude", "missing", "is required where the size has no deviations")
        amplitude = (upper - lower) / 2 if self.amplitude is None else self.amplitude
        return RandomVariable(name, amplitude, self.distribution)


@plain_dataclass(frozen=True)
class RandomVariable:
    """A random variable, with the relative cost of a tolerance one class finer."""

    name: str
    amplitude: float
    distribution: Distribution
    cost: float = 1.0


@plain_dataclass(frozen=True)
class Eccentricity:
    """Run-out or wobble of a gear, with amplitude F_r [µm] and random phase [°]; ``over_face`` as of a ``Wave``."""

    name: str
    gear: int
    amplitude: float
    distribution: Distribution
    over_face: Literal["even", "tilting"]

    @property
    def variables(self) -> tuple[RandomVariable, RandomVariable]:
        """Random variables of amplitude and phase."""
        label = f"{self.name}_{GEARS[self.gear]}"
        # no tolerance narrows the phase, hence the infinite cost
        phase = RandomVariable(f"{label}_phase", 180.0, "uniform_two_sided", cost=math.inf)
        return RandomVariable(label, self.amplitude, self.distribution), phase

    def modes(self, lines: ContactLines) -> NDArray:
        """Gap of F_r = 1 µm at the phases 0° and 90°, (position, pair, segment, 2) [mm]."""
        from gearbench.effects.waviness import Wave, Waviness

        wave = Waviness(**{GEARS[self.gear]: (Wave(order=1, amplitude=1.0, over_face=self.over_face),)})
        # the modes hold for the amplitude 1 µm; that of the wave of an eccentricity is half of F_r
        return 0.5 * wave.turning(lines, np.zeros(1, dtype=int)).modes

    @staticmethod
    def amounts(values: NDArray) -> NDArray:
        """Amounts of both modes (sample, 2) from ``values`` of F_r and phase (sample, 2)."""
        angle = np.radians(values[:, 1])
        return values[:, :1] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
