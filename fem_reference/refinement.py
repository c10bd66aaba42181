"""Orders for a requested accuracy: hierarchic levels, an extrapolated value, its error bar, and memory in advance.

Level n has quadrilaterals of degree n in the section and, over the face width, ``EXTRA[n]`` polynomials beyond those of
the loads. Each level contains the previous one, so the compliance grows towards the exact one. Its
steps fall by a factor of 3 (thin rims) to 8; a quarter of the last step is added and is the error bar. Compared with
much higher levels, the error bar has bounded the error, mostly by a factor of two to four (tested).
"""

from __future__ import annotations

import logging
import math
import time
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem_reference.axis import FaceFunctions
from fem_reference.circulant import flank_blocks
from fem_reference.outside import Outside
from fem_reference.section import Body
from fem_reference.sector import Grain, Section
from fem_reference.solver import available_solver
from fem_reference.waves import wave_numbers
from gearbench.budget import memory_limit, require, sector_memory
from gearbench.compliance.flank import FlankCompliance
from gearbench.compliance.local import half_space_compression, waves_across
from gearbench.compliance.lugs import LugReduction
from gearbench.errors import GearbenchError
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material
from gearbench.threads import single_threaded_blas

_LOG = logging.getLogger(__name__)

#: Polynomials along the axis beyond those of the loads, by level.
EXTRA = {2: 3, 3: 6, 4: 9, 5: 13, 6: 17, 7: 21}
#: Waves along the axis are dropped below exp(−this), by level.
FADED = {2: 2.0, 3: 2.0, 4: 3.0, 5: 4.0, 6: 5.0, 7: 6.0}
#: Error bar that a level usually reaches with the previous one, to choose the levels.
USUAL = {3: 0.008, 4: 1e-3, 5: 2.5e-4, 6: 1e-4, 7: 4e-5}
#: Share of the last step that is added and serves as error bar.
STEP = 0.25
#: Neighbours on each side whose displacements are stored.
NEIGHBOURS = 6


class AccuracyError(GearbenchError):
    """The requested accuracy needs more memory than there is, or cannot be reached."""


