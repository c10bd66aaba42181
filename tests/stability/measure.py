"""Correct digits of a scene's answers against the whole chain in extended precision."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.problem import ContactProblem
from gearbench.contact.solver import newton, solve
from gearbench.scene import Scene
from tests.stability.extended.balls import Matrix, ball, number, working
from tests.stability.extended.chain import solve_problem, solve_scene
from tests.stability.extended.contact import Answer
from tests.stability.extended.numbers import digits
from tests.stability.extended.ring import Body
from tests.stability.extended.teeth import flank_compliance, solid_tooth
from tests.stability.models import BodyCase, SolidCase


@dataclass(frozen=True)
class Digits:
    """Least number of correct digits of δ, k and the forces (relative to their sum), and the most steps.

    ``correcting`` of the steps are of the dense active set, where rounding had to be corrected.
    """

    approach: float
    stiffness: float
    force: float
    steps: int
    correcting: int = 0

    @property
    def least(self) -> float:
        return min(self.approach, self.stiffness, self.force)


def compare(scene: Scene, phases: tuple[float, ...]) -> Digits:
    """Digits of ``scene`` over the given phases; nothing of the smooth compliance left out."""
    lines = scene_lines(scene, np.array(phases))
    solution = solve(assemble(scene, lines, truncation=0.0))
    F, found = scene.F_bn, []
    for p, tau in enumerate(phases):
        active = np.repeat(lines.active[p], lines.shape[2])
        force = solution.force[p].ravel()[active]
        exact = _exact(scene, tau, force, float(solution.approach[p]))
        forces = min(digits(x, y, F) for x, y in zip(force, exact.force, strict=True))
        found.append(
            (digits(solution.approach[p], exact.approach), digits(solution.stiffness[p], exact.stiffness), forces)
        )
    a, k, f = np.min(found, axis=0)
    return Digits(float(a), float(k), float(f), int(solution.iterations.max()))


def compare_problem(problem: ContactProblem) -> Digits:
    """Digits of the one position of a contact problem, its numbers taken as exact."""
    solution = solve(problem)
    active = problem.active[0]
    force = solution.force[0].ravel()[active] / problem.force
    delta = float(solution.approach[0] / problem.length_scale)
    exact = solve_problem(problem, 0, (force, delta))
    k = solution.stiffness[0] * problem.length_scale / problem.force
    forces = min(digits(x, y, 1) for x, y in zip(force, exact.force, strict=True))
    steps, correcting = int(solution.iterations.max()), 0
    if solution.corrected:
        least = np.min(np.where(problem.active, problem.gap, np.inf), axis=1)
        correcting = steps - int(newton(replace(problem, gap=problem.gap - least[:, None]))[3].max())
    return Digits(digits(delta, exact.approach), digits(k, exact.stiffness), forces, steps, correcting)


def _exact(scene: Scene, tau: float, force: np.ndarray, approach: float) -> Answer:
    """At a transition a line may be there or not, as rounding decides: the side is taken on which it is."""
    for shift in (0.0, 1e-15, -1e-15, 1e-14, -1e-14):
        try:
            return solve_scene(scene, tau + shift, (force, approach))
        except LookupError:
            continue
    raise LookupError(f"phase {tau}: another number of contact lines in extended precision")


def compare_solid(case: SolidCase) -> tuple[Digits, float]:
    """Digits of a scene with solid teeth, and those of the compliance between the polynomials of either flank."""
    scene = case.build()
    least = 17.0
    for k, gear in enumerate(scene.pair.gears):
        material = scene.pair.material
        fast = SolidTooth(gear=gear, E=material.E, nu=material.nu, order=case.order, measured_at="flank")
        p, q = fast.flank_order
        least = min(least, matrix_digits(fast.matrix, flank_compliance(scene.pair, k, case.order, p, q)))
    return compare(scene, (case.phase,)), least


def compare_body(case: BodyCase) -> float:
    """Digits of the compliance that the body adds to a tooth and to its neighbours."""
    gear, material = case.pair.gears[0], case.pair.material
    tooth = SolidTooth(gear=gear, E=material.E, nu=material.nu, order=case.order)
    bore = case.bore * gear.root_radius
    found = ToothedRing(tooth=tooth, bore_radius=bore, order=case.along).blocks(1)
    with working():
        p, q = tooth.flank_order
        exact = Body(solid_tooth(case.pair, 0, case.order), ball(bore), p, q, case.along).blocks(1)
        largest = max(abs(number(exact[1][i, i])) for i in range(p * q))
        return min(matrix_digits(a, b, largest) for a, b in zip(found, exact, strict=True))


def matrix_digits(found: np.ndarray, exact: Matrix, scale: float | None = None) -> float:
    """Correct digits of the worst entry relative to the largest."""
    n = range(len(found))
    with working():
        true = [[number(exact[i, j]) for j in n] for i in n]
    if scale is None:
        scale = max(abs(true[i][i]) for i in n)
    return min(digits(float(found[i, j]), true[i][j], scale) for i in n for j in n)
