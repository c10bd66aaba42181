"""Waviness over a revolution: run-out and wobble (order 1), ghost orders of the machine that cut the gear."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import ChangingGap, GapOverCycles
from gearbench.effects.shape import MICROMETRE
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Wave:
    """One wave of a gear.

    Parameters
    ----------
    order
        Waves per revolution of the gear: 1 is run-out or wobble, a multiple of the number of teeth a mesh order, any
        other a ghost order.
    amplitude
        a, transverse along the line of action [µm]; for run-out the eccentricity, half of the radial run-out F_r.
    phase
        φ at the beginning of mesh cycle 0 [°].
    over_face
        "even", or "tilting" (wobble): −a at y = 0 and a at y = b.
    """

    order: Annotated[int, Field(ge=1, le=100_000)]
    amplitude: Annotated[float, Field(ge=0.0, le=1000.0)]
    phase: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0
    over_face: Literal["even", "tilting"] = "even"


Waves = Annotated[tuple[Wave, ...], Field(max_length=100)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Waviness(ChangingGap):
    """Waves on the flanks, e = a cos β_b sin(2π q t/z + φ), with the order q and the time t in mesh periods.

    See (F7) of docs/theory.md. Points that touch at the same time have the same deviation, as from an eccentric gear,
    or from a hob or grinding worm with an uneven table drive. ``simulate`` computes the mesh cycle 0 ≤ t < 1,
    ``hunting_cycle`` all of them.

    Parameters
    ----------
    pinion, wheel
        Waves of each gear, one table for each.
    """

    pinion: Waves = ()
    wheel: Waves = ()

    name: ClassVar[str] = "waviness"
    summary: ClassVar[str] = "gap: waves over a revolution of either gear"
    source: ClassVar[str] = "ISO 1328-2 F_r; ISO/TR 10064-5 (filtered helix and profile waviness)"
    use: ClassVar[str] = "Run-out, wobble and ghost orders, heard in addition to the mesh orders."
    example: ClassVar[dict[str, Any]] = {"pinion": [{"order": 1, "amplitude": 8.0}]}

    def __post_init__(self) -> None:
        if not self.pinion and not self.wheel:
            raise InputError("pinion", "missing", "a wave is required, here or for the wheel")

    def turning(self, lines: ContactLines, cycles: NDArray) -> GapOverCycles:
        """Two modes of a wave, sin(x + ψ) = sin x cos ψ + cos x sin ψ: x within a mesh cycle, ψ at its beginning."""
        modes, amounts = [], []
        sign = -1 if lines.coast else 1  # coast flanks are solved as a mirrored pair, which turns the other way
        for index, wave in ((index, wave) for index, waves in enumerate((self.pinion, self.wheel)) for wave in waves):
            rate = 2 * math.pi * wave.order / abs(lines.pair.gears[index].teeth)
            x = (sign * rate * lines.mesh_phase)[:, None, None]
            face = np.ones(lines.shape)
            if wave.over_face == "tilting":
                face = 2 * lines.gear_face(index) / lines.pair.gears[index].face_width - 1
            face = face * lines.levers[index]
            modes += [np.sin(x) * face, np.cos(x) * face]
            psi = sign * rate * cycles + math.radians(wave.phase)
            amounts += [wave.amplitude * np.cos(psi), wave.amplitude * np.sin(psi)]
        scale = MICROMETRE * math.cos(lines.pair.meshing.beta_b)
        return GapOverCycles(modes=scale * np.stack(modes, axis=-1), amounts=np.stack(amounts, axis=-1))

    def later(self, pair: Pair, cycles: tuple[int, int]) -> Waviness:
        """The same waves with the phases that they have ``cycles`` teeth later."""
        of_gears = []
        for waves, cycle, gear in zip((self.pinion, self.wheel), cycles, pair.gears, strict=True):
            turn = 360.0 * cycle / abs(gear.teeth)
            of_gears.append(tuple(replace(wave, phase=(wave.phase + wave.order * turn) % 360.0) for wave in waves))
        return Waviness(pinion=of_gears[0], wheel=of_gears[1])
