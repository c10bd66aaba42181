"""What a search will cost: one of its designs on trials, as often as the search asks for designs."""

from __future__ import annotations

from dataclasses import dataclass

from gearbench.effects.gear_body import GearBody
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.forecast import ACCURACY, Forecast
from gearbench.effort.plan import plan
from gearbench.errors import GearbenchError, InputError
from gearbench.optimisation.polish import EVALUATIONS
from gearbench.optimisation.problem import scene_of
from gearbench.optimisation.search import Search
from gearbench.optimisation.study import OptimisationStudy
from gearbench.optimisation.verify import reference_study
from gearbench.scene import Scene
from gearbench.threads import default_threads


@dataclass(frozen=True, kw_only=True)
class StudyPlan:
    """Cost of a search, at most: designs that are no gears, or are asked for again, cost nothing.

    Parameters
    ----------
    designs
        Designs that it asks for.
    threads
        Designs side by side.
    design_seconds, seconds
        Predicted time of a design and of the search on this machine [s].
    megabytes
        Predicted peak memory of all threads [MB].
    others
        Of a design that is polished, and of one that is verified.
    """

    designs: int
    threads: int
    design_seconds: float
    seconds: float
    megabytes: float
    others: tuple[Forecast, ...] = ()


def study_plan(study: OptimisationStudy, threads: int | None = None) -> StudyPlan:
    """Plan of ``optimise`` for ``study``, from the first design of its search that is a gear.

    Raises
    ------
    GearbenchError
        If none of the first generation is.
    """
    scene, threads = _first_gear(study), threads or default_threads()
    samples = study.robustness.samples
    made = plan(scene, samples or 1, threads=1)
    seconds = made.robust_seconds if samples else made.seconds
    designs = study.algorithm.population * study.algorithm.generations
    others = (_polish(seconds, made.megabytes), _verify(study, scene, seconds, made.megabytes))
    return StudyPlan(
        designs=designs,
        threads=threads,
        design_seconds=seconds,
        seconds=designs * seconds / threads,
        megabytes=threads * made.megabytes,
        others=tuple(each for each in others if each is not None),
    )


def _polish(seconds: float, megabytes: float) -> Forecast:
    size = f"a design, {EVALUATIONS} evaluations"
    return Forecast(command="polish", size=size, seconds=EVALUATIONS * seconds, megabytes=megabytes)


def _verify(study: OptimisationStudy, scene: Scene, seconds: float, megabytes: float) -> Forecast | None:
    """Finite elements of a macro-geometry, and one design with them."""
    try:
        effects = reference_study(study, ACCURACY).base["effects"]
        beside = {GearBody.name: GearBody()} if GearBody.name in effects else {}
        tooth = ToothBending(**effects[ToothBending.name])
        meshed = tooth.preparation(scene.pair, beside) or 0.0
        need = max(tooth.preparation_memory(scene.pair, beside) / 1e6, megabytes)
    except (InputError, GearbenchError):  # it says so itself
        return None
    size = f"a macro-geometry with one design, finite elements of {100 * ACCURACY:g} %"
    return Forecast(command="verify", size=size, seconds=meshed + seconds, megabytes=need)


def _first_gear(study: OptimisationStudy) -> Scene:
    reason: InputError | None = None
    for design in Search(study).ask():
        try:
            return scene_of(study, design)
        except InputError as error:
            reason = error
    raise GearbenchError(f"none of the first {study.algorithm.population} designs is a gear, the last one: {reason}")
