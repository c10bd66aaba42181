"""Touching curves of two flanks in the transverse plane: all ways in which two parts of the profiles can just touch.

The rotation of a gear counts as a length v along the line of action: v_1 = u_1 from T1, v_2 = T1T2 − u_2 from T2. The
point of roll length ℓ then lies on the line of action at v = ℓ. Seen from either gear the mate is on the right, so both
gears are treated alike. If the flanks just touch (T3 of docs/theory.md),

    separation g = v_1 + v_2 − T1T2,      nominal coordinate u = (v_1 + T1T2 − v_2)/2,

where g is the relative rotation, shared equally by both gears, from the position where unmodified flanks would touch
at u. The derivative along a touching curve follows from the lever arms w r_b of the common normal:
dg/du = 2 (w_2 − w_1)/(w_1 + w_2) (T4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.profile import Piece, Profile

#: Lengths relative to ``Plane.size``: distance from the end of a piece that is rounding, and distance that counts as
#: zero.
_AT_END, _ZERO = 1e-9, 1e-12
#: Largest number of Newton steps.
_STEPS = 40
#: Fraction of a rounding that can touch, and number of nodes on it.
_USED, _ARC_NODES = 0.3, 400


@dataclass(frozen=True, kw_only=True, eq=False)
class TouchingCurve:
    """One kind of contact as a function of the nominal coordinate; arrays (node,), u ascending.

    Parameters
    ----------
    u, gap, slope
        Nominal coordinate [mm], separation along the line of action [mm] and its derivative.
    rolls
        Roll lengths of the touching point on pinion and wheel [mm], (2, node).
    levers
        Lever arms of the common normal about pinion and wheel, divided by their base radii, (2, node).
    radii
        Radii of curvature of both profiles there [mm], (2, node).
    tilt
        Angle between the common normal and the normal of the flank at its corner [rad], (node,).
    node
        Independent variable: roll length or rotation of the leading gear, (node,) [mm].
    edge
        0 or 1 if a corner of the pinion's or the wheel's profile touches, −1 if two smooth flanks touch.
    """

    u: NDArray
    gap: NDArray
    slope: NDArray
    rolls: NDArray
    levers: NDArray
    radii: NDArray
    tilt: NDArray
    node: NDArray
    edge: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Plane:
    """Both profiles in the transverse plane.

    Parameters
    ----------
    profiles
        Profiles of pinion and wheel.
    tangent_length
        T1 T2 [mm].
    """

    profiles: tuple[Profile, Profile]
    tangent_length: float

    @property
    def size(self) -> float:
        """Reference length of tolerances: T1T2, or the longest roll length of an internal pair [mm]."""
        return self.tangent_length if self.tangent_length > 0 else max(-p.low for p in self.profiles)

    @property
    def _wheel_centre(self) -> tuple[float, float]:
        """Position of O2 relative to O1 [mm]; x along the line of action."""
        return self.tangent_length, self.profiles[0].base_radius + self.profiles[1].base_radius

    def corner_on_piece(self, k: int, roll: float, own: Piece, mate: Piece, v: NDArray) -> TouchingCurve | None:
        """Contact of a corner of gear k (0 or 1), at the roll length ``roll``, with a piece of the mate.

        ``own`` is the piece of gear k that ends in the corner, v are its rotations (node,) [mm]. None if they never
        touch.
        """
        r_b, r_m = own.base_radius, mate.base_radius
        (x, y), sign = self._wheel_centre, math.copysign(1.0, r_m)
        corner = np.array(roll)
        length = roll - float(own.deviation(corner)[0])
        # the flank at the corner: angle of its normal, and radius of curvature
        eps_own, rho, *_ = own.normal(corner)
        phi = (roll - v) / r_b
        cos, sin = np.cos(phi), np.sin(phi)
        # corner relative to the centre of its gear, then to the centre of the mate
        own_x, own_y = length * cos - r_b * sin, length * sin + r_b * cos
        w_x, w_y = own_x - x, own_y - y
        squared = w_x**2 + w_y**2 - r_m**2
        reached = (squared > 0) & (sign * w_y < 0)
        if not reached.any():
            return None
        # length of the tangent from the corner to the mate's base circle: the roll length of the mate's point without
        # deviations
        tangent = sign * np.sqrt(np.where(reached, squared, 1.0))
        # deviations move the mate's point only a little: most pieces are excluded at once
        least, most = tangent[reached].min(), tangent[reached].max()
        far = 1e-2 * self.size + 4 * float(np.abs(mate.deviation(np.array([mate.low, mate.high]))[0]).max())
        if least > mate.high + far or most < mate.low - far:
            return None
        other = mate.at_tangent_length(tangent)
        rounding = _AT_END * self.size
        keep = reached & (other >= mate.low - rounding) & (other <= mate.high + rounding)
        chi = np.arctan2(-r_m, -tangent) - np.arctan2(w_y, w_x)
        chi = (chi + math.pi) % (2 * math.pi) - math.pi
        v_mate = other + r_m * chi
        eps, radius, _, d_mate, _, _ = mate.normal(other)
        theta = eps - chi
        lever = own_y * np.cos(theta) - own_x * np.sin(theta)
        levers, radii = (lever / r_b, d_mate / r_m), (np.broadcast_to(rho, v.shape), radius)
        tilt = np.abs(theta - phi - eps_own)
        both = np.array([(v, v_mate), (np.full_like(v, roll), other), levers, radii])
        return self._curve(k, v, both, keep, tilt=tilt, edge=k)

    def meeting(self, k: int, roll: float, own: Piece, other: float, mate: Piece) -> list[float]:
        """Rotations v of gear k at which its point at roll length ``roll`` meets the mate's point at ``other``."""
        x, y = self._wheel_centre
        length, far = (r - float(p.deviation(np.array(r))[0]) for r, p in ((roll, own), (other, mate)))
        radius, distance = math.hypot(length, own.base_radius), math.hypot(x, y)
        cosine = (radius**2 + distance**2 - far**2 - mate.base_radius**2) / (2 * radius * distance)
        if abs(cosine) > 1:
            return []
        turn = math.atan2(y, x) - math.atan2(own.base_radius, length)
        angles = (turn + sign * math.acos(cosine) for sign in (-1, 1))
        return [roll - own.base_radius * math.remainder(angle, 2 * math.pi) for angle in angles]

    def common_nodes(self, own: Piece, mate: Piece, step: float) -> NDArray:
        """Roll lengths of ``own`` at which two smooth pieces may touch, at most ``step`` apart, including the ends."""
        roll = np.linspace(own.low, own.high, max(5, math.ceil((own.high - own.low) / step) + 1))
        if own.is_rounding:  # the normal of a rounding turns fast
            roll = np.linspace(own.low, own.low + _USED * (own.high - own.low), _ARC_NODES)
        # the mate's point moves almost linearly: a few nodes locate it on the piece
        few = roll if own.is_rounding else roll[np.unique(np.append(np.arange(0, len(roll), 16), len(roll) - 1))]
        partner = self._partner(own, mate, few)
        low, high = np.minimum(partner[:-1], partner[1:]), np.maximum(partner[:-1], partner[1:])
        near = np.flatnonzero((low <= mate.high) & (high >= mate.low))
        if not near.size:
            return near.astype(float)
        nodes = [roll[(roll >= few[near[0]]) & (roll <= few[near[-1] + 1])]]
        for end in (mate.low, mate.high):
            excess = partner - end
            for i in np.flatnonzero(excess[:-1] * excess[1:] < 0):
                (a, b), (fa, fb) = few[i : i + 2], excess[i : i + 2]
                for _ in range(12):  # secant method: the function is nearly linear
                    if fa == fb or abs(b - a) < _ZERO * self.size:
                        break
                    a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
                    fb = float(self._partner(own, mate, np.array([b]))[0]) - end
                nodes.append(np.array([b]))
        return np.unique(np.concatenate(nodes))

    def _partner(self, own: Piece, mate: Piece, roll: NDArray) -> NDArray:
        """Roll length of the point of ``mate`` that touches ``own`` at ``roll``, i.e. shares its normal."""
        x, y = self._wheel_centre
        other = self.tangent_length - roll
        if own.is_involute and mate.is_involute:
            return other
        _, _, c1, d1, _, _ = own.normal(roll)
        # Pythagoras: the distance of the centres along the common normal follows from that across it
        for _ in range(_STEPS):
            _, _, c2, d2, dc2, dd2 = mate.normal(other)
            across = d1 + d2
            left = math.copysign(1.0, x) * np.sqrt(np.maximum(x**2 + y**2 - across**2, 1e-6 * x**2))
            step = (c1 + c2 - left) / (dc2 + across * dd2 / left)
            # limited to a twentieth of the reference length, since steps from far away may go astray
            step = np.clip(np.where(np.isfinite(step), step, 0.0), -0.05 * self.size, 0.05 * self.size)
            other = other - step
            if not np.any(np.abs(step) > 4e-16 * self.size):
                break
        return other

    def piece_on_piece(self, k: int, own: Piece, mate: Piece, roll: NDArray) -> TouchingCurve | None:
        """Contact of the smooth piece ``own`` of gear k, at its roll lengths ``roll``, with the piece ``mate``.

        A rounding must be ``own``. Its normal turns fast, so the mate's point follows safely from a point of the
        rounding, but not vice versa.
        """
        T = self.tangent_length
        if own.is_involute and mate.is_involute:
            rounding = _ZERO * self.size
            keep = (T - roll >= mate.low - rounding) & (T - roll <= mate.high + rounding)
            rolls = np.stack([roll, T - roll])
            return self._curve(k, roll, np.stack([rolls, rolls, np.ones_like(rolls), rolls]), keep)
        x, y = self._wheel_centre
        eps1, rho1, c1, d1, _, _ = own.normal(roll)
        other = self._partner(own, mate, roll)
        eps2, rho2, c2, d2, _, _ = mate.normal(other)
        rounding = _AT_END * self.size
        keep = (np.abs(np.hypot(c1 + c2, d1 + d2) - math.hypot(x, y)) < _ZERO * self.size) & (
            (other >= mate.low - rounding) & (other <= mate.high + rounding)
        )
        theta = math.atan2(y, x) - np.arctan2(d1 + d2, c1 + c2)
        v = roll - own.base_radius * (theta - eps1), other - mate.base_radius * (theta - eps2)
        levers = d1 / own.base_radius, d2 / mate.base_radius
        return self._curve(k, roll, np.array([v, (roll, other), levers, (rho1, rho2)]), keep)

    def _curve(
        self,
        k: int,
        node: NDArray,
        both: NDArray,
        keep: NDArray,
        *,
        tilt: NDArray | None = None,
        edge: int = -1,
    ) -> TouchingCurve | None:
        """Curve from rotations, roll lengths, levers and radii of gear k and its mate, ``both`` (4, 2, node).

        Only its longest part with ascending u is kept.
        """
        v, rolls, levers, radii = both if k == 0 else both[:, ::-1]
        u = (v[0] + self.tangent_length - v[1]) / 2
        gap = v[0] + v[1] - self.tangent_length
        slope = 2 * (levers[1] - levers[0]) / (levers[0] + levers[1])
        angle = np.zeros_like(u) if tilt is None else tilt
        if k == 1:  # u decreases with the rotation of the wheel
            u, gap, slope, angle, keep, node = (x[::-1] for x in (u, gap, slope, angle, keep, node))
            rolls, levers, radii = rolls[:, ::-1], levers[:, ::-1], radii[:, ::-1]
        # where u decreases, the separation is a maximum, not a minimum
        good = keep & np.isfinite(gap) & (np.diff(u, append=np.inf) > -_ZERO * self.size)
        runs = np.split(np.arange(len(u)), np.flatnonzero(np.diff(good)) + 1)
        rising = max((run for run in runs if good[run[0]]), key=len, default=runs[0][:0])
        rising = rising[np.diff(u[rising], prepend=-np.inf) > _ZERO * self.size]
        if rising.size < 2:
            return None
        return TouchingCurve(
            u=u[rising],
            gap=gap[rising],
            slope=slope[rising],
            rolls=rolls[:, rising],
            levers=levers[:, rising],
            radii=radii[:, rising],
            tilt=angle[rising],
            node=node[rising],
            edge=edge,
        )
