"""Contact law of flanks that touch off the line of action, in tables: a function of the nominal coordinate u alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.base import LineLaw
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.separation import NODES, Separation

if TYPE_CHECKING:
    from gearbench.effects.hertz import Hertz

#: Length of intervals over the half-width of the strip of contact; parabolas on them are accurate to 1e-4 c.
_STEP = 0.25
#: The fewest and the most intervals on a base pitch.
_FEWEST, _MOST = NODES / 4, 2 * NODES
#: Points within an interval at which the law is evaluated; at its ends the law may jump.
_AT = np.array([1e-9, 0.5, 1 - 1e-9])


@dataclass(frozen=True, kw_only=True, eq=False)
class LawTable:
    """Law between u at which another part of a flank touches, by parabolas.

    Parameters
    ----------
    start, width
        Of the intervals, (interval,) [mm].
    coefficients
        Of a and of h in powers of t = 0 … 1, (2, 3, interval) [mm²/N].
    """

    start: NDArray
    width: NDArray
    coefficients: NDArray

    def __call__(self, u: NDArray) -> LineLaw:
        """The law at u [mm]."""
        i = np.clip(np.searchsorted(self.start, u, side="right") - 1, 0, len(self.start) - 1)
        t = np.clip((u - self.start[i]) / self.width[i], 0.0, 1.0)
        a, h = (c[0, i] + t * (c[1, i] + t * c[2, i]) for c in self.coefficients)
        return LineLaw(a=a, h=h)


@lru_cache(maxsize=32)
def law_table(hertz: Hertz, pair: Pair, separation: Separation, typical_load: float) -> LawTable:
    """Table of the law of ``hertz`` over all u at which the separation of the flanks is known."""
    rho = float(pair.meshing.curvature_radius(np.array([pair.meshing.pitch_point]))[0])
    pitch = pair.meshing.base_pitch
    half_width = math.sqrt(4 * rho * typical_load / (math.pi * pair.contact_modulus))
    step = float(np.clip(_STEP * half_width, pitch / _MOST, pitch / _FEWEST))
    ends = separation.ends
    parts = np.ceil(np.diff(ends) / step - 1e-9).astype(int)
    edges = np.interp(np.arange(1 + int(parts.sum())), np.append(0, np.cumsum(parts)), ends)
    width = np.diff(edges)
    u = edges[:-1] + width * _AT[:, None]
    at = ContactLines(
        pair=pair, mesh_phase=np.zeros(u.size), index=np.zeros(1, dtype=int), u=u.reshape(-1, 1, 1),
        y=np.zeros((u.size, 1, 1)), length=np.ones((u.size, 1, 1)), separation=separation, typical_load=typical_load,
    )  # fmt: skip
    law = hertz.law_on(at)
    low, middle, high = np.stack([law.a, law.h]).reshape(2, 3, -1).swapaxes(0, 1)
    coefficients = np.stack([low, 4 * middle - 3 * low - high, 2 * (low + high) - 4 * middle], axis=1)
    return LawTable(start=edges[:-1], width=width, coefficients=coefficients)
