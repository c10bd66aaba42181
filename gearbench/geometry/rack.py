"""The generating rack (ISO 53 with free proportions): straight flanks, rounded tip."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearbench.errors import InputError

#: ISO 53 tip rounding of the generating rack [modules], if it fits.
STANDARD_FILLET_RADIUS = 0.38


def full_fillet_radius(pressure_angle: float, dedendum: float, protuberance: float = 0.0) -> float:
    """Largest tip rounding ρ* that fits the rack: the fully rounded tip [modules].

    ``pressure_angle`` α_n in rad, ``dedendum`` h_f* and ``protuberance`` s_pr in modules. May be negative for a pointed
    rack tip.
    """
    flat = math.pi / 4 - dedendum * math.tan(pressure_angle) + protuberance / math.cos(pressure_angle)
    return flat * math.cos(pressure_angle) / (1 - math.sin(pressure_angle))


@dataclass(frozen=True, kw_only=True)
class Rack:
    """Generating rack in its normal section, all lengths in mm.

    Parameters
    ----------
    module, alpha
        Normal module [mm] and normal pressure angle [rad].
    dedendum
        Depth h_f of the rack tip below the datum line [mm].
    fillet
        Radius ρ of the rack tip [mm].
    protuberance
        s_pr, protrusion of the rounding beyond the line of the straight flank [mm].

    Raises
    ------
    InputError
        If the tip of the rack is pointed or its rounding does not fit.
    """

    module: float
    alpha: float
    dedendum: float
    fillet: float
    protuberance: float = 0.0

    def __post_init__(self) -> None:
        s_pr = self.protuberance / self.module
        limit = self.module * full_fillet_radius(self.alpha, self.dedendum / self.module, s_pr)
        if limit < 0:
            deepest = (math.pi / 4 + s_pr / math.cos(self.alpha)) / math.tan(self.alpha)
            raise InputError("dedendum", self.dedendum / self.module, f"must be below {deepest:.4g} (pointed rack tip)")
        if self.fillet > limit + 1e-12 * self.module:
            radius, most = self.fillet / self.module, limit / self.module
            raise InputError("fillet_radius", radius, f"must be at most {most:.4g} (fully rounded rack tip)")

    @property
    def corner(self) -> tuple[float, float]:
        """Centre of the tip rounding: distance from the rack tooth's centre line, depth below the datum line [mm]."""
        m, a, h, rho, s_pr = self.module, self.alpha, self.dedendum, self.fillet, self.protuberance
        xi = math.pi * m / 4 - h * math.tan(a) - (rho * (1 - math.sin(a)) - s_pr) / math.cos(a)
        return max(xi, 0.0), h - rho

    @property
    def flank_depth(self) -> float:
        """Depth below the datum line at which the straight flank ends and the rounding starts [mm]."""
        return self.dedendum - self.fillet * (1 - math.sin(self.alpha))