@dataclass(frozen=True, kw_only=True)
class Level:
    """A body at one level, with the size of its solution.

    Parameters
    ----------
    body
        The body.
    number
        Degree of the quadrilaterals.
    waves
        Number of polynomials of the loads over the face width.
    rim
        Height of the row below the teeth in modules.
    """

    body: Body
    number: int
    waves: int
    rim: float = 1.2

    @cached_property
    def section(self) -> Section:
        """The section."""
        return Section(body=self.body, grain=Grain(degree=self.number, rim=self.rim))

    @cached_property
    def axis(self) -> FaceFunctions:
        """Functions along the axis."""
        breaks = self.body.axis_breaks
        share = np.diff(breaks) / breaks[-1]
        counts = tuple(math.ceil(self.waves * part - 1e-9) + EXTRA[self.number] for part in share)
        return FaceFunctions(breaks=breaks, counts=counts)

    @cached_property
    def of_nodes(self) -> NDArray:
        """Whether each node has each function along the axis (node, count): waves fade with the depth below the teeth.

        A wave q fades at least like exp(−q d cos β) with the depth d, also along the screw. The web has functions on
        its width only.
        """
        gear, section, web, axis = self.body.gear, self.section, self.body.web, self.axis
        depth = np.maximum(gear.root_radius - section.positions[:, 0], 1e-9 * abs(gear.root_radius))
        felt = FADED[self.number] / (math.pi * depth * math.cos(gear.beta))
        piece, number = axis.degrees
        lengths = np.append(np.diff(axis.breaks), 0.0)  # none at the breaks, whose functions are there at any depth
        there = number < np.ceil(EXTRA[self.number] + felt[:, None] * lengths[piece])
        if web is not None:
            inside = np.isin(np.arange(len(there)), section.nodes[section.of_web])
            inside &= ~np.isin(np.arange(len(there)), section.nodes[~section.of_web])
            there &= ~inside[:, None] | np.isin(np.arange(axis.count), axis.of_piece(self.body.web_piece))
        return there

    @property
    def there(self) -> NDArray:
        """The same for each free degree of freedom of the section."""
        return np.repeat(self.of_nodes, 3, axis=0)[self.section.free]

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the sector."""
        return int(np.count_nonzero(self.there))

    @property
    def memory(self) -> float:
        """Memory [bytes], within a factor of two."""
        of_element = (3 * (self.number + 1) ** 2) ** 2
        sector = sector_memory(of_element * float(self.of_nodes.sum(axis=1)[self.section.nodes].mean(axis=1).sum()))
        if self.body.lugs is None:
            return sector
        z, flank = abs(self.body.gear.teeth), math.prod(default_order(self.body.gear))
        loads = flank + Outside(section=self.section, axis=self.axis).lug_loads
        # complex compliances of the waves, and those of the flank of every tooth from them
        return sector + 16 * len(wave_numbers(z)) * loads**2 + 24 * z * flank * loads


def default_order(gear: Gear) -> tuple[int, int]:
    """Polynomials along height and face width."""
    return 5, waves_across(gear)


def levels(body: Body, accuracy: float, order: tuple[int, int] | None = None) -> tuple[Level, Level]:
    """Return the two levels that usually reach ``accuracy``; the memory of the finer one is required.

    Raises
    ------
    AccuracyError
        If no level reaches it.
    MemoryBudgetError
        If it exceeds the memory budget; the message says what fits.
    """
    waves = (order or default_order(body.gear))[1]
    chosen = [n for n, usual in USUAL.items() if usual <= accuracy]
    if not chosen:
        raise AccuracyError(f"accuracy = {accuracy:g}: must be at least {min(USUAL.values()):g}")
    fine = Level(body=body, number=chosen[0], waves=waves)
    fitting = [n for n in USUAL if Level(body=body, number=n, waves=waves).memory <= memory_limit()]
    instead = f"accuracy = {USUAL[fitting[-1]]:g} would fit" if fitting else f"no accuracy would fit: {_smaller(body)}"
    require(fine.memory, "effects.tooth_bending.accuracy", accuracy, instead)
    return Level(body=body, number=chosen[0] - 1, waves=waves), fine


def _smaller(body: Body) -> str:
    """Advice for a body that does not fit into memory at any accuracy."""
    return "take a narrower face width" if body.bore_radius is None else "compare without effects.gear_body"


@single_threaded_blas()
def refined_compliance(
    body: Body, material: Material, accuracy: float = 0.01, order: tuple[int, int] | None = None
) -> FlankCompliance:
    """Compliance of a flank to a relative ``accuracy`` (Frobenius norm of all blocks), with its estimated error.

    It is the displacement of the surface without the compression of the half-space down to the centre line
    (``gearbench.compliance.local``). A body on a bore is the whole gear with all its teeth, whatever ``body.teeth``.

    Raises
    ------
    AccuracyError
        As ``levels`` does, or if the error bar stays above ``accuracy``; says what was reached.
    MeshingError
        If flanks or fillets of the section cross.
    """
    start = time.perf_counter()
    order = order or default_order(body.gear)
    pending = [*levels(body, accuracy, order)]
    found: list[FlankCompliance] = []
    while True:
        level = pending.pop(0)
        found.append(solved(level, material, order))
        _LOG.info("level %d: %d unknowns, %.1f s so far", level.number, level.unknowns, time.perf_counter() - start)
        if pending:
            continue
        ahead = _ahead(found[-2], found[-1])
        error = _difference(ahead, found[-1])
        _LOG.info("estimated error of the compliance %.1e, wanted %.1e", error, accuracy)
        if error <= accuracy:
            break
        pending = [replace(level, number=level.number + 1)]
        if pending[0].number not in EXTRA or pending[0].memory > memory_limit():
            raise AccuracyError(
                f"accuracy = {accuracy:g}: reached {error:.1e} with {level.unknowns} unknowns; no larger level fits"
            )
    attrs = {
        "solver": available_solver(), "unknowns": level.unknowns, "meshes": len(found),
        "element": f"quadrilaterals of degree {level.number} × {level.axis.count} polynomials", "level": level.number,
        "seconds": time.perf_counter() - start,
    }  # fmt: skip
    return replace(ahead, error=error, attrs=attrs)


def _ahead(coarse: FlankCompliance, fine: FlankCompliance) -> FlankCompliance:
    """The finer of two levels and a share of what it adds to the coarser one."""
    step, anchors = STEP * (fine.blocks - coarse.blocks), fine.anchors
    if anchors is None or coarse.anchors is None:
        return replace(fine, blocks=fine.blocks + step, correction=step)
    own, reach = (STEP * (getattr(anchors, name) - getattr(coarse.anchors, name)) for name in ("own", "reach"))
    return replace(
        fine, blocks=fine.blocks + step, anchors=LugReduction(reach=anchors.reach + reach, own=anchors.own + own)
    )


def _difference(one: FlankCompliance, other: FlankCompliance) -> float:
    """Relative difference (Frobenius norm) of all blocks, or of some teeth in a row of a ring on lugs."""
    teeth = [(i, j) for i in range(NEIGHBOURS) for j in range(NEIGHBOURS)]
    a, b = (f.blocks if f.anchors is None else np.array([f.at(*each) for each in teeth]) for f in (one, other))
    return float(np.linalg.norm(a - b) / np.linalg.norm(a))


def solved(
    level: Level, material: Material, order: tuple[int, int], reach: int = NEIGHBOURS, *, across: bool = False
) -> FlankCompliance:
    """Compliance of the flanks by a level, without the compression of the half-space in C_0.

    It couples ``reach`` teeth on either side. ``across``: of right flanks under loads on left flanks.
    """
    gear = level.body.gear
    n = 0 if level.body.bore_radius is None else min(abs(gear.teeth) // 2, reach)
    blocks, anchors = flank_blocks(level.section, level.axis, level.there, material, order, n, across=across)
    if not across:
        blocks[n] -= half_space_compression(gear, material.E, material.nu, order, points=24)
    return FlankCompliance(gear=gear, order=order, blocks=blocks, anchors=anchors)
