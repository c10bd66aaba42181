"""Quantities that a study may limit, and how far a design is from its limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import cache, partial

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.solver import solve
from gearbench.contact.transitions import mesh_phases
from gearbench.errors import InputError, one_of
from gearbench.optimisation.numbers import COST, NUMBERS, OF_SCENE, UNDER_LOAD, each_mesh
from gearbench.optimisation.study import RESPONSES, Limit
from gearbench.results.responses import is_over_speed, is_response, response, responses
from gearbench.results.solved import Solved
from gearbench.scene import Scene
from gearbench.solution import solve_scene
from gearbench.strength.rating import GEOMETRIC
from gearbench.trains.solve import SolvedTrain

#: A rough value that violates its limit by less than this relative margin is computed again exactly. The error of
#: ``solve_roughly`` on random gears is at most 2.5 % with plates and 4.9 % with solid teeth on gear bodies.
ROUGH = 0.1


def check_limited(name: str) -> None:
    """Refuse quantities that cannot be limited.

    Raises
    ------
    InputError
        Unless the name is a number of ``gearbench.optimisation.numbers`` or a response of ``simulate``.
    """
    if name not in NUMBERS and not is_response(name):
        raise InputError(
            f"constraints.{name}", "unknown quantity", one_of(name, dict.fromkeys([*RESPONSES, *NUMBERS, *responses()]))
        )


def constrained(
    scene: Scene,
    limits: Mapping[str, Limit],
    solved: Callable[[], Solved | SolvedTrain] | None = None,
    cost: float = math.nan,
    force: Callable[[Scene], float] = lambda _: math.nan,
) -> dict[str, float]:
    """Compute the limited quantities of ``scene`` by name; NaN where they were not computed.

    Quantities are computed in order of cost: geometry, scene, solved scene. A later group is computed only if the
    limits of the earlier groups hold. ``solved`` returns the solved scene; by default this function solves it. With
    several loads, every load is solved here and the worst value counts. ``cost`` is the cost of the design's
    variables, ``force`` returns the mesh force over the study's speeds.
    """
    if scene.loads:
        return _worst_of_loads(scene, limits, cost, force)
    solved = solved or cache(partial(solve_scene, scene))
    of = partial(numbers_of, scene=scene, solved=solved, cost=cost)
    values = dict.fromkeys(limits, math.nan)
    cheap = (COST, *GEOMETRIC)
    for names in (cheap, OF_SCENE, [name for name in limits if name not in cheap and name not in OF_SCENE]):
        if judge(values, limits)[0] == 0:
            values |= {
                name: force(scene) if is_over_speed(name) else limits[name].worst(of(name))
                for name in limits
                if name in names
            }
    return values


def number(name: str, scene: Scene, solved: Callable[[], Solved | SolvedTrain], cost: float = math.nan) -> float:
    """Value of a number of the design, the greatest over its meshes; arguments as in ``constrained``."""
    return max(numbers_of(name, scene, solved, cost))


def numbers_of(
    name: str, scene: Scene, solved: Callable[[], Solved | SolvedTrain], cost: float = math.nan
) -> list[float]:
    """Values of a number of the design or a ``simulate`` response: one per mesh if it belongs to a mesh, else one."""
    if name == COST:
        return [cost]
    if name in GEOMETRIC:
        return [GEOMETRIC[name](mesh.pair) for mesh in each_mesh(scene)]
    if name in OF_SCENE:
        return [OF_SCENE[name](scene)]
    found = solved()
    if name in UNDER_LOAD:
        return [UNDER_LOAD[name](mesh) for mesh in ([found] if isinstance(found, Solved) else found.meshes.values())]
    return [float(response(name).reduce(found.cycle))]


def solve_roughly(scene: Scene) -> Solved:
    """Solve the scene at the mesh phases and on the segments of its error samples; they need this solution anyway."""
    phase, weight = mesh_phases(scene)
    lines = scene_lines(scene, phase)
    problem = assemble(scene, lines)
    return Solved(scene=scene, lines=lines, weight=weight, problem=problem, solution=solve(problem))


def may_be_rough(scene: Scene, limits: Iterable[str]) -> bool:
    """Whether ``solve_roughly`` is enough for ``limits``: only if the contact pressure is the one costly limit."""
    costly = {name for name in limits if name not in (COST, *GEOMETRIC, *OF_SCENE)}
    return not scene.has_shafts and not scene.coupled and costly <= {"contact_pressure"}


def decided(values: Mapping[str, float], limits: Mapping[str, Limit]) -> bool:
    """Whether rough ``values`` are so far from their limits that exact values could not change the verdict."""
    ends = ((values[n], end) for n in limits if n in UNDER_LOAD for end in (limits[n].min, limits[n].max))
    return not any(end is not None and abs(value - end) <= ROUGH * abs(end) for value, end in ends)


def _worst_of_loads(
    scene: Scene, limits: Mapping[str, Limit], cost: float, force: Callable[[Scene], float]
) -> dict[str, float]:
    """Compute ``constrained`` under every load and keep the worst values."""
    found = [constrained(each, limits, cost=cost, force=force) for each in scene.each_load]
    known = {name: [values[name] for values in found if not math.isnan(values[name])] for name in limits}
    return {name: limits[name].worst(values) if values else math.nan for name, values in known.items()}


def judge(values: Mapping[str, float], limits: Mapping[str, Limit]) -> tuple[float, str]:
    """Sum of the relative violations, and a text that names the violated limits ("" if there are none)."""
    broken = {
        name: limit.violation(values[name])
        for name, limit in limits.items()
        if not math.isnan(values[name]) and limit.violation(values[name]) > 0
    }
    return sum(broken.values()), "; ".join(limits[name].describe(name, values[name]) for name in broken)
