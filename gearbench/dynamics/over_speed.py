"""Response over a range of speeds as one number: RMS of the fluctuating mesh force of a scene or of error samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.batch import BatchSolution
from gearbench.dynamics.analysis import GROWTH_TOLERANCE, growth, spans
from gearbench.dynamics.balance import Excitation
from gearbench.dynamics.model import Group, Model
from gearbench.dynamics.scatter import BLOCK, OWN_FREQUENCY, excitation, force_rms
from gearbench.errors import GearbenchError, InputError
from gearbench.robustness.montecarlo import RobustProblem
from gearbench.scene import Scene


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceOverSpeed:
    """RMS of the fluctuating mesh force over time and over all speeds, at one torque.

    Parameters
    ----------
    scene
        A scene with a system.
    speeds
        Speeds of the pinion (speed,) [1/min].
    harmonics
        Number of orders of the mesh frequency.
    """

    scene: Scene
    speeds: NDArray
    harmonics: int

    @cached_property
    def model(self) -> Model:
        """Dynamic model of the scene."""
        return Model(scene=self.scene)

    @cached_property
    def group(self) -> Group:
        """Group of the pair: the meshes that share its mesh frequency.

        Raises
        ------
        InputError
            If a second mesh shares the mesh frequency, or the centre distance has random errors.
        GearbenchError
            If the motion without scatter grows at one of the speeds, so that there is no steady force.
        """
        model, errors = self.model, self.scene.effect("manufacturing_errors")
        group = model.groups[0]
        if getattr(errors, "centre_distance", None) is not None:
            key = "effects.manufacturing_errors.centre_distance"
            raise InputError(key, "given", "is not supported: forces over speed need a fixed centre distance")
        if len(group.meshes) > 1:
            raise InputError("system.meshes", ", ".join(model.names[i] for i in group.meshes), OWN_FREQUENCY)
        if (grows := growth(model, group, self.speeds, self.harmonics) > 1 + GROWTH_TOLERANCE).any():
            raise GearbenchError(f"no steady response at {spans(self.speeds, grows)} 1/min: parametric instability")
        return group

    def of_samples(self, problem: RobustProblem, solution: BatchSolution) -> NDArray:
        """RMS (sample,) [N] of a chunk of samples; ``solution`` must include segment forces."""
        return self._rms(excitation(self.model.loaded_meshes[0], problem, solution, self.harmonics))

    def _rms(self, samples: Excitation) -> NDArray:
        """RMS over time and all speeds (sample,) [N]."""
        squares = np.zeros(len(samples.motion))
        for first in range(0, len(self.speeds), BLOCK):
            values = force_rms(self.model, self.group, [samples], self.speeds[first : first + BLOCK])
            squares += (values**2).sum(axis=0)
        return np.sqrt(squares / len(self.speeds))

    @cached_property
    def without_errors(self) -> float:
        """RMS [N] of the scene without errors."""
        mesh = self.model.loaded_meshes[0]
        without_errors = mesh.flanks.excitation(mesh.waves(2 * self.harmonics))
        return float(self._rms(without_errors.part(None))[0])  # None adds the axis of samples
