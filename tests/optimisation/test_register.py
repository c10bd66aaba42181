"""Designs of a search in its database: what comes back is what was put in, and memory does not grow with them."""

from __future__ import annotations

import gc
import math
import subprocess
import sys
import tomllib
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gearbench import load_study, optimise
from gearbench.optimisation.archive import Archive
from gearbench.optimisation.problem import Evaluation, assignments, gear_key
from gearbench.optimisation.register import BATCH, Register
from gearbench.optimisation.study import Algorithm, Design, OptimisationStudy
from gearbench.optimisation.study_file import parse_study
from tests.support.paths import EXAMPLES, ROOT

EXAMPLE = EXAMPLES / "optimise_small.toml"


def with_a_real_variable() -> OptimisationStudy:
    tables = load_study(EXAMPLE).to_mapping()
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


def answer(study: OptimisationStudy, design: Design, rivals: object = None) -> Evaluation:
    """An evaluation that costs nothing: numbers that follow from the gear, a third of them no gears."""
    u = [byte / 256 for byte in gear_key(study, design)]
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
    register, asked = Register(STUDY), designs(50)
    results = [answer(STUDY, design) for design in asked]
    register.add(1, asked[:20], results[:20])
    register.add(2, asked[20:], results[20:])
    assert len(register) == 50
    assert register.unknown([*asked, *designs(2, seed=1) * 2]) == designs(2, seed=1)
    found = [row for batch in register.batches() for row in batch]
    assert [design for design, _, _ in found] == asked
    assert [list(map(type, design)) for design, _, _ in found] == [list(map(type, design)) for design in asked]
    assert [generation for _, _, generation in found] == [1] * 20 + [2] * 30
    for number, (design, result) in enumerate(zip(asked, results, strict=True)):
        assert register.number(design) == number
        assert register.design(number) == design
        assert repr(register.result(number)) == repr(result) == repr(found[number][1])  # NaN equals NaN there


def test_more_designs_than_are_read_at_a_time():
    register, asked = Register(STUDY), list(dict.fromkeys(designs(BATCH + 10)))
    register.add(1, asked, [answer(STUDY, asked[0])] * len(asked))
    sizes = [len(batch) for batch in register.batches()]
    assert sizes == [BATCH, len(asked) - BATCH]
    assert [design for batch in register.batches() for design, _, _ in batch] == asked


def test_keys_are_equal_for_equal_gears_and_no_others():
    asked = designs(2000)
    gears = {assignments(STUDY, design) for design in asked}
    assert len({gear_key(STUDY, design) for design in asked}) == len(gears)
    tables = tomllib.loads(STUDY.to_toml())
    sets = {"a": {"pair.normal_module": 2}, "b": {"pair.normal_module": 2.0}, "c": {"pair.normal_module": 1.5}}
    tables["variables"]["tool"] = {"sets": sets}
    del tables["base"]["pair"]["normal_module"]
    study = parse_study(tables)
    a, b, c = (gear_key(study, (*asked[0], i)) for i in range(3))
    assert a == b != c


def test_responses_are_kept_of_the_front_only():
    archive = Archive(study=STUDY)
    first, better = [design for design in designs(400) if answer(STUDY, design).feasible][:2]

    def result(design: Design, level: float) -> Evaluation:
        values = np.full((len(STUDY.responses), STUDY.robustness.samples), level)
        return replace(answer(STUDY, design), statistics=(level,) * len(STUDY.statistics), values=values)

    assert archive.add([first], {first: result(first, 2.0)})[0].values is None
    kept = archive.responses(0)
    assert kept is not None
    np.testing.assert_array_equal(kept, result(first, 2.0).values)
    archive.add([better, first], {better: result(better, 1.0)})
    assert archive.front == [1]
    assert archive.responses(0) is None
    assert archive.responses(1) is not None
    np.testing.assert_array_equal([list(row) for row in archive.asked_numbers()][1], [1, 0])


def test_memory_does_not_grow_with_the_designs(monkeypatch):
    """Three thousand designs more are less than 30 bytes each of Python's memory; as objects they were 2 kB each."""
    monkeypatch.setattr("gearbench.optimisation.register.KEYS", 100)
    archive, asked = Archive(study=STUDY), designs(4_000)
    new = {design: answer(STUDY, design) for design in asked[:500]}
    fake = next(iter(new.values()))
    tracemalloc.start()
    try:
        sizes = []
        for begin in range(0, len(asked), 500):
            some = asked[begin : begin + 500]
            archive.add(some, dict.fromkeys(some, fake))
            gc.collect()  # free lists of tuples, too
            sizes.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert len(archive) > 3_900
    assert sizes[-1] - sizes[1] < 30 * (len(archive) - 1_000)


def resident() -> float:
    """Memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads /proc")
def test_memory_is_flat_over_a_search(monkeypatch):
    """Beyond the cache of the database a search of 100 000 designs takes what one of 60 000 does."""
    monkeypatch.setattr("gearbench.optimisation.processes.evaluate", answer)
    monkeypatch.setattr("gearbench.optimisation.register.CACHE", 4_000)
    study = replace(STUDY, algorithm=Algorithm(population=1000, generations=100, seed=2))
    sizes = {}
    dataset = optimise(study, threads=1, progress=lambda state: sizes.update({state.generation: resident()}))
    assert dataset.sizes["design"] > 90_000
    # a search that keeps its designs as objects grows by 80 MB here
    assert sizes[100] - sizes[60] < 2.0, sizes


FULL = """
import resource, signal, sys
from gearbench.errors import GearbenchError
from gearbench.optimisation import register
from tests.optimisation.test_register import STUDY, answer, designs

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
register.CACHE = 10
found, asked = register.Register(STUDY), designs(5000)
try:
    found.add(1, asked, [answer(STUDY, asked[0])] * len(asked))
except GearbenchError as error:
    print(error)
"""


def test_a_full_folder_for_temporary_files_is_one_line():
    done = subprocess.run([sys.executable, "-c", FULL], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stderr == ""
    assert done.stdout.startswith("the folder for temporary files cannot hold the designs of the search (")
    assert done.stdout.count("\n") == 1
