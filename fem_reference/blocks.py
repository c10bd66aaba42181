"""The section of the body in gmsh, divided into teeth, rim and gaps."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from fem_reference.section import Body, Side, on_tooth


@dataclass
class Blocks:
    """Surfaces of the section, built in gmsh's own kernel; lengths in normal modules.

    Parameters
    ----------
    geo
        ``gmsh.model.geo``.
    body
        The body.
    """

    geo: Any
    body: Body
    #: Names and numbers of the curves on the boundary.
    named_curves: list[tuple[str, int]] = field(default_factory=list)
    _points: dict[tuple, int] = field(default_factory=dict)
    _curves: dict[tuple, int] = field(default_factory=dict)

    def build(self) -> None:
        """Make all blocks."""
        if self.body.bore_radius is None:
            self._tooth_alone()
            return
        for d in self.body.offsets:
            self._tooth_on_rim(d)
        first, last = self.body.offsets[0], self.body.offsets[-1]
        for d in range(first if self.body.closed else first - 1, last + 1):
            self._gap(d)
        if self.body.rest == "ring" and not self.body.closed:
            self._ring()

    # -- blocks -------------------------------------------------------------------------------------------------------
    def _tooth_alone(self) -> None:
        gear = self.body.gear
        r_f, form = gear.root_radius, gear.form_radius
        foot = [self._flank_point(0, side, r_f, "foot") for side in Side]
        clamp = self._arc("clamp", 0, foot[0], foot[1], r_f)
        right = self._flank(0, Side.RIGHT, r_f, form, foot[1])
        left = self._flank(0, Side.LEFT, r_f, form, foot[0])
        self._surface([(clamp, "clamp"), *right, self._tip(0), *_reverse(left)])

    def _tooth_on_rim(self, d: int) -> None:
        body = self.body
        r_j, form = body.junction_radius, body.gear.form_radius
        foot = [self._flank_point(d, side, r_j, "junction") for side in Side]
        row = self._curve(("row", self._tooth(d)), lambda: self.geo.addLine(*foot))
        right = self._flank(d, Side.RIGHT, r_j, form, foot[1])
        left = self._flank(d, Side.LEFT, r_j, form, foot[0])
        self._surface([(row, None), *right, self._tip(d), *_reverse(left)])
        bore = [self._bore_point(d, side) for side in Side]
        arc = self._arc("bore", d, bore[0], bore[1], body.bore_radius or 0.0)
        sides = [self._radial(d, side) for side in Side]
        self._surface([(arc, "bore"), (sides[1], None), (-row, None), (-sides[0], None)])

    def _gap(self, d: int) -> None:
        """Block between tooth d and tooth d + 1."""
        body, gear = self.body, self.body.gear
        r_f = gear.root_radius
        top = self._foot(d, Side.RIGHT)
        land = gear.sign * (body.pitch_angle - 2 * float(gear.half_angle(r_f)))
        if land > 1e-9:
            ends = self._flank_point(d, Side.RIGHT, r_f, "root"), self._flank_point(d + 1, Side.LEFT, r_f, "root")
            top.append((self._arc("land", d, *ends, r_f), "root"))
        top += _reverse(self._foot(d + 1, Side.LEFT))
        bore = [self._bore_point(d, Side.RIGHT), self._bore_point(d + 1, Side.LEFT)]
        arc = self._arc("gap", d, bore[0], bore[1], body.bore_radius or 0.0)
        up, down = self._radial(d + 1, Side.LEFT), -self._radial(d, Side.RIGHT)
        self._surface([(arc, "bore"), (up, None), *_reverse(top), (down, None)])

    def _ring(self) -> None:
        """The rest of the gear, without teeth, up to the junction radius; four parts, the middle ones longer."""
        body, angles = self.body, self.body.rest_angles
        bore, r_j = body.bore_radius or 0.0, body.junction_radius
        first, last = body.offsets[0], body.offsets[-1]
        low = [self._point(("rest", i), bore, a) for i, a in enumerate(angles[:-1]) if i]
        high = [self._point(("rest_top", i), r_j, a) for i, a in enumerate(angles[:-1]) if i]
        low = [self._bore_point(last + 1, Side.LEFT), *low, self._bore_point(first - 1, Side.RIGHT)]
        ends = (last + 1, Side.LEFT), (first - 1, Side.RIGHT)
        start, end = (self._flank_point(d, side, r_j, "junction") for d, side in ends)
        high = [start, *high, end]
        lines = [self._radial(*ends[0])]
        lines += [self._curve(("rest", i), lambda ends=(low[i], high[i]): self.geo.addLine(*ends)) for i in (1, 2, 3)]
        lines.append(self._radial(*ends[1]))
        for i in range(4):
            inner = self._arc(f"rest{i}", 0, low[i], low[i + 1], bore)
            outer = self._arc(f"rest_top{i}", 0, high[i], high[i + 1], r_j)
            self._surface([(inner, "bore"), (lines[i + 1], None), (-outer, "rest"), (-lines[i], None)])

    # -- points and curves, each made once ----------------------------------------------------------------------------
    def _tooth(self, d: int) -> int:
        """Number of the tooth, unique also where the whole gear closes."""
        return (d - self.body.offsets[0]) % abs(self.body.gear.teeth) + self.body.offsets[0] if self.body.closed else d

    def _point(self, key: tuple, R: float, theta: float) -> int:
        if key not in self._points:
            R /= self.body.gear.normal_module
            self._points[key] = self.geo.addPoint(R * math.sin(theta), R * math.cos(theta), 0.0)
        return self._points[key]

    def _curve(self, key: tuple, make: Callable[[], int]) -> int:
        if key not in self._curves:
            self._curves[key] = make()
        return self._curves[key]

    def _flank_point(self, d: int, side: Side, R: float, part: str) -> int:
        theta = d * self.body.pitch_angle + side * float(self.body.gear.half_angle(R))
        gear = self.body.gear
        if part == "root" and gear.sign * (self.body.pitch_angle - 2 * float(gear.half_angle(R))) <= 1e-9:
            # fully rounded root: the fillets of neighbouring teeth meet in one point
            return self._point(("meet", self._tooth(d if side > 0 else d - 1)), R, theta)
        return self._point((part, self._tooth(d), side), R, theta)

    def _bore_point(self, d: int, side: Side) -> int:
        body = self.body
        theta = d * body.pitch_angle + side * float(body.gear.half_angle(body.junction_radius))
        return self._point(("bore", self._tooth(d), side), body.bore_radius or 0.0, theta)

    def _tips(self, d: int) -> list[int]:
        return [self._flank_point(d, side, self.body.gear.tip_radius, "tip") for side in (Side.RIGHT, Side.LEFT)]

    def _spline(self, part: str, d: int, side: Side, curve: tuple[NDArray, NDArray], ends: tuple) -> int:
        def make() -> int:
            """Spline through the points of the curve, turned to its tooth."""
            shift = d * self.body.pitch_angle
            inner = [
                self._point((part, self._tooth(d), side, i), float(R), shift + side * float(psi))
                for i, (R, psi) in enumerate(zip(*curve, strict=True))
            ][1:-1]
            return self.geo.addSpline([ends[0], *inner, ends[1]])

        return self._curve((part, self._tooth(d), side), make)

    def _flank(self, d: int, side: Side, low: float, form: float, foot: int) -> list:
        """Fillet from radius ``low`` and involute up to the tip."""
        middle = self._flank_point(d, side, form, "form")
        tip = self._flank_point(d, side, self.body.gear.tip_radius, "tip")
        fillet = self._spline("fillet", d, side, self.body.fillet(low, form), (foot, middle))
        flank = self._spline("flank", d, side, self.body.involute(), (middle, tip))
        return [(fillet, on_tooth(f"{side.label}_fillet", d)), (flank, on_tooth(f"{side.label}_flank", d))]

    def _foot(self, d: int, side: Side) -> list:
        """Lower fillet, from the junction down to the root circle."""
        body = self.body
        R, psi = body.fillet(body.gear.root_radius, body.junction_radius)
        ends = (
            self._flank_point(d, side, body.junction_radius, "junction"),
            self._flank_point(d, side, body.gear.root_radius, "root"),
        )
        tag = self._spline("lower", d, side, (R[::-1], psi[::-1]), ends)
        return [(tag, on_tooth(f"{side.label}_fillet", self._tooth(d)))]

    def _tip(self, d: int) -> tuple[int, str]:
        ends = self._tips(d)
        tag = self._arc("tip", d, ends[0], ends[1], self.body.gear.tip_radius)
        return tag, on_tooth("tip", d)

    def _arc(self, part: str, d: int, start: int, end: int, R: float) -> int:
        make = lambda: self.geo.addCircleArc(start, self._point(("centre",), 0.0, 0.0), end)  # noqa: E731
        return self._curve((part, self._tooth(d), R), make)

    def _radial(self, d: int, side: Side) -> int:
        """Line from the bore to the junction on the fillet."""
        start = self._bore_point(d, side)
        end = self._flank_point(d, side, self.body.junction_radius, "junction")
        return self._curve(("radial", self._tooth(d), side), lambda: self.geo.addLine(start, end))

    def _surface(self, curves: list[tuple[int, str | None]]) -> None:
        self.geo.addPlaneSurface([self.geo.addCurveLoop([tag for tag, _ in curves])])
        self.named_curves += [(name, abs(tag)) for tag, name in curves if name]


def _reverse(curves: list) -> list:
    return [(-tag, name) for tag, name in reversed(curves)]
