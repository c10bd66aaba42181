"""Linear elastic, isotropic material."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Material:
    """Linear elastic, isotropic material; steel by default.

    Parameters
    ----------
    youngs_modulus
        Young's modulus E [GPa].
    poisson_ratio
        Poisson's ratio ν [–].
    density
        Density [g/cm³].
    thermal_expansion
        Linear thermal expansion [10⁻⁶/K].
    """

    youngs_modulus: Annotated[float, Field(ge=0.01, le=5000.0)] = 210.0
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.5)] = 0.3
    density: Annotated[float, Field(gt=0.0, le=25.0)] = 7.85
    thermal_expansion: Annotated[float, Field(ge=0.0, le=300.0)] = 11.5

    @property
    def E(self) -> float:
        """Young's modulus [N/mm²]."""
        return 1e3 * self.youngs_modulus

    @property
    def nu(self) -> float:
        """Poisson's ratio ν [–]."""
        return self.poisson_ratio

    @property
    def G(self) -> float:
        """Shear modulus E / 2(1+ν) [N/mm²]."""
        return self.E / (2 * (1 + self.nu))

    @property
    def plane_strain_modulus(self) -> float:
        """E / (1−ν²) [N/mm²], the modulus of contact along a line."""
        return self.E / (1 - self.nu**2)


def lame(E: float, nu: float) -> tuple[float, float]:
    """Lamé's constants λ, μ [N/mm²] from Young's modulus [N/mm²] and Poisson's ratio."""
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
