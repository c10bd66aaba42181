"""Contact on elastic shafts; where bearings depend on load, solved again with them at rest under it, to convergence."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.contact.solver import ConvergenceError
from gearbench.effects.base import Effect
from gearbench.effects.shafts import ShaftMotion, Shafts, flank_loads
from gearbench.geometry.action import ContactLines
from gearbench.scene import Scene

#: Change of a segment's force over the largest one at which it has settled, and rounds until then.
SETTLED, ROUNDS = 1e-9, 50


def settle(
    scene: Scene, around: Callable[[Any], tuple[Effect, ...]], lines: ContactLines, weight: NDArray
) -> tuple[ContactProblem, ContactSolution, ShaftMotion]:
    """Contact of ``scene`` on its shafts, and the mean motion of these under all loads.

    Parameters
    ----------
    scene
        Pair, load and effects.
    around
        Effects of the shafts, given the load of the flanks on the nodes of both (None: spread evenly).
    lines, weight
        Contact lines, and the weights of their positions.

    Raises
    ------
    ConvergenceError
        If the forces do not settle.
    """
    effects, before = around(None), None
    for _ in range(ROUNDS):
        problem = assemble(scene, lines, (*scene.flank_effects, *effects))
        solution = solve_patches(problem)
        shafts = next(effect for effect in effects if isinstance(effect, Shafts))
        own = flank_loads(shafts.gears, lines, solution.force, weight)
        constant = len(effects) == 1
        if constant or (before is not None and np.abs(solution.force - before).max() <= SETTLED * before.max()):
            pinion, wheel = _gears(around(own))
            motions = (pinion.loaded(own[0]), wheel.loaded(own[1]))
            return problem, solution, ShaftMotion(gears=(pinion, wheel), motions=motions)
        before, effects = solution.force, around(own)
    raise ConvergenceError(f"bearings and contact not settled after {ROUNDS} rounds")


def _gears(effects: tuple[Effect, ...]) -> Any:
    return next(effect for effect in effects if isinstance(effect, Shafts)).gears
