"""What the tolerance of the contact solver costs: the answer after each of its Newton steps.

The compiled solver runs to rounding and has no knob. Its readable twin is stopped early instead. The time of a run with
fewer steps is not measured but follows from the share of the solver in a run: every step costs the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import measured, relative_errors
from gearbench.contact.assemble import assemble, mesh_phases, scene_lines
from gearbench.contact.problem import ContactProblem
from gearbench.contact.reference import solve_one
from gearbench.contact.solver import solve
from gearbench.cost.measure import measure
from gearbench.cost.workprecision import Curve
from gearbench.results.cycle import MeshCycle, Phases
from gearbench.scene import Scene
from gearbench.stopwatch import times

#: Most steps that are looked at.
STEPS = 8


def newton_curve(scene: Scene, repeats: int) -> Curve | None:
    """Error after 1, 2, … steps; None where the scene has no contact law, and so no Newton solver."""
    problem = assemble(scene, scene_lines(scene, mesh_phases(scene)[0]))
    if not (problem.a.any() or problem.h.any()):
        return None
    solution = solve(problem)
    run, alone = measure(scene, repeats), times(lambda: solve(problem), repeats)
    taken = float(np.mean(solution.iterations))
    exact, before = _stopped(scene, problem, 200), _stopped(scene, problem, 100)
    steps = np.arange(1, STEPS + 1)
    left = 1 - np.minimum(steps / taken, 1.0)
    return Curve(
        knob="newton steps",
        expected="quadratic: digits double with each step",
        labels=tuple(str(n) for n in steps),
        sizes=steps.astype(float),
        errors=np.array([relative_errors(_stopped(scene, problem, int(n)), exact) for n in steps]),
        bar=relative_errors(before, exact),
        seconds=run.seconds - left * alone["seconds"],
        processor_seconds=run.processor_seconds - left * alone["processor_seconds"],
        megabytes=np.full(STEPS, run.megabytes),
    )


def _stopped(scene: Scene, problem: ContactProblem, steps: int) -> NDArray:
    """Mean and RMS of STE and stiffness when every position is left after so many steps, (4,)."""
    least = np.min(np.where(problem.active, problem.gap, np.inf), axis=1)
    moved = replace(problem, gap=problem.gap - least[:, None])
    found = np.array([solve_one(moved, i, steps)[1:] for i in range(len(least))])
    phase, weight = mesh_phases(scene)
    approach = problem.length_scale * (found[:, 0] + least)
    stiffness = problem.force / problem.length_scale * found[:, 1]
    phases = Phases(phase=phase, weight=weight, size=scene.resolution.panel_size)
    return measured(MeshCycle.of(scene, phases, approach, stiffness))
