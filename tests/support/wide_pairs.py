"""Random wide helical pairs with gear bodies and relief."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
from pydantic import ValidationError

from gearbench.effects.base import Effect
from gearbench.effects.crowning import Crowning
from gearbench.effects.gear_body import GearBody
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.scene import Scene
from studies.s05_tooth_models.pairs import draw, in_use

#: Face width that counts as wide [modules].
WIDE = 10.0


def wide_scenes(number: int, seed: int) -> list[Scene]:
    """Helical pairs with gear bodies, b/m of at least ``WIDE`` and tip relief.

    Half of them are crowned, half have a helix slope, and a third has contact off the line of action.
    """
    return list(islice(_wide(seed), number))


def _wide(seed: int) -> Iterator[Scene]:
    rng = np.random.default_rng(seed)
    for scene in draw(in_use, seed):
        pair = scene.pair
        if not pair.helix_angle or pair.face_width < WIDE * pair.normal_module:
            continue
        m, u = pair.normal_module, rng.uniform(size=8).tolist()
        shape = "linear" if u[0] < 0.5 else "parabolic"
        relief = TipRelief(amount=4 * m * (0.2 + 0.8 * u[1]), length=m * (0.2 + 0.6 * u[2]), shape=shape)
        more: tuple[tuple[bool, Effect], ...] = (
            (u[3] < 0.5, Crowning(amount=4 * m * u[4])),
            (u[5] < 0.5, HelixSlope(pinion=4 * m * (u[6] - 0.5))),
            (u[7] < 1 / 3, OffLineContact()),
        )
        try:
            yield replace(
                scene, effects=(*scene.effects, GearBody(), relief, *(each for wanted, each in more if wanted))
            )
        except (ValidationError, ValueError):
            continue
