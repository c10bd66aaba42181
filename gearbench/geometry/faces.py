"""Faces of two gears along their axes; teeth touch on the common face."""

from __future__ import annotations

from dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.geometry.names import GEARS

#: Least and greatest face width [normal modules].
WIDTHS = (0.05, 500.0)

Ends = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Faces:
    """The faces of pinion and wheel; positions along the axes count from the middle of the pair's face [mm].

    Parameters
    ----------
    width
        Default face width b [mm].
    given
        Face widths b_1, b_2 given for the gears [mm]; None for the default.
    offsets
        Middle of each face [mm].
    """

    width: float
    given: tuple[float | None, float | None]
    offsets: tuple[float, float]

    def check(self, module: float) -> None:
        """Refuse, with an ``InputError``, widths out of range for this normal module [mm] and separate faces."""
        low, high = WIDTHS
        of_gears = {f"{gear}.face_width": width for gear, width in zip(GEARS, self.given, strict=True)}
        for key, width in {"face_width": self.width, **of_gears}.items():
            if width is not None and not low <= width / module <= high:
                allowed = f"must be {low:g} to {high:g} normal modules ({module:g} mm); lengths are in mm"
                raise InputError(key, width, allowed)
        if None not in self.given and self.width not in self.given:
            raise InputError("face_width", self.width, "must equal that of one of the gears: both have a face_width")
        if self.common[1] - self.common[0] < low * module:
            index = max((0, 1), key=lambda index: abs(self.offsets[index]))
            raise InputError(
                f"{GEARS[index]}.axial_offset", self.offsets[index], "the faces of the gears do not overlap"
            )

    @property
    def widths(self) -> tuple[float, float]:
        """b_1, b_2 [mm]."""
        one, two = self.given
        return self.width if one is None else one, self.width if two is None else two

    @property
    def ends(self) -> tuple[Ends, Ends]:
        """Ends of both faces [mm]."""
        first, second = ((middle - b / 2, middle + b / 2) for middle, b in zip(self.offsets, self.widths, strict=True))
        return first, second

    @property
    def common(self) -> Ends:
        """Ends of the common face [mm]."""
        (low1, high1), (low2, high2) = self.ends
        return max(low1, low2), min(high1, high2)

    @property
    def overhangs(self) -> tuple[Ends, Ends]:
        """Lengths by which each face reaches beyond the common one, at y = 0 and at y = b [mm]."""
        start, end = self.common
        first, second = ((start - low, high - end) for low, high in self.ends)
        return first, second
