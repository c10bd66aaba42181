"""Warnings about implausible values of a system, which are valid but probably input errors."""

from __future__ import annotations

from collections.abc import Iterator

from gearbench.geometry.pair import Pair
from gearbench.system.gearbox import Gearbox
from gearbench.system.mechanics import steel_disc
from gearbench.system.schema import Shaft, System
from gearbench.system.shaft_model import INERTIA

#: Largest plausible factor between the inertia of a gear and that of a steel disc of its size, in both directions.
GEAR = 100.0
#: Largest plausible inertia of a motor or load over that of the largest gear as a steel disc.
COUPLED = 1e5
#: Smallest plausible bearing clearance [µm], and largest relative to the diameter of balls or rollers.
SMALLEST_CLEARANCE, LARGEST_CLEARANCE = 0.5, 0.02


def doubts_of_wheels(system: System, pair: Pair) -> Iterator[str]:
    """Warnings about two wheels without shafts, one line each."""
    for name, gear in zip(("pinion", "wheel"), pair.gears, strict=True):
        inertia = getattr(system, name).inertia
        disc = steel_disc(gear.pitch_radius, 0.0, gear.face_width)[1] / INERTIA
        if inertia is not None and not disc / GEAR < inertia < disc * COUPLED:
            yield f"system.{name}.inertia {inertia:.3g} kg·m²: as a steel disc it has {disc:.2g} kg·m²"


def doubts_of_shafts(box: Gearbox) -> Iterator[str]:
    """Warnings about shafts and their bearings, one line each."""
    joined = {joint.shaft for body in box.system.bodies for joint in body.joints}
    largest = 0.0
    for (mesh, gear), (number, seat) in box.seats.items():
        shaft, body = box.system.shafts[number], box.pairs[mesh].gears[gear]
        disc = steel_disc(body.pitch_radius, 0.0, body.face_width)[1] / INERTIA
        largest, of = max(largest, disc), f"shaft {shaft.name}, gear at {seat.position:g} mm"
        diameter = seat.diameter or box.models[number].diameters(seat.position, seat.position)[0][0]
        if body.sign > 0 and diameter > 2 * body.root_radius:
            yield f"{of}: the shaft, {diameter:.4g} mm, is thicker than its root circle, {2 * body.root_radius:.4g} mm"
        if seat.inertia is not None and not disc / GEAR < seat.inertia < disc * GEAR:
            yield f"{of}: inertia {seat.inertia:.3g} kg·m², as a steel disc it has {disc:.2g} kg·m²"
    for shaft in box.system.shafts:
        if shaft.coupling is not None and shaft.coupling.inertia > COUPLED * largest:
            coupled = f"{shaft.coupling.inertia:.3g} kg·m² coupled"
            yield f"shaft {shaft.name}: {coupled}, the largest gear has {largest:.2g} kg·m² as a steel disc"
        if len(shaft.bearings) == 1 and shaft.name not in joined and shaft.bearings[0].rolling is not None:
            yield f"shaft {shaft.name}: one bearing alone holds it against tilting"
        yield from _doubts_of_bearings(shaft)


def _doubts_of_bearings(shaft: Shaft) -> Iterator[str]:
    """Warnings about bearing clearances that may be in another unit."""
    for rolling in (bearing.rolling for bearing in shaft.bearings):
        if rolling is None or rolling.clearance == 0:
            continue
        too_large = rolling.clearance > LARGEST_CLEARANCE * 1e3 * rolling.D_w
        if abs(rolling.clearance) < SMALLEST_CLEARANCE or too_large:
            yield f"shaft {shaft.name}: a bearing has a clearance of {rolling.clearance:g} µm: is it in micrometres?"
