"""Simulate a scene: static transmission error and mesh stiffness over a mesh cycle."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, mesh_phases, scene_lines
from gearbench.contact.solver import solve
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.outputs import DEFAULT_OUTPUTS, OUTPUTS, Solved, cycle_numbers
from gearbench.provenance import provenance
from gearbench.quantities import QUANTITIES
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

_LOG = logging.getLogger(__name__)


def simulate(scene: Scene, *, outputs: Sequence[str] = DEFAULT_OUTPUTS) -> xr.Dataset:
    """Static transmission error, mesh stiffness and load distribution of ``scene`` over a mesh cycle.

    Parameters
    ----------
    scene
        What to simulate.
    outputs
        Names of the variables to compute, from ``gearbench.outputs.OUTPUTS``.

    Returns
    -------
    Dataset with the dimensions ``position``, ``pair``, ``segment``, names and units as in ``gearbench.quantities``,
    the residuals of the contact solution, and its provenance in the attributes.

    Raises
    ------
    InputError
        If an output has no such name.
    ConvergenceError
        If the contact problem is not solved to its residual.

    Notes
    -----
    Where the scene gives ``resolution.accuracy``, settings are chosen first. The Dataset holds the scene with them,
    and their estimated error in the attribute ``accuracy_estimated``; the wall time includes the choice.

    Examples
    --------
    >>> from gearbench import load_scene
    >>> dataset = simulate(load_scene("examples/sc.toml"))
    >>> k = dataset["mesh_stiffness"]
    >>> k.dims, k.units, k.symbol
    (('position',), 'N/µm', 'k')
    >>> print(f"{float(dataset['mesh_stiffness_rms']):.0f} {dataset['mesh_stiffness_rms'].units}")
    18 %
    """
    start = time.perf_counter()
    for name in outputs:
        if name not in OUTPUTS:
            raise InputError("outputs", name, f"allowed: {', '.join(OUTPUTS)}")
    if scene.resolution.accuracy is None:
        return dataset(solve_scene(scene), outputs, start)
    from gearbench.accuracy.choose import choose

    choice = choose(scene, cycle_values)
    return dataset(solve_scene(choice.scene), outputs, start).assign_attrs(choice.attrs)


def cycle_values(scene: Scene) -> NDArray:
    """Mean and RMS of STE [µm], mean [N/µm] and RMS [%] of the mesh stiffness, (4,): see ``accuracy.measure``."""
    solved = solve_scene(scene)
    return cycle_numbers(solved.transmission_error, solved.mesh_stiffness, solved.weight)


def solve_scene(scene: Scene) -> Solved:
    """Contact solution of ``scene`` at all its mesh phases."""
    phase, weight = mesh_phases(scene)
    return solve_lines(scene, scene_lines(scene, phase), weight)


def solve_lines(scene: Scene, lines: ContactLines, weight: NDArray) -> Solved:
    """As ``solve_scene``, on the contact lines and with the weights of their positions given, (position,)."""
    _LOG.debug("contact problem: %d positions, %d pairs, %d segments", *lines.shape)
    if scene.has_shafts:
        from gearbench.contact.bearings import settle

        problem, solution, _ = settle(scene, scene.shaft_effects, lines, weight)
    else:
        problem = assemble(scene, lines)
        solution = solve(problem)
    _LOG.debug("solved in at most %d Newton steps a position", solution.iterations.max(initial=0))
    return Solved(scene=scene, lines=lines, weight=weight, problem=problem, solution=solution)


def dataset(solved: Solved, outputs: Sequence[str], start: float) -> xr.Dataset:
    """Dataset of the ``outputs`` of a solved scene; ``start`` is when its computation began (``perf_counter``)."""
    import xarray as xr

    lines, solution = solved.lines, solved.solution
    coords = {
        "mesh_phase": ("position", lines.mesh_phase),
        "phase_weight": ("position", solved.weight),
        "pair_index": ("pair", lines.index),
    }
    variables: dict[str, tuple] = {name: (OUTPUTS[name][0], OUTPUTS[name][1](solved)) for name in outputs}
    if any("segment" in dims for dims, _ in variables.values()):
        grid = ("position", "pair", "segment")
        coords |= {
            "path_position": (grid, lines.u),
            "face_position": (grid, lines.y),
            "segment_length": (grid[:2], lines.length),
        }
    variables |= {
        "equilibrium_residual": ("position", solution.equilibrium),
        "minimum_force": ("position", solution.least_force),
        "complementarity_residual": ("position", solution.complementarity),
        "newton_steps": ("position", solution.iterations),
    }
    attrs = provenance(solved.scene, wall_time=time.perf_counter() - start)
    attrs["polished_positions"] = solution.polished  # solved once more, see ContactSolution
    described = {name: (dims, np.asarray(v), QUANTITIES[name].attrs) for name, (dims, v) in variables.items()}
    named = {name: (dims, v, QUANTITIES[name].attrs) for name, (dims, v) in coords.items()}
    return xr.Dataset(described, coords=named, attrs=attrs)
