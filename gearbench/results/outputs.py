"""From a contact solution to the variables of a Dataset: those asked for, nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import total_gap
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.results.cycle import MICROMETRES, MeshCycle, Phases, coefficients
from gearbench.results.responses import USUAL, is_response, response, responses
from gearbench.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Solved:
    """A scene solved on its contact lines: the source of all outputs.

    The arrays of the solution may have dimensions before the position; so have the outputs that follow from it.
    ``size`` is the number of Gauss points on each panel, by default the scene's.
    """

    scene: Scene
    lines: ContactLines
    weight: NDArray
    problem: ContactProblem
    solution: ContactSolution
    size: int | None = None

    @property
    def phases(self) -> Phases:
        """The mesh phases."""
        size = self.size or self.scene.resolution.panel_size
        return Phases(phase=self.lines.mesh_phase, weight=self.weight, size=size)

    @cached_property
    def cycle(self) -> MeshCycle:
        """Static transmission error and mesh stiffness at the scene's mesh phases."""
        return MeshCycle.of(self.scene, self.phases, self.solution.approach, self.solution.stiffness)

    def line_load(self) -> NDArray:
        """Line load, (position, pair, segment) [N/mm]; zero where a pair has no contact line."""
        return self.solution.force / np.where(self.lines.length > 0, self.lines.length, 1.0) / self.lines.lever

    def load_share(self) -> NDArray:
        """Share of each pair in the normal force, (position, pair)."""
        return self.solution.force.sum(axis=-1) / self.solution.force.sum(axis=(-2, -1))[..., None]

    def initial_gap(self) -> NDArray:
        """Initial gap e, (position, pair, segment) [µm]."""
        return MICROMETRES * total_gap(self.scene, self.lines)


#: Output → (dimensions, how to compute it). ``simulate`` computes the ones it is asked for, and any response.
OUTPUTS: Mapping[str, tuple[tuple[str, ...], Callable[[Solved], NDArray]]] = MappingProxyType(
    {
        "transmission_error": (("position",), lambda s: s.cycle.transmission_error),
        "mesh_stiffness": (("position",), lambda s: s.cycle.mesh_stiffness),
        "line_load": (("position", "pair", "segment"), Solved.line_load),
        "load_share": (("position", "pair"), Solved.load_share),
        "initial_gap": (("position", "pair", "segment"), Solved.initial_gap),
        "transmission_error_amplitude": (("harmonic",), lambda s: 2 * np.abs(_harmonics(s, "transmission_error"))),
        "transmission_error_phase": (("harmonic",), lambda s: np.angle(_harmonics(s, "transmission_error"))),
        "mesh_stiffness_amplitude": (("harmonic",), lambda s: 2 * np.abs(_harmonics(s, "mesh_stiffness"))),
        "mesh_stiffness_phase": (("harmonic",), lambda s: np.angle(_harmonics(s, "mesh_stiffness"))),
    }
)

#: Outputs of ``simulate`` unless told otherwise.
DEFAULT_OUTPUTS = (*(name for name in OUTPUTS if name not in {"load_share", "initial_gap"}), *USUAL)


def output(solved: Solved, name: str) -> tuple[tuple[str, ...], NDArray]:
    """Dimensions and values of an output or response."""
    if name in OUTPUTS:
        dims, compute = OUTPUTS[name]
        return dims, compute(solved)
    return (), response(name).reduce(solved.cycle)


def check_outputs(names: tuple[str, ...]) -> None:
    """Refuse names of neither an output nor a response.

    Raises
    ------
    InputError
        Naming the values allowed.
    """
    for name in names:
        if name not in OUTPUTS and not is_response(name):
            raise InputError("outputs", name, f"allowed: {', '.join([*OUTPUTS, *responses()])}")


def _harmonics(solved: Solved, curve: str) -> NDArray:
    return coefficients(solved.cycle.phases, getattr(solved.cycle, curve))
