"""Solution of a scene at all phases of its mesh cycle, and its Dataset."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.mesh_loads import with_mesh_loads
from gearbench.contact.patches import solve_patches
from gearbench.contact.transitions import loaded_phases
from gearbench.geometry.action import ContactLines
from gearbench.lazy import xr
from gearbench.results.outputs import output
from gearbench.results.points import Columns
from gearbench.results.provenance import provenance
from gearbench.results.responses import described
from gearbench.results.solved import Solved
from gearbench.scene import Scene
from gearbench.threads import single_threaded_blas

_LOG = logging.getLogger(__name__)
#: Reason why harmonics and panels may be NaN.
UNIFORM = "NaN: uniform mesh phases have no panels, and give harmonics below half their number only"
#: Default of ``dataset``: no further dimensions.
_NONE: Mapping[str, tuple[NDArray, dict[str, str]]] = MappingProxyType({})


def solve_scene(scene: Scene) -> Solved:
    """Solve the contact of ``scene`` at all its mesh phases."""
    scene = with_mesh_loads(scene)
    phase, weight, size = loaded_phases(scene)
    return solve_lines(scene, scene_lines(scene, phase), weight, size)


@single_threaded_blas()
def solve_lines(scene: Scene, lines: ContactLines, weight: NDArray, size: int | None = None) -> Solved:
    """Solve a scene on given contact lines, with weights (position,) of their positions.

    ``size`` is the number of Gauss points on a panel if it differs from the scene's.
    """
    _LOG.debug("contact problem: %d positions, %d pairs, %d segments", *lines.shape)
    if scene.has_shafts:
        from gearbench.contact.bearings import solve_on_shafts

        rest = solve_on_shafts(scene, scene.shaft_effects, lines, weight)
        problem, solution = rest.problem, rest.solution
    else:
        problem = assemble(scene, lines)
        solution = solve_patches(problem)
    _LOG.debug("solved in at most %d Newton steps a position", solution.iterations.max(initial=0))
    return Solved(scene=scene, lines=lines, weight=weight, problem=problem, solution=solution, size=size)


def dataset(
    solved: Solved, outputs: Sequence[str], start: float, before: Mapping[str, tuple[NDArray, dict[str, str]]] = _NONE
) -> xr.Dataset:
    """Make the Dataset of ``outputs`` of a solved scene; ``start`` is the ``perf_counter`` when its computation began.

    ``before`` gives the dimensions that the arrays of the solution have before the position, with their values and
    attributes; outputs have these dimensions too.
    """
    coords, variables = columns(solved, outputs)
    variables = {
        name: ((*before, *dims)[-np.ndim(x) :] if np.ndim(x) else (), x) for name, (dims, x) in variables.items()
    }
    coordinates = {name: (name, values, attrs) for name, (values, attrs) in before.items()}
    attrs = provenance(solved.scene, wall_time=time.perf_counter() - start)
    if solved.scene.effect("manufacturing_errors") is not None:
        attrs["random_errors"] = "at their means"
    attrs["polished_positions"] = solved.solution.corrected  # number of positions solved once more, see ContactSolution
    missing = UNIFORM if solved.phases.size is None else ""
    return xr.Dataset(described(variables, missing), coords=described(coords, missing) | coordinates, attrs=attrs)


def columns(solved: Solved, outputs: Sequence[str]) -> tuple[Columns, Columns]:
    """Compute coordinates and variables of the Dataset of a solved scene."""
    lines, solution = solved.lines, solved.solution
    coords: Columns = {name: (("position",), values) for name, values in solved.cycle.phases.coordinates.items()}
    coords["pair_index"] = ("pair",), lines.index
    variables: Columns = {name: output(solved, name) for name in outputs}
    over = {dim for dims, _ in variables.values() for dim in dims}
    if "harmonic" in over:
        coords["harmonic"] = ("harmonic",), np.array(solved.phases.orders)
    if "gear" in over:
        coords["gear"] = ("gear",), np.array(solved.scene.gear_names)
    if "segment" in over:
        grid = ("position", "pair", "segment")
        coords |= {
            "path_position": (grid, lines.u),
            "face_position": (grid, lines.face),
            "segment_length": (grid, lines.length),
        }
    variables |= {
        "equilibrium_residual": (("position",), solution.equilibrium),
        "minimum_force": (("position",), solution.least_force),
        "complementarity_residual": (("position",), solution.complementarity),
        "newton_steps": (("position",), solution.iterations),
    }
    return coords, variables
