"""Files are written whole or not at all, whatever comes between."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
import xarray as xr

from gearbench.errors import InputError
from gearbench.files import file_parts, replacing, write_bytes, write_text
from gearbench.results.netcdf import open_result, save
from tests.attack.mutations import NAMES
from tests.support.explore_designs import front
from tests.support.paths import EXAMPLES, ROOT


def refuse(*_: object, **__: object) -> None:
    raise OSError(28, "No space left on device")


def test_text_and_bytes_arrive_and_replace_what_was_there(tmp_path):
    for content in ("first µ\n", "second"):
        assert write_text(tmp_path / "a.txt", content) == tmp_path / "a.txt"
        assert (tmp_path / "a.txt").read_bytes() == content.encode()
    write_bytes(tmp_path / "b", b"\0\xff\r\n")
    assert (tmp_path / "b").read_bytes() == b"\0\xff\r\n"
    assert sorted(os.listdir(tmp_path)) == ["a.txt", "b"]


def test_a_new_file_has_the_rights_of_any_other(tmp_path):
    (tmp_path / "plain").write_text("")
    assert write_text(tmp_path / "ours", "").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("fault", [KeyboardInterrupt(), RuntimeError("in between"), OSError(28, "No space left")])
@pytest.mark.parametrize("before", [None, "before"])
def test_what_fails_or_is_interrupted_leaves_neither_half_a_file_nor_a_rest(tmp_path, fault, before):
    path = tmp_path / "file.txt"
    if before:
        path.write_text(before)

    def write() -> None:
        with replacing(path) as part:
            part.write_text("half of")
            raise fault

    with pytest.raises(type(fault)):
        write()
    assert [p.read_text() for p in tmp_path.iterdir()] == ([before] if before else [])


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_a_disk_that_fails_at_the_end_leaves_the_earlier_file(tmp_path, monkeypatch, step):
    path = write_text(tmp_path / "file.txt", "before")
    monkeypatch.setattr(*((os, "fsync") if step == "fsync" else (Path, "replace")), refuse)
    with pytest.raises(OSError, match=re.escape(str(path))):
        write_text(path, "after")
    monkeypatch.undo()
    assert [p.read_text() for p in tmp_path.iterdir()] == ["before"]


#: Refuses new files to everyone, the administrator too.
SEALED = Path("/proc")


@pytest.mark.skipif(not SEALED.is_dir(), reason="no /proc on this system")
def test_a_folder_that_refuses_is_bad_input():
    with pytest.raises(InputError, match=r"^output = /proc/a\.txt: the folder /proc is not writable"):
        write_text(SEALED / "a.txt", "")


@pytest.fixture
def stored(tmp_path):
    save(front(30), tmp_path / "front.nc")
    return tmp_path / "front.nc"


GEARBOX = ROOT / "tests" / "data" / "sew_3_stage_cylindrical_gearbox_1.0.rexs"


def test_commands_leave_nothing_where_the_disk_is_full(run, stored, tmp_path, monkeypatch):
    out = tmp_path / "out"
    out.mkdir()
    monkeypatch.setattr(os, "fsync", refuse)
    for arguments in (
        ("select", stored, "--csv", out / "a.csv", "--markdown", out / "a.md"),
        ("select", stored, "--export", 1, out / "a.toml"),
        ("rexs", GEARBOX, "--scene", 2, out / "a.toml"),
        ("simulate", EXAMPLES / "sc.toml", "--plots", out),
    ):
        code, _, err = run(*arguments)
        assert code == 1, arguments
        assert "No space left on device" in err
        assert list(out.iterdir()) == [], arguments


#: Names that are no names of files, or of files elsewhere.
HOSTILE = [*NAMES, "..", "C:\\x", "nul\0byte", "x" * 300, "齿" * 300, "CON", "con", "_"]


def test_any_name_becomes_a_file_in_its_folder(tmp_path):
    parts = file_parts(HOSTILE)
    assert len({part.casefold() for part in parts}) == len(HOSTILE)
    for part in parts:
        path = write_text(tmp_path / f"campbell_{part}.png", "x")
        assert path.parent == tmp_path
        assert path.resolve().parent == tmp_path.resolve()
    assert len(list(tmp_path.iterdir())) == len(HOSTILE)
    assert file_parts(["pair", "Pumpe-2", "Stufe Ä"]) == ["pair", "Pumpe-2", "Stufe_Ä"]


def test_names_of_results_that_are_joined_keep_their_length(tmp_path):
    rows = [xr.Dataset(coords={"name": ("row", [name])}) for name in ("SC", "e_drive_input")]
    joined = xr.concat([open_result(save(each, tmp_path / f"{i}.nc")) for i, each in enumerate(rows)], "row")
    assert open_result(save(joined, tmp_path / "both.nc"))["name"].values.tolist() == ["SC", "e_drive_input"]
