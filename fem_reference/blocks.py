"""The section of the body in gmsh: blocks for structured hexahedra, or one outline for tetrahedra."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

from numpy.typing import NDArray

from fem_reference.section import Body, Side, on_tooth


@dataclass(frozen=True, kw_only=True)
class Cells:
    """Number of cells along the edges of the blocks.

    Parameters
    ----------
    thickness
        Across the tooth.
    flank
        Along the involute, from form circle to tip circle.
    fillet
        Along the fillet: all of it for a tooth alone, its part above the junction on a rim.
    foot
        Along the part of the fillet below the junction (rim models).
    land
        Along the root circle between two fillets, if any (rim models).
    rim
        From the root to the bore (rim models).
    rest
        Along the ring that closes the gear: its parts next to the sector, and the two others.
    width
        Across the face width.
    """

    thickness: int
    flank: int
    fillet: int
    width: int
    foot: int = 1
    land: int = 1
    rim: int = 1
    rest: tuple[int, int] = (1, 2)

    def of_tooth(self, d: int) -> Cells:
        """Cells of tooth d; the neighbours of the loaded tooth are coarser."""
        if d == 0:
            return self
        halved = {key: max(1, (getattr(self, key) + 1) // 2) for key in ("thickness", "flank", "fillet")}
        return replace(self, **halved)


@dataclass
class Blocks:
    """Surfaces of the section, built in gmsh's own kernel; lengths in normal modules.

    Parameters
    ----------
    geo
        ``gmsh.model.geo``.
    body, cells
        The body, and the numbers of its cells.
    structured
        Transfinite blocks; otherwise only their outlines.
    """

    geo: Any
    body: Body
    cells: Cells
    structured: bool = True
    surfaces: list[int] = field(default_factory=list)
    #: names of the curves of each surface's loop, in its order; None inside the body
    names: list[list[str | None]] = field(default_factory=list)
    loops: list[list[int]] = field(default_factory=list)
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
        gear, n = self.body.gear, self.cells
        r_f, form = gear.root_radius, gear.form_radius
        foot = [self._flank_point(0, side, r_f, "foot") for side in Side]
        clamp = self._arc("clamp", 0, foot[0], foot[1], r_f, n.thickness)
        right = self._flank(0, Side.RIGHT, r_f, form, foot[1], n.fillet)
        left = self._flank(0, Side.LEFT, r_f, form, foot[0], n.fillet)
        self._surface([(clamp, "clamp"), *right, self._tip(0), *_reverse(left)], foot + self._tips(0))

    def _tooth_on_rim(self, d: int) -> None:
        body, n = self.body, self.cells.of_tooth(d)
        r_j, form = body.junction_radius, body.gear.form_radius
        foot = [self._flank_point(d, side, r_j, "junction") for side in Side]
        row = self._line("row", d, foot[0], foot[1], n.thickness)
        right = self._flank(d, Side.RIGHT, r_j, form, foot[1], n.fillet)
        left = self._flank(d, Side.LEFT, r_j, form, foot[0], n.fillet)
        self._surface([(row, None), *right, self._tip(d), *_reverse(left)], foot + self._tips(d))
        bore = [self._bore_point(d, side) for side in Side]
        arc = self._arc("bore", d, bore[0], bore[1], body.bore_radius or 0.0, n.thickness)
        sides = [self._radial(d, side) for side in Side]
        self._surface([(arc, "bore"), (sides[1], None), (-row, None), (-sides[0], None)], [*bore, foot[1], foot[0]])

    def _gap(self, d: int) -> None:
        """Block between tooth d and tooth d + 1."""
        body, n = self.body, self.cells
        gear = body.gear
        r_f, r_j = gear.root_radius, body.junction_radius
        top = [(tag, name) for tag, name in self._foot(d, Side.RIGHT)]
        cells = 2 * n.foot
        land = gear.sign * (body.pitch_angle - 2 * float(gear.half_angle(r_f)))
        if land > 1e-9:
            ends = self._flank_point(d, Side.RIGHT, r_f, "root"), self._flank_point(d + 1, Side.LEFT, r_f, "root")
            top.append((self._arc("land", d, *ends, r_f, n.land), "root"))
            cells += n.land
        top += _reverse(self._foot(d + 1, Side.LEFT))
        bore = [self._bore_point(d, Side.RIGHT), self._bore_point(d + 1, Side.LEFT)]
        arc = self._arc("gap", d, bore[0], bore[1], body.bore_radius or 0.0, cells)
        corners = [self._flank_point(e, side, r_j, "junction") for e, side in ((d, Side.RIGHT), (d + 1, Side.LEFT))]
        ends = (body.offsets[0] - 1, body.offsets[-1])
        open_ = not body.closed and body.rest != "ring"
        left = "cut_left" if d == ends[0] and open_ else None
        right = "cut_right" if d == ends[1] and open_ else None
        up, down = self._radial(d + 1, Side.LEFT), -self._radial(d, Side.RIGHT)
        loop = [(arc, "bore"), (up, right), *_reverse(top), (down, left)]
        self._surface(loop, [*bore, corners[1], corners[0]])

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
        lines += [self._radial_line(("rest", i), low[i], high[i]) for i in (1, 2, 3)]
        lines.append(self._radial(*ends[1]))
        length = (angles[1] - angles[0]) * r_j * self.cells.thickness / (6 * body.gear.normal_module)
        growth = progression(length, self.cells.rest[0])  # away from the sector
        for i in range(4):
            n = self.cells.rest[0 if i in (0, 3) else 1]
            spacing = ("Progression", {0: growth, 3: 1 / growth}.get(i, 1.0))
            inner = self._arc(f"rest{i}", 0, low[i], low[i + 1], bore, n, spacing)
            outer = self._arc(f"rest_top{i}", 0, high[i], high[i + 1], r_j, n, spacing)
            loop = [(inner, "bore"), (lines[i + 1], None), (-outer, "rest"), (-lines[i], None)]
            self._surface(loop, [low[i], low[i + 1], high[i + 1], high[i]])

    # -- points and curves, each made once ----------------------------------------------------------------------------
    def _tooth(self, d: int) -> int:
        """Number of the tooth, unique also where the whole gear closes."""
        return (d - self.body.offsets[0]) % abs(self.body.gear.teeth) + self.body.offsets[0] if self.body.closed else d

    def _point(self, key: tuple, R: float, theta: float) -> int:
        if key not in self._points:
            R /= self.body.gear.normal_module
            self._points[key] = self.geo.addPoint(R * math.sin(theta), R * math.cos(theta), 0.0)
        return self._points[key]

    def _curve(self, key: tuple, cells: int, make: Any, spacing: tuple[str, float] = ("Progression", 1.0)) -> int:
        if key not in self._curves:
            self._curves[key] = tag = make()
            if self.structured:
                self.geo.mesh.setTransfiniteCurve(tag, cells + 1, *spacing)
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

    def _spline(self, part: str, d: int, side: Side, curve: tuple[NDArray, NDArray], ends: tuple, cells: int) -> int:
        # the load ends at form circle and tip: cells get smaller towards both
        ratio = FILLET_GRADING ** (1 / max(cells - 1, 1))
        spacing = {"flank": ("Bump", FLANK_BUMP), "fillet": ("Progression", ratio)}.get(part, ("Progression", 1.0))

        def make() -> int:
            """Spline through the points of the curve, turned to its tooth."""
            shift = d * self.body.pitch_angle
            inner = [
                self._point((part, self._tooth(d), side, i), float(R), shift + side * float(psi))
                for i, (R, psi) in enumerate(zip(*curve, strict=True))
            ][1:-1]
            return self.geo.addSpline([ends[0], *inner, ends[1]])

        return self._curve((part, self._tooth(d), side), cells, make, spacing)

    def _flank(self, d: int, side: Side, low: float, form: float, foot: int, cells: int) -> list:
        """Fillet from radius ``low`` and involute up to the tip."""
        middle = self._flank_point(d, side, form, "form")
        tip = self._flank_point(d, side, self.body.gear.tip_radius, "tip")
        fillet = self._spline("fillet", d, side, self.body.fillet(low, form), (foot, middle), cells)
        flank = self._spline("flank", d, side, self.body.involute(), (middle, tip), self.cells.of_tooth(d).flank)
        return [(fillet, on_tooth(f"{side.label}_fillet", d)), (flank, on_tooth(f"{side.label}_flank", d))]

    def _foot(self, d: int, side: Side) -> list:
        """Lower fillet, from the junction down to the root circle."""
        body = self.body
        R, psi = body.fillet(body.gear.root_radius, body.junction_radius)
        ends = (
            self._flank_point(d, side, body.junction_radius, "junction"),
            self._flank_point(d, side, body.gear.root_radius, "root"),
        )
        tag = self._spline("lower", d, side, (R[::-1], psi[::-1]), ends, self.cells.foot)
        return [(tag, on_tooth(f"{side.label}_fillet", self._tooth(d)))]

    def _tip(self, d: int) -> tuple[int, str]:
        ends = self._tips(d)
        tag = self._arc("tip", d, ends[0], ends[1], self.body.gear.tip_radius, self.cells.of_tooth(d).thickness)
        return tag, on_tooth("tip", d)

    def _arc(
        self, part: str, d: int, start: int, end: int, R: float, cells: int, spacing: tuple[str, float] | None = None
    ) -> int:
        if spacing is None:
            across = part in ("tip", "clamp", "bore", "row")
            spacing = self._towards_flank(cells, reverse=part == "tip") if across else ("Progression", 1.0)
        make = lambda: self.geo.addCircleArc(start, self._point(("centre",), 0.0, 0.0), end)  # noqa: E731
        return self._curve((part, self._tooth(d), R), cells, make, spacing)

    def _line(self, part: str, d: int, start: int, end: int, cells: int) -> int:
        key = (part, self._tooth(d))
        return self._curve(key, cells, lambda: self.geo.addLine(start, end), self._towards_flank(cells))

    def _towards_flank(self, cells: int, *, reverse: bool = False) -> tuple[str, float]:
        """Spacing across the tooth, cells getting smaller towards the loaded (right) flank."""
        ratio = GRADING ** (1 / max(cells - 1, 1))
        return "Progression", ratio if not reverse else 1 / ratio

    def _radial(self, d: int, side: Side) -> int:
        """Line from the bore to the junction on the fillet, cells growing towards the bore."""
        start = self._bore_point(d, side)
        end = self._flank_point(d, side, self.body.junction_radius, "junction")
        return self._radial_line(("radial", self._tooth(d), side), start, end)

    def _radial_line(self, key: tuple, start: int, end: int) -> int:
        first = 1.6 * self.body.gear.normal_module / self.cells.thickness
        depth = self.body.junction_radius - (self.body.bore_radius or 0.0)
        ratio = progression(depth / first, self.cells.rim)
        return self._curve(key, self.cells.rim, lambda: self.geo.addLine(start, end), ("Progression", 1 / ratio))

    def _surface(self, curves: list[tuple[int, str | None]], corners: list[int]) -> None:
        surface = self.geo.addPlaneSurface([self.geo.addCurveLoop([tag for tag, _ in curves])])
        if self.structured:
            self.geo.mesh.setTransfiniteSurface(surface, cornerTags=corners)
            self.geo.mesh.setRecombine(2, surface)
        self.surfaces.append(surface)
        self.names.append([name for _, name in curves])
        self.loops.append([abs(tag) for tag, _ in curves])

    def named_curves(self) -> list[tuple[str, int]]:
        """Pairs (name, curve) of the curves on the boundary of the section."""
        pairs = zip(self.names, self.loops, strict=True)
        return [(name, tag) for names, tags in pairs for name, tag in zip(names, tags, strict=True) if name]


#: Size of the cell at the loaded flank over that at the other one.
GRADING = 0.2
#: gmsh's "Bump" along the involute (1 is uniform), and size of the fillet's cell at the form circle over its first.
FLANK_BUMP = 0.4
FILLET_GRADING = 0.5


def progression(total: float, n: int) -> float:
    """Ratio g ≥ 1 with 1 + g + … + gⁿ⁻¹ = ``total``, at most 4; 1 where the cells fit evenly."""
    if total <= n:
        return 1.0
    low, high = 1.0, 4.0
    for _ in range(60):
        g = 0.5 * (low + high)
        low, high = (g, high) if (g**n - 1) / (g - 1) < total else (low, g)
    return high


def _reverse(curves: list) -> list:
    return [(-tag, name) for tag, name in reversed(curves)]
