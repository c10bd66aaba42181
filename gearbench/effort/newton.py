"""Cost of the tolerance of the contact solver: the answer after each of its Newton steps.

The solver runs to rounding and has no knob; here it is stopped early. The time of a run with fewer steps is not
measured but follows from the share of the solver in a run: every step costs the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import measured, relative_errors
from gearbench.contact.assemble import assemble, mesh_phases, scene_lines
from gearbench.contact.problem import ContactProblem
from gearbench.contact.solver import newton, solve
from gearbench.effort.clock import Cost, times
from gearbench.effort.curves import Point, WorkPrecision, run
from gearbench.results.cycle import MeshCycle, Phases
from gearbench.scene import Scene

#: Most steps that are tried.
STEPS = 8


def newton_curves(scene: Scene, repeats: int) -> list[WorkPrecision]:
    """Error after 1, 2, … steps; no curve where the scene has no contact law, and so no Newton solver."""
    problem = assemble(scene, scene_lines(scene, mesh_phases(scene)[0]))
    if not (problem.a.any() or problem.h.any()):
        return []
    solution = solve(problem)
    (_, whole), alone = run(scene, repeats), times(lambda: solve(problem), repeats)
    taken = float(np.mean(solution.iterations))
    exact, before = _stopped(scene, problem, 200), _stopped(scene, problem, 100)

    def point(steps: int) -> Point:
        """The run that stops after ``steps``: its time is that of the whole less the share it leaves out."""
        left = 1 - min(steps / taken, 1.0)
        cost = Cost(
            seconds=whole.seconds - left * alone.seconds,
            processor_seconds=whole.processor_seconds - left * alone.processor_seconds,
            megabytes=whole.megabytes,
        )
        errors = relative_errors(_stopped(scene, problem, steps), exact)
        return Point(label=str(steps), size=steps, errors=errors, cost=cost)

    return [
        WorkPrecision(
            knob="newton steps",
            expected="quadratic: digits double with each step",
            points=tuple(point(steps) for steps in range(1, STEPS + 1)),
            bar=relative_errors(before, exact),
        )
    ]


def _stopped(scene: Scene, problem: ContactProblem, steps: int) -> NDArray:
    """Mean and RMS of STE and stiffness when every position is left after ``steps`` of them, (4,)."""
    least = np.min(np.where(problem.active, problem.gap, np.inf), axis=1)
    moved = replace(problem, gap=problem.gap - least[:, None])
    _, delta, stiffness, _ = newton(moved, steps)
    phase, weight = mesh_phases(scene)
    phases = Phases(phase=phase, weight=weight, size=scene.resolution.panel_size)
    approach, k = problem.length_scale * (delta + least), problem.force / problem.length_scale * stiffness
    return measured(MeshCycle.of(scene, phases, approach, k))
