"""Error samples of a design: their responses, those of the mesh cycle and the force over speed."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.optimisation.study import OptimisationStudy
from gearbench.results.responses import is_over_speed
from gearbench.results.solved import Solved
from gearbench.robustness.sampling import Sampler, unit_samples
from gearbench.scene import Scene
from gearbench.schema import changed

if TYPE_CHECKING:
    from gearbench.dynamics.over_speed import ForceOverSpeed


def sampled(
    study: OptimisationStudy, scene: Scene, rough: Solved | None = None
) -> tuple[NDArray, Callable[[NDArray], NDArray]]:
    """Errors of all samples (sample, error) [µm], and what responds to some of them: (response, sample).

    Responses are in the order of ``study.responses``. ``rough`` is the scene at the mesh phases of its error samples,
    where it was solved there. An interruption raises ``KeyboardInterrupt``.
    """
    from gearbench.robustness.montecarlo import prepare_scene, respond

    r, kinds = study.robustness, scene.effect("manufacturing_errors")
    assert isinstance(kinds, ManufacturingErrors)
    errors = kinds.draw(_unit(r.sampler, r.samples, len(kinds.error_modes(scene.pair)), r.seed), scene.pair)
    of_cycle, forces = cycle_responses(study), _forces(study, scene)
    problem = prepare_scene(scene, rough) if of_cycle else None
    # the dynamics takes its samples of the contact from those of the cycle, where they are the same
    shared = [force for force in forces if problem is not None and force.shares(scene)]

    def answer(some: NDArray) -> NDArray:
        found, parts = {}, []
        if problem is not None:
            more = {f"{number}": force.of_cycles for number, force in enumerate(shared)}
            answers, complete = respond(problem, some, names=of_cycle, more=more)
            if not complete:
                raise KeyboardInterrupt
            found, parts = {name: answers[name] for name in of_cycle}, [answers[name] for name in more]
        parts += [force.of_samples(some) for force in forces if force not in shared]
        if forces:
            found["mesh_force"] = np.sqrt(np.mean(np.square(parts), axis=0))
        return np.array([found[name] for name in study.responses])

    return errors, answer


def cycle_responses(study: OptimisationStudy) -> list[str]:
    """Responses of the study that a mesh cycle has."""
    return [name for name in study.responses if not is_over_speed(name)]


def force_without_errors(study: OptimisationStudy, scene: Scene) -> float:
    """``mesh_force`` of a scene itself [N]."""
    return float(np.sqrt(np.mean([force.without_errors() ** 2 for force in _forces(study, scene)])))


def _forces(study: OptimisationStudy, scene: Scene) -> tuple[ForceOverSpeed, ...]:
    """The force over speed at each torque, where it is asked for."""
    if (speeds := study.speeds) is None:
        return ()
    from gearbench.dynamics.over_speed import ForceOverSpeed

    loads = [changed(scene.load, torque=torque) for torque in speeds.torques] or [scene.load]
    scenes = (changed(scene, load=load) for load in loads)
    return tuple(ForceOverSpeed(scene=one, speeds=speeds.values, harmonics=speeds.harmonics) for one in scenes)


@lru_cache(maxsize=16)
def _unit(sampler: Sampler, samples: int, dimension: int, seed: int) -> NDArray:
    """Samples of the unit cube, the same for every design."""
    unit = unit_samples(sampler, samples, dimension, seed)
    unit.flags.writeable = False
    return unit
