"""Random gear pairs from all gears in use, or from an everyday range."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.involute import inv, inverse_involute
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load, Scene

#: Function that makes a scene from twelve numbers in [0, 1).
Maker = Callable[[NDArray], Scene]


def draw(make: Maker, seed: int) -> Iterator[Scene]:
    """Yield scenes of random pairs; pairs that are not valid or barely mesh (ε_α < 1.1) are skipped."""
    rng = np.random.default_rng(seed)
    while True:
        u = rng.uniform(size=12)
        try:
            scene = make(u)
        except (ValidationError, ValueError):
            continue
        if scene.pair.meshing.transverse_contact_ratio >= 1.1:
            yield scene


def in_use(u: NDArray) -> Scene:
    """Gears in use: m 0.3–25, z 11–200, β 0–40° (0 in a third of them), α 14.5–25°, b/m 3–25, rims from 1.5 m.

    The logarithms of module, numbers of teeth and face width are uniformly distributed. The rim is between 1.5 modules
    thick and a body whose bore is a tenth of the root circle.
    """
    module, width = between(u[0], 0.3, 25.0, 2), between(u[8], 3.0, 25.0, 2)
    teeth = round(between(u[1], 11, 120, 1))
    wheel = round(between(u[2], teeth, 200, 1))
    helix = 0.0 if u[3] < 1 / 3 else round(4 + 36 * (1.5 * u[3] - 0.5), 1)
    alpha, shifts = round(14.5 + 10.5 * u[4], 1), (round(-0.1 + 0.6 * u[5], 2), round(-0.2 + 0.5 * u[6], 2))
    addendum, face = round(0.85 + 0.3 * u[7], 2), round(module * width, 2)
    pair = pair_at_its_shifts(module, (teeth, wheel), helix, alpha, shifts, addendum, face)
    bores = [
        2 * (gear.root_radius - between(v, 1.5 * module, 0.9 * gear.root_radius, 3))
        for gear, v in zip(pair.gears, u[9:11], strict=True)
    ]
    return _scene(pair, [float(f"{bore:.4g}") for bore in bores], u[11])


def everyday(u: NDArray) -> Scene:
    """Gears of general engineering: m 1–12, z 15–120, β 0–30°, α 17.5–25°, b/m 4–10, bores 0.35–0.85 of the root."""
    module = between(u[0], 1.0, 12.0, 2)
    teeth = 15 + int(30 * u[1])
    wheel = min(120, round(teeth * (1 + 3 * u[2])))
    helix = 0.0 if u[3] < 0.4 else round(5 + 25 * (u[3] - 0.4) / 0.6, 1)
    alpha, shifts = round(17.5 + 7.5 * u[4], 1), (round(-0.1 + 0.6 * u[5], 2), round(-0.2 + 0.5 * u[6], 2))
    addendum, width = round(0.85 + 0.3 * u[7], 2), round(module * (4 + 6 * u[8]), 1)
    pair = pair_at_its_shifts(module, (teeth, wheel), helix, alpha, shifts, addendum, width)
    bores = [round(2 * gear.root_radius * (0.35 + 0.5 * v), 1) for gear, v in zip(pair.gears, u[9:11], strict=True)]
    return _scene(pair, bores, u[11])


def between(u: float, low: float, high: float, digits: int) -> float:
    """Value between ``low`` and ``high`` with a uniform logarithm, rounded to ``digits``."""
    return round(float(np.exp(np.interp(u, [0, 1], np.log([low, high])))), digits)


def pair_at_its_shifts(
    module: float,
    teeth: tuple[int, int],
    helix: float,
    alpha: float,
    shifts: tuple[float, float],
    addendum: float,
    width: float,
) -> Pair:
    """Make a pair without backlash, at the centre distance of its profile shifts."""
    alpha_t = math.atan(math.tan(math.radians(alpha)) / math.cos(math.radians(helix)))
    working = inv(alpha_t) + 2 * sum(shifts) * math.tan(math.radians(alpha)) / sum(teeth)
    reference = module * sum(teeth) / 2 / math.cos(math.radians(helix))
    members = [
        Member(teeth=z, addendum=addendum, dedendum=1.25, profile_shift=x) for z, x in zip(teeth, shifts, strict=True)
    ]
    return Pair(
        normal_module=module,
        pressure_angle=alpha,
        helix_angle=helix,
        face_width=width,
        centre_distance=reference * math.cos(alpha_t) / math.cos(inverse_involute(working)),
        pinion=members[0],
        wheel=members[1],
    )


def _scene(pair: Pair, bores: list[float], load: float) -> Scene:
    """Make the scene of a pair with bores; the line load is 10 to 60 N/mm per mm of module, on the pitch circle."""
    bored = [replace(m, bore_diameter=d) for m, d in zip((pair.pinion, pair.wheel), bores, strict=True)]
    module = pair.normal_module
    torque = (10 + 50 * load) * module * pair.meshing.face_width * module * pair.pinion.teeth / 2e3
    return Scene(
        pair=replace(pair, pinion=bored[0], wheel=bored[1]),
        load=Load(torque=float(f"{torque:.3g}")),
        effects=(ToothBending(model="solid"), Hertz()),
    )
