"""Measured flank topography: deviations on a grid, from a file for each gear."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects, GapEffect
from gearbench.effects.flank_grid import FlankGrid, grid_of, read_grid
from gearbench.effects.shape import MICROMETRE, MOST_KINKS
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.lazy import xr
from gearbench.named_files import content
from gearbench.schema import STRICT

File = Annotated[str, Field(min_length=1, max_length=1000)]
Digest = Annotated[str, Field(pattern="[0-9a-f]{64}")]

_NAMES = ("pinion", "wheel")


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Topography(GapEffect):
    """Measured deviations of one or both gears, the same on all teeth.

    Files are CSV or netCDF grids (see ``gearbench.effects.flank_grid``), bilinear between the points and constant
    beyond them.

    Parameters
    ----------
    pinion, wheel
        File of each gear, relative to the scene file.
    positive
        Whether a positive deviation is "missing" or "excess" material; most measuring machines plot excess.
    pinion_sha256, wheel_sha256
        SHA-256 of the files, stored when they are read. A given one is compared with the file, unless a Dataset that
        holds its grid has been read before.
    """

    pinion: File | None = None
    wheel: File | None = None
    positive: Literal["missing", "excess"] = "missing"
    pinion_sha256: Digest | None = None
    wheel_sha256: Digest | None = None

    name: ClassVar[str] = "topography"
    summary: ClassVar[str] = "gap: measured deviations of the flanks, from files"
    source: ClassVar[str] = "ISO 1328-1, ISO/TR 10064-1 (measured flanks)"
    use: ClassVar[str] = "For measured flanks."
    example: ClassVar[dict[str, Any]] = {"pinion": "flank.csv"}

    def __post_init__(self) -> None:
        if self.pinion is None and self.wheel is None:
            raise InputError("pinion", "missing", "a file is required, here or for the wheel")
        grids = []
        for name in _NAMES:
            file, given_digest = getattr(self, name), getattr(self, f"{name}_sha256")
            if file is None and given_digest is not None:
                raise InputError(f"{name}_sha256", given_digest, f"belongs to the file of the {name}, which is missing")
            grid, digest = (None, None) if file is None else _read(name, file, given_digest)
            object.__setattr__(self, f"{name}_sha256", digest)
            grids.append(grid)
        # the grids are no field, so that effects are compared by the hashes only
        object.__setattr__(self, "_grids", tuple(grids))

    @property
    def grids(self) -> tuple[FlankGrid | None, FlankGrid | None]:
        """Grids of pinion and wheel."""
        return self.__dict__["_grids"]

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse a grid that covers less than half of the active flank: it probably belongs to another gear."""
        active_radii = pair.meshing.active_radii
        for name, gear, ends, (overhang_at_0, _), grid in zip(
            _NAMES, pair.gears, active_radii, pair.overhangs, self.grids, strict=True
        ):
            if grid is None:
                continue
            active = grid.coordinate_of(gear, np.array(ends))
            for axis, values, (low, high) in (
                (grid.along, grid.coordinate, (float(active.min()), float(active.max()))),
                ("face position", grid.face, (overhang_at_0, overhang_at_0 + pair.meshing.face_width)),
            ):
                covered = min(high, values[-1]) - max(low, values[0])
                if len(values) > 1 and covered < (high - low) / 2:
                    span = f"{axis} {values[0]:g} to {values[-1]:g} mm"
                    raise InputError(
                        name, span, f"must cover at least half of the active flank, {low:.5g} to {high:.5g} mm"
                    )

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        total = np.zeros(lines.shape)
        for index, (gear, radius, grid) in enumerate(zip(lines.pair.gears, lines.radii, self.grids, strict=True)):
            if grid is not None:
                total += grid.at(gear, radius, lines.gear_face(index)) * lines.levers[index]
        return (MICROMETRE if self.positive == "missing" else -MICROMETRE) * total

    def kept(self) -> dict[str, xr.DataArray]:
        """Grids "topography_pinion" and "topography_wheel" [µm], with the signs of the files and their SHA-256."""
        grids = {}
        for gear, grid in zip(_NAMES, self.grids, strict=True):
            if grid is not None:
                name = f"{self.name}_{gear}"
                meaning = f"measured deviation of the flank of the {gear}, positive: material {self.positive}"
                attrs = {"long_name": meaning, "sha256": str(getattr(self, f"{gear}_sha256"))}
                grids[name] = grid.to_array(name).assign_attrs(attrs)
        return grids

    @classmethod
    def recall(cls, kept: Mapping[str, xr.DataArray]) -> None:
        """Register the grids stored in a Dataset, so that its scenes work without the files.

        Raises
        ------
        InputError
            If a variable is no grid, or has no SHA-256 of its file.
        """
        for name in (f"{cls.name}_{gear}" for gear in _NAMES if f"{cls.name}_{gear}" in kept):
            digest = str(kept[name].attrs.get("sha256", "missing"))
            if not re.fullmatch("[0-9a-f]{64}", digest):
                raise InputError(str(kept[name].name), digest, "needs the attribute sha256, the SHA-256 of its file")
            if digest not in _KNOWN:
                _KNOWN[digest] = grid_of(kept[name])

    def kinks(self, pair: Pair) -> tuple[float, ...]:
        """Positions u [mm] of the rows of a grid with at most ``MOST_KINKS`` rows; none if there are more."""
        positions: list[float] = []
        for index, (gear, grid) in enumerate(zip(pair.gears, self.grids, strict=True)):
            if grid is not None and len(grid.coordinate) <= MOST_KINKS:
                positions += [pair.meshing.path_coordinate(index, float(radius)) for radius in grid.radii(gear)]
        return tuple(u for u in positions if pair.meshing.path_start < u < pair.meshing.path_end)

    def face_kinks(self, pair: Pair) -> tuple[float, ...]:
        """Positions y [mm] of the columns of a grid with at most ``MOST_KINKS`` columns; none if the pair is helical.

        Contact lines of a helical pair cross the rows, at which they are cut; the columns are treated as smooth.
        """
        if pair.meshing.overlap_ratio:
            return ()
        kinks: set[float] = set()
        for index, grid in enumerate(self.grids):
            if grid is not None and len(grid.face) <= MOST_KINKS:
                kinks |= {float(y) - pair.overhangs[index][0] for y in grid.face}
        return tuple(sorted(y for y in kinks if 0 < y < pair.meshing.face_width))


#: Grids by their SHA-256, so that files are read once.
_KNOWN: dict[str, FlankGrid] = {}


def _read(key: str, file: str, given_digest: str | None) -> tuple[FlankGrid, str]:
    """Grid of a file and its SHA-256."""
    if given_digest is not None and given_digest in _KNOWN:
        return _KNOWN[given_digest], given_digest
    data, digest = content(key, file)
    if given_digest not in (None, digest):
        raise InputError(f"{key}_sha256", given_digest, f"{file} has changed: its SHA-256 is {digest}")
    if digest not in _KNOWN:
        _KNOWN[digest] = read_grid(key, file, data)
    return _KNOWN[digest], digest
