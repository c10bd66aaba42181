"""Temperatures of gears and housing, and thermal strain."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.schema import STRICT

#: Temperature at which sizes hold, ISO 1 [°C].
REFERENCE = 20.0

Temperature = Annotated[float, Field(ge=-100.0, le=500.0)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Temperatures:
    """Temperatures in operation (G16); the sizes of the scene are those at 20 °C (ISO 1).

    The expansion of the gears is ``material.thermal_expansion``.

    Parameters
    ----------
    pinion, wheel, housing
        Temperatures [°C].
    housing_expansion
        Linear thermal expansion of the housing [10⁻⁶/K]: steel 11.5, cast iron 10.5, aluminium 23.
    """

    pinion: Temperature = REFERENCE
    wheel: Temperature = REFERENCE
    housing: Temperature = REFERENCE
    housing_expansion: Annotated[float, Field(ge=0.0, le=300.0)] = 11.5


def strain(temperature: float, expansion: float) -> float:
    """Free thermal strain [–] at a temperature [°C] with a linear thermal ``expansion`` [10⁻⁶/K]."""
    return 1e-6 * expansion * (temperature - REFERENCE)
