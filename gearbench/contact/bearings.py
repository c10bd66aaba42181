"""Contact of a pair on elastic shafts, iterated because the stiffness of bearings depends on their load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.contact.resultants import Resultants, resultants
from gearbench.contact.solver import ConvergenceError, Guess
from gearbench.effects.base import Effect
from gearbench.effects.shafts import SeatedGear, Shafts, flank_loads
from gearbench.geometry.action import ContactLines
from gearbench.scene import Scene

#: The iteration ends if no segment's force changes by more than this share of the largest force; maximum number of
#: iterations.
TOLERANCE, MAX_ITERATIONS = 1e-9, 50


@dataclass(frozen=True, kw_only=True, eq=False)
class OnShafts:
    """Contact of a pair whose shafts are in equilibrium with their bearings, under the mean flank forces of a cycle.

    Parameters
    ----------
    lines
        Contact lines.
    effects
        Acting effects, including those of the shafts.
    problem, solution, guess
        The contact problem, its solution, and amplitudes q = Ψᵀ P and approach of the solution, in the form of a first
        guess.
    gears
        Pinion and wheel on their shafts.
    """

    lines: ContactLines
    effects: tuple[Effect, ...]
    problem: ContactProblem
    solution: ContactSolution
    guess: Guess
    gears: tuple[SeatedGear, SeatedGear]

    def resultants(self, rows: int) -> Resultants:
        """The first ``rows`` resultants: sums of flank forces, weighted by Legendre polynomials of rising degree."""
        return resultants(self.problem, self.lines, self.solution, self.guess, rows)


def solve_on_shafts(
    scene: Scene, shaft_effects: Callable[..., tuple[Effect, ...]], lines: ContactLines, weight: NDArray
) -> OnShafts:
    """Solve the contact of ``scene`` on its shafts.

    Parameters
    ----------
    scene
        Pair, load and effects.
    shaft_effects
        Function that gives the effects of the shafts. It takes the loads on the nodes of both shafts (by default an
        even load over the face), and the gears of the previous round, where the search for their equilibrium starts.
    lines, weight
        Contact lines, and the weights of their positions in the mean over the mesh cycle.

    Raises
    ------
    ConvergenceError
        If the forces do not converge.
    """
    effects, previous_force = shaft_effects(), None
    for _ in range(MAX_ITERATIONS):
        acting = (*scene.flank_effects, *effects)
        problem = assemble(scene, lines, acting)
        guess = Guess.empty(problem)
        solution = solve_patches(problem, guess)
        shafts = next(effect for effect in effects if isinstance(effect, Shafts))
        converged = shafts.linear  # one solution is enough
        if previous_force is not None:
            change = np.abs(solution.force - previous_force).max()
            converged = converged or change <= TOLERANCE * previous_force.max()
        if converged:
            return OnShafts(
                lines=lines, effects=acting, problem=problem, solution=solution, guess=guess, gears=shafts.gears
            )
        previous_force = solution.force
        effects = shaft_effects(flank_loads(shafts.gears, lines, solution.force, weight), shafts.gears)
    raise ConvergenceError(f"bearings and contact did not converge in {MAX_ITERATIONS} iterations")
