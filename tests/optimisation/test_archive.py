"""Designs of a search: what comes back is what was put in, and what is on disk is theirs or refused."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from hashlib import sha256

import numpy as np

from gearbench import read_study
from gearbench.optimisation.archive import Archive
from gearbench.optimisation.problem import Evaluation, assignments
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.study_file import parse_study
from tests.support.paths import EXAMPLES

EXAMPLE = EXAMPLES / "optimise_small.toml"


def with_a_real_variable() -> OptimisationStudy:
    tables = read_study(EXAMPLE).to_mapping()
    tables["variables"]["width"] = {"paths": ["pair.face_width"], "min": 5.0, "max": 9.0}
    return parse_study(tables)


STUDY = with_a_real_variable()


def designs(count: int, seed: int = 0) -> list[Design]:
    rng = np.random.default_rng(seed)
    columns = [
        rng.uniform(*v.bounds, count).tolist()
        if v.kind == "real"
        else rng.integers(0, int(v.bounds[1]) + 1, count).tolist()
        for v in STUDY.variables
    ]
    return list(zip(*columns, strict=True))


def answer(study: OptimisationStudy, design: Design, incumbents: object = None) -> Evaluation:
    """An evaluation that costs nothing: numbers that follow from the gear, a third of them no gears."""
    u = [byte / 256 for byte in sha256(repr(assignments(study, design)).encode()).digest()]
    feasible = u[0] > 0.3
    x = (float(design[-1]) - 5.0) / 4.0
    known = [(1 + x if "stiffness" in name else 2 - x) + u[1] for name in study.statistics]
    return Evaluation(
        violation=0.0 if feasible else u[0] + 0.1,
        reason="" if feasible else f"contact_pressure {1500 + 100 * u[2]:.4g} above 1500",
        constraints=(*u[3 : 2 + len(study.constraints)], math.nan),
        statistics=tuple(known) if feasible else (math.nan,) * len(known),
        samples=study.robustness.samples if feasible else 0,
    )


def test_what_comes_back_is_what_was_put_in():
    archive, asked = Archive(STUDY), designs(50)
    results = {design: answer(STUDY, design) for design in asked}
    assert repr(archive.add(asked[:20], results)) == repr([results[design] for design in asked[:20]])
    archive.add([*asked[20:], *asked[:5]], results)
    assert len(archive.designs) == 50
    assert archive.unknown([*asked, *designs(2, seed=1) * 2]) == designs(2, seed=1)
    assert archive.first_generations == [1] * 20 + [2] * 30
    assert archive.evaluated == [20, 30]
    np.testing.assert_array_equal(archive.asked[1], [*range(20, 50), *range(5)])
    for number, design in enumerate(asked):
        assert archive.designs[number] == design
        assert repr(archive.results[number]) == repr(results[design])  # NaN equals NaN there


def test_gears_are_equal_whatever_their_numbers_are_written_as():
    asked = designs(1)
    tables = tomllib.loads(STUDY.to_toml())
    sets = {"a": {"pair.normal_module": 2}, "b": {"pair.normal_module": 2.0}, "c": {"pair.normal_module": 1.5}}
    tables["variables"]["tool"] = {"sets": sets}
    del tables["base"]["pair"]["normal_module"]
    study = parse_study(tables)
    a, b, c = (assignments(study, (*asked[0], i)) for i in range(3))
    assert a == b != c


def test_responses_are_kept_of_the_front_only():
    archive = Archive(STUDY)
    first, better = [design for design in designs(400) if answer(STUDY, design).feasible][:2]

    def result(design: Design, level: float) -> Evaluation:
        values = np.full((len(STUDY.responses), STUDY.robustness.samples), level)
        return replace(answer(STUDY, design), statistics=(level,) * len(STUDY.statistics), values=values)

    assert archive.add([first], {first: result(first, 2.0)})[0].values is None
    np.testing.assert_array_equal(archive.responses[0], result(first, 2.0).values)
    archive.add([better, first], {better: result(better, 1.0)})
    assert archive.front == [1]
    assert archive.responses.keys() == {1}


# -- what is on disk ---------------------------------------------------------------------------------------------------
