"""The digest in stored Datasets."""

from functools import partial

import numpy as np
import pytest
import xarray as xr

from gearbench.errors import InputError
from gearbench.library.garambois2017 import case
from gearbench.results.netcdf import open_result, save
from gearbench.simulation import simulate
from tests.support.explore_designs import front
from tests.support.paths import EXAMPLES


@pytest.mark.parametrize("made", [partial(simulate, case(1)), partial(front, 20)], ids=["cycle", "front"])
def test_a_dataset_survives_its_file(made, tmp_path, caplog):
    dataset = made()
    path = save(dataset, tmp_path / "whole.nc")
    assert open_result(path).equals(dataset)
    assert save(open_result(path), tmp_path / "again.nc").stat().st_size == path.stat().st_size
    again = xr.load_dataset(path, engine="h5netcdf")
    again.to_netcdf(tmp_path / "by_xarray.nc", engine="h5netcdf")
    assert open_result(tmp_path / "by_xarray.nc").equals(dataset)
    assert not caplog.messages


def test_stored_datasets_of_earlier_versions_agree_with_their_digests():
    for path in [*EXAMPLES.parent.glob("studies/*/dataset.nc"), *EXAMPLES.parent.glob("docs/data/*.nc")]:
        open_result(path)


def test_a_dataset_without_digest_is_read_with_a_warning(tmp_path, caplog):
    dataset = simulate(case(1))
    dataset.to_netcdf(tmp_path / "bare.nc", engine="h5netcdf")
    assert open_result(tmp_path / "bare.nc").equals(dataset)
    (message,) = caplog.messages
    assert message.endswith("bare.nc has no digest: its values may have been changed")


def test_a_flipped_bit_does_not_rank_another_design_first(run, tmp_path):
    dataset = front(20)
    path = save(dataset, tmp_path / "front.nc")
    data = bytearray(path.read_bytes())
    at = data.index(dataset["mesh_stiffness_rms_mean"].values.tobytes())
    data[at + 6] ^= 0x40  # an exponent: still a number
    path.write_bytes(data)
    with pytest.raises(InputError, match="is damaged or changed"):
        open_result(path)
    code, out, error = run("select", path)
    assert (code, out) == (2, "")
    assert error == f"gearbench: {path}: is damaged or changed: its digest (data_sha256) contradicts its values\n"


def test_changed_values_are_refused(tmp_path):
    path = save(simulate(case(1)), tmp_path / "result.nc")
    changed = xr.load_dataset(path, engine="h5netcdf")
    changed["transmission_error"] = np.abs(changed["transmission_error"]) + 1
    changed.to_netcdf(path, engine="h5netcdf")
    with pytest.raises(InputError, match="contradicts its values"):
        open_result(path)
