"""Stored studies for the tests of the explorer, with few or very many designs."""

from functools import cache
from itertools import product

import numpy as np
import xarray as xr

from gearbench.errors import InputError
from gearbench.explore.stored import Stored, of_designs
from gearbench.optimisation.dataset import designs_dataset
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.problem import Evaluation, scene_of
from gearbench.optimisation.study import OptimisationStudy
from gearbench.optimisation.study_file import read_study
from tests.support.paths import STUDY


@cache
def macro_geometries() -> tuple[tuple[int, int, int], ...]:
    """Codes of teeth, addendum and helix angle that make a valid pair."""
    study, found = read_study(STUDY), []
    for code in product((1, 2, 3), (4, 6, 8), (0, 1, 2, 3)):
        try:
            scene_of(study, (*code, 0, 0, 0))
        except InputError:
            continue
        found.append(code)
    return tuple(found)


def front(count: int, seed: int = 0, study: OptimisationStudy | None = None) -> xr.Dataset:
    """Random designs of the small example with invented results; the last one is not a valid pair.

    Further variables of ``study`` have their first value in the first design and their second value in all others.
    """
    study = study or read_study(STUDY)
    random = np.random.default_rng(seed)
    macro = np.array(macro_geometries())
    codes = np.column_stack([macro[random.integers(len(macro), size=count)], random.integers(0, (8, 6, 6), (count, 3))])
    more = np.ones((count, len(study.variables) - codes.shape[1]), dtype=int)
    more[:1] = 0
    codes = np.hstack([codes, more])
    k = 6 + 12 * random.beta(2, 3, count)
    ste = 6 / k + random.gamma(2, 0.3, count)
    statistics = np.column_stack([k, 0.1 * k, 1.3 * k, ste, 0.15 * ste, 1.5 * ste])
    limits = random.uniform((1.1, 0.5, 600, 100), (2, 2.5, 1500, 400), size=(count, 4))
    results = [
        Evaluation(violation=0.0, reason="", constraints=tuple(c), statistics=tuple(s))
        for c, s in zip(limits, statistics, strict=True)
    ]
    results[-1] = Evaluation(violation=1.0, reason="no", constraints=(1.0,) * 4, statistics=(np.nan,) * 6)
    dataset = designs_dataset(study, [tuple(map(int, c)) for c in codes], results, [1] * count)
    on_front = np.zeros(count, dtype="int8")
    on_front[: count - 1] = non_dominated(np.column_stack([k, ste])[:-1]) if count < 5000 else 0
    dataset["on_front"] = ("design", on_front)
    return dataset


def stored(count: int, seed: int = 0) -> Stored:
    """The ``front`` as the explorer stores it."""
    return of_designs(Designs(front(count, seed)), "front.nc")
