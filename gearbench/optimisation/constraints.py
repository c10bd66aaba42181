"""Quantities that a study may limit, and how far a design is from its limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import cache, partial

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.solver import solve
from gearbench.contact.transitions import mesh_phases
from gearbench.optimisation.numbers import COST, OF_SCENE, UNDER_LOAD, each_mesh
from gearbench.optimisation.study import Limit
from gearbench.results.responses import is_over_speed, response
from gearbench.results.solved import Solved
from gearbench.scene import Scene
from gearbench.solution import solve_scene
from gearbench.strength.rating import GEOMETRIC
from gearbench.trains.solve import SolvedTrain

#: A rough value that violates its limit by less than this relative margin is computed again exactly. The contact
#: pressure from ``solve_roughly`` on random gears is within 2.5 % with plates, 4.9 % with solid teeth on gear bodies.
ROUGH = 0.1


def constrained(
    scene: Scene,
    limits: Mapping[str, Limit],
    solved: Callable[[], Solved | SolvedTrain] | None = None,
    cost: float = math.nan,
    force: Callable[[Scene], float] = lambda _: math.nan,
) -> dict[str, float]:
    """Compute the limited quantities of ``scene`` by name, in three groups: geometry, scene, solved scene.

    Each group takes more time than the one before. It is left out if a limit of an earlier group is violated.
    ``solved`` returns the solved scene; by default this function solves it. With several loads, every load is solved
    here and the worst value counts. ``cost`` is the cost of the design's variables. ``force`` returns the RMS of
    the mesh force over the study's speeds, without errors.
    """
    if scene.loads:
        by_load = [constrained(loaded, limits, cost=cost, force=force) for loaded in scene.each_load]
        computed = {name: [values[name] for values in by_load if name in values] for name in limits}
        return {name: limits[name].worst(values) for name, values in computed.items() if values}
    solved = solved or cache(partial(solve_scene, scene))
    numbers = partial(numbers_of, scene=scene, solved=solved, cost=cost)
    values: dict[str, float] = {}
    geometric = (COST, *GEOMETRIC)
    for names in (geometric, OF_SCENE, [name for name in limits if name not in geometric and name not in OF_SCENE]):
        if judge(values, limits)[0] == 0:
            values |= {
                name: force(scene) if is_over_speed(name) else limits[name].worst(numbers(name))
                for name in limits
                if name in names
            }
    return values


def number(name: str, scene: Scene, solved: Callable[[], Solved | SolvedTrain], cost: float = math.nan) -> float:
    """Value of a quantity, the greatest over the meshes of the design; arguments as in ``constrained``."""
    return max(numbers_of(name, scene, solved, cost))


def numbers_of(
    name: str, scene: Scene, solved: Callable[[], Solved | SolvedTrain], cost: float = math.nan
) -> list[float]:
    """Values of a quantity or a response of ``simulate``: one per mesh if it belongs to a mesh, else one."""
    if name == COST:
        return [cost]
    if name in GEOMETRIC:
        return [GEOMETRIC[name](mesh.pair) for mesh in each_mesh(scene)]
    if name in OF_SCENE:
        return [OF_SCENE[name](scene)]
    solution = solved()
    if name in UNDER_LOAD:
        meshes = [solution] if isinstance(solution, Solved) else solution.meshes.values()
        return [UNDER_LOAD[name](mesh) for mesh in meshes]
    return [float(response(name).reduce(solution.cycle))]


def solve_roughly(scene: Scene) -> Solved:
    """Solve the scene at the few mesh phases and segments of its error samples, which use the same contact problem."""
    phase, weight = mesh_phases(scene)
    lines = scene_lines(scene, phase)
    problem = assemble(scene, lines)
    return Solved(scene=scene, lines=lines, weight=weight, problem=problem, solution=solve(problem))


def may_be_rough(scene: Scene, limits: Iterable[str]) -> bool:
    """Whether ``solve_roughly`` is enough for ``limits``: no limit but the contact pressure may need a solution."""
    of_solution = {name for name in limits if name not in (COST, *GEOMETRIC, *OF_SCENE)}
    return not scene.has_shafts and not scene.coupled and of_solution <= {"contact_pressure"}


def decided(values: Mapping[str, float], limits: Mapping[str, Limit]) -> bool:
    """Whether rough ``values`` are so far from their limits that exact values could not change the verdict."""
    rough = [name for name in limits if name in UNDER_LOAD and name in values]
    pairs = ((values[name], limit) for name in rough for limit in (limits[name].min, limits[name].max))
    return not any(limit is not None and abs(value - limit) <= ROUGH * abs(limit) for value, limit in pairs)


def judge(values: Mapping[str, float], limits: Mapping[str, Limit]) -> tuple[float, str]:
    """Sum of the relative violations of computed ``values``, and a text that names the violated limits ("" if none)."""
    violations = {name: limits[name].violation(values[name]) for name in limits if name in values}
    violated = [name for name, violation in violations.items() if violation > 0]
    return sum(violations.values()), "; ".join(limits[name].describe(name, values[name]) for name in violated)
