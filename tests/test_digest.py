"""Files that prove themselves: digests, reports of faults, ``gearbench check``."""

import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from gearbench.errors import InputError
from gearbench.files import seal, unseal
from gearbench.library.garambois2017 import case
from gearbench.results.netcdf import open_result, save
from gearbench.simulation import simulate
from tests.support.explore_designs import front
from tests.support.paths import EXAMPLES, STUDY

ROOT = EXAMPLES.parent


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return save(simulate(case(1)), tmp_path_factory.mktemp("whole") / "case1.nc")


def test_any_flipped_bit_is_refused(result, tmp_path):
    whole, rng = result.read_bytes(), np.random.default_rng(0)
    for at in rng.integers(len(whole) - 82, size=40):
        data = bytearray(whole)
        data[at] ^= 1 << int(rng.integers(4))
        (tmp_path / "damaged.nc").write_bytes(data)
        with pytest.raises(InputError, match=r"damaged\.nc: (is damaged|must be a netCDF file)"):
            open_result(tmp_path / "damaged.nc")


def test_a_result_without_a_digest_is_read_and_a_line_says_so(result, tmp_path, caplog):
    (tmp_path / "bare.nc").write_bytes(unseal(result.read_bytes()))
    assert open_result(tmp_path / "bare.nc").identical(open_result(result))
    line = "bare.nc carries no digest: whether its data are those that were computed is not known"
    assert [message[-len(line) :] for message in caplog.messages] == [line]
    with pytest.raises(InputError, match=r"bare\.nc: carries no digest"):
        open_result(tmp_path / "bare.nc", proven=True)


def test_a_flipped_bit_of_the_data_does_not_rank_another_design_first(run, tmp_path):
    dataset = front(20)
    path = save(dataset, tmp_path / "front.nc")
    data = bytearray(path.read_bytes())
    at = data.index(dataset["mesh_stiffness_rms_mean"].values.tobytes())
    data[at + 6] ^= 0x40  # an exponent: still a number
    path.write_bytes(data)
    assert run("select", path) == (2, "", f"gearbench: {path}: is damaged: its data are not those of its digest\n")


def test_sealed_bytes_are_those_that_were_sealed():
    for data in (b"", b"x", bytes(range(256)), seal(b"twice")):
        assert unseal(seal(data)) == data


def test_other_readers_of_hdf5_take_no_notice_of_the_digest(result):
    with h5py.File(result, "r") as file:
        np.testing.assert_array_equal(file["transmission_error"][...], open_result(result)["transmission_error"])


def test_a_file_that_reaches_for_others_is_refused(tmp_path):
    secret = tmp_path / "secret"
    secret.write_bytes(bytes(80))
    path = tmp_path / "hostile.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("read", (10,), "f8", external=[(str(secret), 0, 80)])
    path.write_bytes(seal(path.read_bytes()))
    with pytest.raises(InputError, match="must hold its data itself"):
        open_result(path)


def test_a_file_that_unpacks_to_very_much_is_refused(tmp_path):
    path = tmp_path / "bomb.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("zeros", (10**11,), "f8", chunks=(10**6,), compression="gzip")
    path.write_bytes(seal(path.read_bytes()))
    with pytest.raises(InputError, match=r"unpack to 100000000000 values"):
        open_result(path)


def test_a_fault_of_the_program_is_one_line_and_a_report(run, tmp_path, monkeypatch):
    import tempfile

    import gearbench.plotting

    def broken(*_, **__):
        raise IndexError("of nothing that\nanybody expected")

    (tmp_path / "reports").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "reports"))
    monkeypatch.setattr(gearbench.plotting, "draw_simulation", broken)
    target = tmp_path / "out.nc"
    code, out, err = run("simulate", EXAMPLES / "case1.toml", "-o", target, "--plots", tmp_path / "plots")
    assert (code, out) == (1, "")
    line = r"gearbench: unexpected IndexError: of nothing that anybody expected; please report it with (.+)\n"
    report = Path(re.fullmatch(line, err)[1]).read_text()
    assert "Traceback" in report
    assert f"-o {target}" in report
    assert "numpy" in report
    assert not list(tmp_path.glob(".*"))


CHECKED = {
    "case1.toml": (EXAMPLES / "case1.toml", "case 1: spur, z 33/75"),
    "study": (STUDY, "study small: 6 variables"),
    "rexs": (ROOT / "tests" / "data" / "stage_1.6.rexs", "REXS 1.6, 10 components"),
    "dataset": (ROOT / "studies" / "s08_contact" / "dataset.nc", "mesh cycle of 20 phases"),
}


@pytest.mark.parametrize("name", CHECKED)
def test_check_says_of_whole_files_that_they_are(run, name):
    path, says = CHECKED[name]
    code, out, err = run("check", path)
    assert (code, err) == (0, "")
    assert out.startswith(f"{path}: whole, {says}")


def test_check_names_each_file_that_is_not_whole(run, result, tmp_path):
    (tmp_path / "cut.nc").write_bytes(result.read_bytes()[:-100])
    (tmp_path / "other.txt").write_text("x")
    code, out, err = run("check", tmp_path / "cut.nc", result, tmp_path / "other.txt", tmp_path / "none.nc")
    assert code == 2
    assert out.startswith(f"{result}: whole, mesh cycle of ")
    assert [line.split(": ")[1] for line in err.splitlines()] == [
        str(tmp_path / n) for n in ("cut.nc", "other.txt", "none.nc")
    ]
    assert err.splitlines()[0].startswith(
        f"gearbench: {tmp_path / 'cut.nc'}: carries no digest, so it is no whole result; as a flank: "
    )
