"""Error samples of a design under one load: their responses, those of the mesh cycle and the force over speed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.study import OptimisationStudy
from gearbench.results.responses import is_over_speed
from gearbench.scene import Scene

if TYPE_CHECKING:
    from gearbench.dynamics.over_speed import ForceOverSpeed
    from gearbench.robustness.montecarlo import RobustProblem


@dataclass(frozen=True, kw_only=True)
class Forces:
    """The force over the speeds of a study, of a design under each of its loads; found once.

    Parameters
    ----------
    study
        The study.
    known
        By torque [N·m].
    """

    study: OptimisationStudy
    known: dict[float, ForceOverSpeed] = field(default_factory=dict)

    @property
    def wanted(self) -> bool:
        """Whether an objective names it."""
        return any(map(is_over_speed, self.study.responses))

    def of(self, scene: Scene) -> ForceOverSpeed | None:
        """That of the design under one load, where an objective names it."""
        return self._of(scene) if self.wanted else None

    def without_errors(self, scene: Scene) -> float:
        """``mesh_force`` of the design itself under one load [N]."""
        return self._of(scene).without_errors

    def _of(self, scene: Scene) -> ForceOverSpeed:
        from gearbench.dynamics.over_speed import ForceOverSpeed

        speeds, torque = self.study.speeds, scene.load.torque
        assert speeds is not None
        if torque not in self.known:
            self.known[torque] = ForceOverSpeed(scene=scene, speeds=speeds.values, harmonics=speeds.harmonics)
        return self.known[torque]


def cycle_responses(study: OptimisationStudy) -> list[str]:
    """Responses of the study that a mesh cycle has."""
    return [name for name in study.responses if not is_over_speed(name)]


def sample_responses(
    study: OptimisationStudy, problem: RobustProblem, force: ForceOverSpeed | None, errors: NDArray
) -> NDArray:
    """Responses of the study to ``errors`` (sample, error) [µm] under one load, (response, sample).

    ``force`` where it is one of them. An interruption raises ``KeyboardInterrupt``.
    """
    from gearbench.robustness.montecarlo import respond

    more = {} if force is None else {"mesh_force": force.of_cycles}
    answers, complete = respond(problem, errors, names=cycle_responses(study), more=more)
    if not complete:
        raise KeyboardInterrupt
    return np.array([answers[name] for name in study.responses])
