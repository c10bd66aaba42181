"""From a contact solution to the variables of a Dataset: what was asked for is computed, nothing else."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import total_gap
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.cycle import peak_to_peak
from gearbench.geometry.action import ContactLines
from gearbench.scene import Scene

MICROMETRES = 1e3  # per mm


@dataclass(frozen=True, kw_only=True)
class Solved:
    """A scene solved on its contact lines: what outputs are made of."""

    scene: Scene
    lines: ContactLines
    weight: NDArray
    problem: ContactProblem
    solution: ContactSolution

    @property
    def transmission_error(self) -> NDArray:
        """δ = δ_n / cos β_b, (position,) [µm]."""
        return MICROMETRES * self.solution.approach / math.cos(self.scene.pair.base_helix_angle)

    @property
    def mesh_stiffness(self) -> NDArray:
        """k = ∂F_t/∂δ = ∂F_n/∂δ_n · cos²β_b, (position,) [N/µm]."""
        return self.solution.stiffness / MICROMETRES * math.cos(self.scene.pair.base_helix_angle) ** 2

    def peak_to_peak(self, values: NDArray) -> float:
        """Peak-to-peak value over the mesh cycle of a variable (position,), its transitions included."""
        return peak_to_peak(self.lines.mesh_phase, values, self.scene.resolution.panel_size)

    def line_load(self) -> NDArray:
        """Line load, (position, pair, segment) [N/mm]; zero where a pair has no contact line."""
        length = np.where(self.lines.active, self.lines.length, 1.0)
        return self.solution.force / length[..., None] / self.lines.lever

    def load_share(self) -> NDArray:
        """Share of each pair in the normal force, (position, pair)."""
        return self.solution.force.sum(axis=2) / self.solution.force.sum(axis=(1, 2))[:, None]

    def initial_gap(self) -> NDArray:
        """Initial gap e, (position, pair, segment) [µm]."""
        return MICROMETRES * total_gap(self.scene, self.lines)


def mean(values: NDArray, weight: NDArray) -> NDArray:
    """Mean over the mesh cycle, last axis."""
    return values @ weight


def fluctuation_rms(values: NDArray, weight: NDArray) -> NDArray:
    """RMS over the mesh cycle of the deviation from the mean, last axis."""
    return np.sqrt(mean((values - mean(values, weight)[..., None]) ** 2, weight))


def relative_rms(values: NDArray, weight: NDArray) -> NDArray:
    """RMS over the mesh cycle of the relative deviation from the mean, last axis [%]."""
    return 100 * fluctuation_rms(values, weight) / mean(values, weight)


def cycle_numbers(ste: NDArray, stiffness: NDArray, weight: NDArray) -> NDArray:
    """The four numbers ``accuracy.measure.MEASURED`` of cycles (…, position): mean and RMS, in their order, (4, …)."""
    return np.array(
        [
            mean(ste, weight),
            fluctuation_rms(ste, weight),
            mean(stiffness, weight),
            relative_rms(stiffness, weight),
        ]
    )


#: Output → (dimensions, how to compute it). ``simulate`` computes the ones it is asked for.
OUTPUTS: Mapping[str, tuple[tuple[str, ...], Callable[[Solved], NDArray]]] = MappingProxyType(
    {
        "transmission_error": (("position",), lambda s: s.transmission_error),
        "mesh_stiffness": (("position",), lambda s: s.mesh_stiffness),
        "line_load": (("position", "pair", "segment"), Solved.line_load),
        "load_share": (("position", "pair"), Solved.load_share),
        "initial_gap": (("position", "pair", "segment"), Solved.initial_gap),
        "transmission_error_mean": ((), lambda s: mean(s.transmission_error, s.weight)),
        "transmission_error_rms": ((), lambda s: fluctuation_rms(s.transmission_error, s.weight)),
        "transmission_error_peak_to_peak": ((), lambda s: s.peak_to_peak(s.transmission_error)),
        "mesh_stiffness_mean": ((), lambda s: mean(s.mesh_stiffness, s.weight)),
        "mesh_stiffness_rms": ((), lambda s: relative_rms(s.mesh_stiffness, s.weight)),
        "mesh_stiffness_peak_to_peak": ((), lambda s: s.peak_to_peak(s.mesh_stiffness)),
    }
)

#: What ``simulate`` computes unless told otherwise.
DEFAULT_OUTPUTS = tuple(name for name in OUTPUTS if name not in {"load_share", "initial_gap"})
