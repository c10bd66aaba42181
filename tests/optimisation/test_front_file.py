"""The file of a finished search: it holds what the Dataset does, and memory does not grow with the designs."""

from __future__ import annotations

import subprocess
import sys
import tracemalloc
from dataclasses import replace

import pytest
import xarray as xr

from gearbench.optimisation import dataset, front_file, register
from gearbench.optimisation.archive import Archive
from gearbench.optimisation.dataset import front_dataset
from gearbench.optimisation.front_file import write_front
from gearbench.optimisation.study import Algorithm, OptimisationStudy
from gearbench.optimisation.variables import Variable
from gearbench.results.netcdf import load, reading
from tests.optimisation.test_register import STUDY as SMALL
from tests.optimisation.test_register import answer, designs
from tests.support.paths import ROOT

STUDY = replace(SMALL, algorithm=Algorithm(population=2000, generations=3, seed=1))


def searched(study: OptimisationStudy, count: int) -> Archive:
    """A search of some generations, the last one of designs that are known."""
    archive, asked = Archive(study=study), designs(count)
    for some in (asked[: count // 2], asked[count // 2 :], asked[:10]):
        archive.add(some, {design: answer(study, design) for design in archive.unknown(some)})
    return archive


@pytest.mark.parametrize("count", [30, 1000])
def test_the_file_is_the_dataset_whatever_is_written_at_a_time(tmp_path, monkeypatch, count):
    monkeypatch.setattr(register, "BATCH", 70)
    archive = searched(STUDY, count)
    population = [archive.design(i) for i in range(min(len(archive), 10))]
    expected = front_dataset(archive, population, 1.0)
    monkeypatch.setattr(dataset, "ROWS", 33)
    path = write_front(archive, population, 1.0, tmp_path / "front.nc")
    found = load(path)
    xr.testing.assert_identical(found.drop_attrs(), expected.drop_attrs())
    assert {k: v for k, v in found.attrs.items() if k != "created"} == {
        k: v for k, v in expected.attrs.items() if k != "created"
    }
    with reading(path) as lazily:
        xr.testing.assert_identical(lazily.drop_attrs(), expected.drop_attrs())


def test_values_of_a_list_are_of_one_kind_in_all_parts(tmp_path, monkeypatch):
    """The first part holds whole numbers only, a later one a half."""
    mixed = Variable(name="pair.face_width", paths=("pair.face_width",), values=(8, 9, 9.5))
    study = replace(STUDY, variables=(*STUDY.variables[:-1], mixed))
    archive = Archive(study=study)
    some = [(*design[:-1], min(i // 3, 2)) for i, design in enumerate(designs(9))]
    archive.add(some, {design: answer(study, design) for design in archive.unknown(some)})
    monkeypatch.setattr(register, "BATCH", 3)
    found = load(write_front(archive, some[:1], 1.0, tmp_path / "front.nc"))
    assert set(found["pair.face_width"].values[-1:]) == {9.5}
    xr.testing.assert_identical(found.drop_attrs(), front_dataset(archive, some[:1], 1.0).drop_attrs())


def test_memory_does_not_grow_with_the_designs(tmp_path, monkeypatch):
    """Less than 60 bytes a design, as Datasets 300 and more: numbers of the generations, and what is on the front."""
    monkeypatch.setattr(register, "BATCH", 100)
    monkeypatch.setattr(dataset, "ROWS", 100)
    monkeypatch.setattr(front_file, "BLOCK", 1000)
    peaks = {}
    for count in (500, 2000):
        archive = searched(STUDY, count)
        write_front(archive, [], 1.0, tmp_path / "front.nc")  # modules are loaded
        tracemalloc.start()
        try:
            write_front(archive, [], 1.0, tmp_path / "front.nc")
            peaks[count] = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
    assert peaks[2000] - peaks[500] < 60 * 1500, peaks


FULL = """
import resource, signal, sys
from pathlib import Path
from gearbench.optimisation.front_file import write_front
from tests.optimisation.test_front_file import STUDY, searched

archive = searched(STUDY, 400)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
try:
    write_front(archive, [], 1.0, Path(sys.argv[1]) / "front.nc")
except OSError as error:
    print(error.strerror)
"""


@pytest.mark.parametrize("limit", [3000, 60_000])
def test_a_full_disk_is_told_and_the_file_before_is_left(tmp_path, limit):
    (tmp_path / "front.nc").write_bytes(b"before")
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(tmp_path), str(limit)],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert (done.stdout, done.stderr) == ("File too large\n", "")
    assert [path.name for path in tmp_path.iterdir()] == ["front.nc"]
    assert (tmp_path / "front.nc").read_bytes() == b"before"


def test_blocks_of_any_size_make_the_same_digest(tmp_path, monkeypatch):
    archive = searched(STUDY, 30)
    monkeypatch.setattr(front_file, "BLOCK", 7)
    assert load(write_front(archive, [], 1.0, tmp_path / "front.nc")).sizes["design"] == len(archive)
