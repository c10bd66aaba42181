"""Seeded random scenes over everything the input allows, and random gap vectors over sixteen orders of magnitude."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from pydantic import ValidationError

from gearbench.contact.problem import ContactProblem
from gearbench.effects.base import Effect
from gearbench.effects.crowning import Crowning
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load, Resolution, Scene


def log_uniform(rng: Generator, low: float, high: float) -> float:
    return float(10 ** rng.uniform(math.log10(low), math.log10(high)))


def random_pair(rng: Generator) -> Pair:
    """A pair, or a ``ValidationError`` where what was drawn cannot mesh."""
    m, alpha = log_uniform(rng, 0.1, 50), float(rng.uniform(14, 28))
    beta = 0.0 if rng.random() < 0.3 else log_uniform(rng, 0.01, 45)
    teeth = [int(z) for z in np.exp(rng.uniform(np.log(5), np.log(300), 2))]
    addendum = rng.uniform(0.6, 1.25, 2)
    first = float(rng.uniform(-0.6, 0.8)) if rng.random() < 0.5 else None
    members = [
        Member(teeth=z, addendum=float(h), dedendum=float(h + rng.uniform(0.1, 0.4)), profile_shift=x)
        for z, h, x in zip(teeth, addendum, (first, None), strict=True)
    ]
    return Pair(
        normal_module=m,
        pressure_angle=alpha,
        helix_angle=beta,
        face_width=m * log_uniform(rng, 0.5, 100),
        centre_distance=m * sum(teeth) / 2 / math.cos(math.radians(beta)) * float(rng.uniform(0.99, 1.02)),
        pinion=members[0],
        wheel=members[1],
        material=Material(
            youngs_modulus=log_uniform(rng, 1, 1000),
            poisson_ratio=float(rng.choice([0.0, 0.3, 0.499, rng.uniform(0, 0.5)])),
        ),
    )


def random_scene(rng: Generator) -> Scene:
    """A scene from vanishing to absurd load, with gaps from 1e-12 to 1e3 deflections."""
    pair = random_pair(rng)
    # a line load per module of 100 N/mm² is an ordinary one for steel
    ordinary = 100.0 * pair.material.youngs_modulus / 210 * pair.face_width * pair.normal_module
    torque = ordinary * pair.gears[0].base_radius / 1e3 * log_uniform(rng, 1e-6, 1e4)
    deflection = 1e3 * 20 * torque * 1e3 / pair.gears[0].base_radius / pair.face_width / pair.material.E  # µm, roughly
    size = min(deflection * log_uniform(rng, 1e-12, 1e3), 900.0)
    length = 0.3 * min(g.tooth_height for g in pair.gears)
    gaps: list[Effect] = [
        Crowning(amount=size * float(rng.uniform(-1, 1))),
        HelixSlope(pinion=size * float(rng.uniform(-1, 1)), wheel=size * float(rng.uniform(-1, 1))),
        TipRelief(
            amount=size, length=float(rng.uniform(0, length)), shape="parabolic" if rng.random() < 0.5 else "linear"
        ),
    ]
    order = None if rng.random() < 0.6 else (int(rng.integers(1, 7)), int(rng.integers(1, 7)))
    law = Hertz(law="yang_sun" if rng.random() < 0.3 else "weber_banaschek")
    effects = ([ToothBending(order=order)] if rng.random() < 0.85 else []) + [law]
    effects += [e for e in gaps if rng.random() < 0.5]
    segments = int(rng.integers(1, 30))
    return Scene(pair=pair, load=Load(torque=torque), effects=tuple(effects), resolution=Resolution(segments=segments))


def random_scenes(seed: int, count: int) -> Iterator[tuple[Scene, Generator]]:
    """``count`` scenes with the generator that made each; what cannot mesh is drawn again."""
    for i in range(count):
        rng = np.random.default_rng([seed, i])
        while True:
            try:
                yield random_scene(rng), rng
                break
            except ValidationError:
                continue


def with_random_gaps(problem: ContactProblem, rng: Generator) -> ContactProblem:
    """The same compliance with gaps drawn segment by segment, some of them equal, and pairs that lag."""
    size = 10.0 ** rng.uniform(-12, 4)
    gap = size * rng.random(problem.gap.shape) * (rng.random(problem.gap.shape) < rng.uniform(0.2, 1.0))
    late = 10.0 ** rng.uniform(-3, 3) * (rng.random(problem.blocks) < 0.3)
    return replace(problem, gap=gap + late[problem.block])
