"""NSGA-II and NSGA-III with mixed variables (pymoo), as an ask-and-tell interface.

The search evaluates nothing itself. The study and the results told so far determine which designs it asks for next. An
interrupted run relies on this to continue.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.errors import GearbenchError
from gearbench.optimisation.problem import Evaluation, assignments
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.variables import Variable

if TYPE_CHECKING:
    from pymoo.core.duplicate import DuplicateElimination

#: Largest number of attempts to fill a generation with designs that are not yet in the population.
ATTEMPTS = 20
#: Distribution index η of the polynomial mutation (Deb) of real variables and of indices into a grid. A smaller index
#: means larger mutations: rounding to the next index would undo small ones.
REAL_ETA, GRID_ETA = 20, 3


class Search:
    """Search of a study, one generation after the other.

    Parameters
    ----------
    study
        The study.
    """

    def __init__(self, study: OptimisationStudy) -> None:
        self._study = study
        try:
            self._algorithm = _algorithm(study, self._gear_set)
        except ImportError:
            raise GearbenchError("optimise needs pymoo: install the extra gearbench[optimise]") from None
        self._asked: Any = None

    def _design(self, individual: Any) -> Design:
        """Design of an individual, as pymoo calls a member of the population."""
        X = individual.X
        return tuple(float(X[v.name]) if v.kind == "real" else int(X[v.name]) for v in self._study.variables)

    def _gear_set(self, individual: Any) -> Hashable:
        """Keys and values that describe the gear set of an individual; cached, since it is compared with all others."""
        if "gear" not in individual.data:
            individual.data["gear"] = assignments(self._study, self._design(individual))
        return individual.data["gear"]

    def ask(self) -> list[Design]:
        """Designs of the next generation; fewer than the population, or none, once the design space is exhausted."""
        self._asked = self._algorithm.ask()
        return [] if self._asked is None else [self._design(i) for i in self._asked]

    def tell(self, results: Sequence[Evaluation]) -> None:
        """Tell the results of the designs last asked for, in their order."""
        for individual, result in zip(self._asked, results, strict=True):
            # pymoo's names: objectives F, constraint G (met if ≤ 0), equality constraints H (none);
            # pymoo never compares the objectives of infeasible designs
            worst = (math.inf,) * len(self._study.objectives)
            individual.set("F", np.array(result.objectives(self._study) if result.feasible else worst))
            individual.set("G", np.array([result.violation]))
            individual.set("H", np.empty(0))
            individual.evaluated = {"F", "G", "H"}
        self._algorithm.tell(infills=self._asked)

    @property
    def population(self) -> list[Design]:
        """Designs that survived the last generation."""
        return [self._design(individual) for individual in self._algorithm.pop]


def _algorithm(study: OptimisationStudy, gear_set_of: Callable[[Any], Hashable]) -> Any:
    """Algorithm of pymoo, ready for its first generation; ``gear_set_of`` maps an individual to its gear set."""
    from pymoo.algorithms.moo.nsga2 import NSGA2, binary_tournament
    from pymoo.algorithms.moo.nsga3 import NSGA3, comp_by_cv_then_random
    from pymoo.core.mixed import MixedVariableMating, MixedVariableSampling
    from pymoo.core.problem import Problem
    from pymoo.core.variable import Choice, Integer, Real
    from pymoo.operators.crossover.sbx import SBX
    from pymoo.operators.crossover.ux import UX
    from pymoo.operators.mutation.pm import PM
    from pymoo.operators.mutation.rm import ChoiceRandomMutation
    from pymoo.operators.repair.rounding import RoundingRepair
    from pymoo.operators.selection.tournament import TournamentSelection
    from pymoo.termination.max_gen import MaximumGenerationTermination

    def pymoo_variable(variable: Variable) -> Real | Integer | Choice:
        if variable.kind == "choice":
            return Choice(options=list(range(int(variable.bounds[1]) + 1)))
        return (Real if variable.kind == "real" else Integer)(bounds=variable.bounds)

    duplicates = _same_gear_set(gear_set_of)
    # Any: the types that pyright infers from the defaults of pymoo are too narrow
    make_mating: Any = MixedVariableMating
    is_nsga3 = study.algorithm.method == "nsga3"
    make_algorithm: Any = partial(NSGA3, ref_dirs=_directions(study)) if is_nsga3 else NSGA2
    mating = make_mating(
        selection=TournamentSelection(func_comp=comp_by_cv_then_random if is_nsga3 else binary_tournament),
        crossover={Real: SBX(), Integer: SBX(vtype=float, repair=RoundingRepair()), Choice: UX()},
        mutation={
            Real: PM(eta=REAL_ETA),
            Integer: PM(eta=GRID_ETA, vtype=float, repair=RoundingRepair()),
            Choice: ChoiceRandomMutation(),
        },
        eliminate_duplicates=duplicates,
        n_max_iterations=ATTEMPTS,
    )
    algorithm = make_algorithm(
        pop_size=study.algorithm.population,
        sampling=MixedVariableSampling(),
        mating=mating,
        eliminate_duplicates=duplicates,
        output=None,
    )
    algorithm.termination = MaximumGenerationTermination(study.algorithm.generations)
    problem = Problem(
        vars={variable.name: pymoo_variable(variable) for variable in study.variables},
        n_obj=len(study.objectives),
        n_ieq_constr=1,
    )
    algorithm.setup(problem, seed=study.algorithm.seed)
    return algorithm


def _directions(study: OptimisationStudy) -> np.ndarray:
    """Reference directions of Das & Dennis 1998, (direction, objective); at most as many as the population."""
    from pymoo.util.ref_dirs import get_reference_directions

    count, partitions = len(study.objectives), 1
    # with one more partition there are C(count + partitions, partitions + 1) directions
    while math.comb(count + partitions, partitions + 1) <= study.algorithm.population:
        partitions += 1
    return np.asarray(get_reference_directions("das-dennis", count, n_partitions=partitions))


def _same_gear_set(gear_set_of: Callable[[Any], Hashable]) -> DuplicateElimination:
    """Duplicate elimination by gear set: two designs with different variables may be the same gear set."""
    from pymoo.core.duplicate import DuplicateElimination

    class SameGearSet(DuplicateElimination):
        def _do(self, pop: Any, other: Any, is_duplicate: np.ndarray) -> np.ndarray:
            seen = set() if other is None else {gear_set_of(individual) for individual in other}
            for i, individual in enumerate(pop):
                gear_set = gear_set_of(individual)
                is_duplicate[i] |= gear_set in seen
                if other is None:
                    seen.add(gear_set)
            return is_duplicate

    return SameGearSet()
