"""The commands, programs and files of docs/exchange.md do what the page says."""

import re
import shutil

import pytest
import xarray as xr

from gearbench.scene_file import read_scene
from tests.support import pages
from tests.support.pages import run_command
from tests.support.paths import ROOT


def blocks(language: str) -> list[str]:
    return [block.text for block in pages.blocks("exchange.md", language)]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the gearbox, as the reader has it; the current one."""
    shutil.copy(ROOT / "tests" / "data" / "sew_3_stage_cylindrical_gearbox_1.0.rexs", tmp_path / "gearbox.rexs")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NO_COLOR", "1")
    return tmp_path


def run(line: str) -> None:
    assert run_command(line) == 0, line


def test_commands_run_one_after_the_other(folder, capsys):
    lines = [line for text in blocks("sh") for line in text.splitlines()]
    assert len(lines) == 6
    for line in lines:
        run(line)
    assert (folder / "gearbox_with_results.rexs").stat().st_size > (folder / "gearbox.rexs").stat().st_size
    assert read_scene(folder / "stage2.toml").pair.pinion.teeth == 13


@pytest.mark.parametrize("number", range(len(blocks("python"))))
def test_programs_run(folder, number):
    text = blocks("python")[number]
    if "fem_reference" in text:
        pytest.importorskip("gmsh", exc_type=ImportError)
    exec(compile(text, "docs/exchange.md", "exec"), {})
    if "pinion.vtu" in text:
        assert (folder / "pinion.vtu").stat().st_size > 1000


def test_names_in_the_matlab_example_are_in_the_file(folder):
    run("gearbench simulate gearbox.rexs --stage 2 -q -o stage2.nc")
    dataset = xr.load_dataset(folder / "stage2.nc", engine="h5netcdf")
    for name in re.findall(r"ncread\('stage2.nc', '(\w+)'\)", blocks("matlab")[0]):
        assert dataset[name].dims == ("position",)
