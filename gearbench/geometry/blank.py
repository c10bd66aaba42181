"""Blanks: how the teeth are cut below the involute, and where the body is held.

Everything else about a gear follows from its involute. "rack" is an external gear cut by a rack, "pinion_cutter" an
internal gear cut by a pinion-type cutter. Other blanks are registered by name, or come from other packages by entry
points ``gearbench.blanks``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.errors import InputError, one_of
from gearbench.geometry.cutter import PinionCut
from gearbench.geometry.fillet import Fillet
from gearbench.geometry.rack import Rack

if TYPE_CHECKING:
    from gearbench.geometry.gear import Gear

#: Largest bore over root circle.
LARGEST_BORE = 0.999


class RootCurve(Protocol):
    """Right flank of a tooth below the involute, with a parameter φ from 0 (root circle) to ``phi_end``.

    R, √|R² − r_f²| and the half tooth-thickness angle ψ are smooth in φ, and R grows with it.
    """

    @property
    def phi_end(self) -> float:
        """Greatest φ [rad]."""
        ...

    def radius(self, phi: ArrayLike) -> NDArray:
        """R [mm]."""
        ...

    def half_angle(self, phi: ArrayLike) -> NDArray:
        """ψ [rad]."""
        ...

    def parameter(self, radius: ArrayLike) -> NDArray:
        """φ at a radius R [mm]; clipped beyond the ends."""
        ...

    def along(self, phi: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """R − r_f [mm], dR/dφ, ψ and dψ/dφ."""
        ...


class Blank(Protocol):
    """Protocol for the differences between external, internal and other gears."""

    def root_radius(self, gear: Gear) -> float:
        """Radius r_f of the root circle [mm]."""
        ...

    def root_curve(self, gear: Gear) -> RootCurve:
        """The curve from the root circle to the involute; it may continue beyond.

        Raises
        ------
        InputError
            If the cutter leaves no tooth.
        """
        ...

    def junction(self, gear: Gear) -> float:
        """Parameter φ of the root curve where the involute begins."""
        ...

    def is_undercut(self, gear: Gear) -> bool:
        """Whether the cutter removes part of the involute."""
        ...

    def support(self, gear: Gear, diameter: float) -> float:
        """Radius at which a body with this bore or outer diameter is held [mm].

        Raises
        ------
        InputError
            If no body is left.
        """
        ...


@dataclass(frozen=True)
class RackCut:
    """An external gear that a rack generates, its body held at the bore."""

    def root_radius(self, gear: Gear) -> float:
        """r_f = r − m_n (h_f* − x) [mm]."""
        return gear.pitch_radius - gear.normal_module * (gear.dedendum - gear.profile_shift)

    def root_curve(self, gear: Gear) -> Fillet:
        """The trochoid of the rack's rounded tip."""
        shift, r = gear.profile_shift * gear.normal_module, gear.pitch_radius
        curve = Fillet(rack=_rack(gear), teeth=gear.teeth, pitch_radius=r, shift=shift, beta=gear.beta)
        if not curve.is_monotone():
            allowed = "must differ from the dedendum where the rack tip is sharp (no root fillet)"
            raise InputError("profile_shift", gear.profile_shift, allowed)
        return curve

    def is_undercut(self, gear: Gear) -> bool:
        """Whether the rack tip cuts away part of the involute (G7: its flank ends beyond the interference point)."""
        eta = gear.normal_module * gear.profile_shift - _rack(gear).flank_depth
        return eta < -gear.pitch_radius * math.sin(gear.alpha_t) ** 2

    def junction(self, gear: Gear) -> float:
        """Point where the rack's straight flank takes over, or where an undercut meets the involute."""
        end, undercut, curve = math.pi / 2 - gear.alpha_n, self.is_undercut(gear), gear.fillet
        if not (undercut or gear.protuberance):
            return end
        from scipy.optimize import root_scalar

        def excess(p: ArrayLike) -> NDArray:
            return curve.half_angle(p) - gear.involute_half_angle(curve.radius(p))

        low = float(curve.parameter(max(gear.base_radius, gear.root_radius)))
        if gear.protuberance:
            # outwards the fillet lies outside, then inside, then again outside the flank
            grid = np.linspace(low, curve.phi_end, 513)
            inside = np.flatnonzero(excess(grid) < 0)
            if not inside.size:
                return low if undercut else end
            if inside[-1] == len(grid) - 1:
                allowed = "over the grinding stock: must be smaller, or the fillet cuts the flank away"
                raise InputError("protuberance", gear.protuberance, allowed)
            low, end = grid[inside[-1]], grid[inside[-1] + 1]
        elif excess(low) >= 0:  # undercut by rounding only: the junction is the base circle itself
            return low
        return float(root_scalar(excess, bracket=(low, end), method="brentq", xtol=1e-15).root)

    def support(self, gear: Gear, diameter: float) -> float:
        """Radius of the bore [mm]."""
        most = LARGEST_BORE * 2 * gear.root_radius
        if diameter > most:
            raise InputError("bore_diameter", diameter, f"must be at most {most:.6g} (root circle)")
        return diameter / 2


def _rack(gear: Gear) -> Rack:
    m = gear.normal_module
    h_f, rho, s_pr = gear.dedendum * m, gear.fillet_radius * m, gear.protuberance
    return Rack(module=m, alpha=gear.alpha_n, dedendum=h_f, fillet=rho, protuberance=s_pr)


#: Default blanks of external and internal gears.
RACK, CUTTER = "rack", "pinion_cutter"
_KNOWN: dict[str, Blank] = {RACK: RackCut(), CUTTER: PinionCut()}


def register(name: str, blank: Blank) -> None:
    """Register a blank by its name.

    Raises
    ------
    InputError
        If the name is taken.
    """
    if _KNOWN.setdefault(name, blank) != blank:
        raise InputError("blank", name, "is the name of another blank")


@cache
def _installed() -> None:
    for entry in entry_points(group="gearbench.blanks"):
        register(entry.name, entry.load())


def blank_of(name: str) -> Blank:
    """The blank of that name.

    Raises
    ------
    InputError
        If it does not exist.
    """
    if name not in _KNOWN:
        _installed()
    if name not in _KNOWN:
        raise InputError("blank", name, one_of(name, _KNOWN))
    return _KNOWN[name]
