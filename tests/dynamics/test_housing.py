"""Transfer functions of a housing: sums by hand, interpolation, files and scenes that do not fit."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from gearbench.dynamics.analysis import response
from gearbench.dynamics.housing import housing_response, read_housing
from gearbench.errors import InputError
from tests.attack.mutations import netcdf
from tests.support.systems import shafts, spur_scene

SUPPORT = {"radial_stiffness": 200.0, "axial_stiffness": 100.0}
ENDS = [{"position": p, "name": n, **SUPPORT} for p, n in ((0.0, "A"), (200.0, "B"))]


def housing(frequency=(0.0, 1e4), bearings=("output 1", "A", "B", "output 2")):
    rng = np.random.default_rng(1)
    dims = ("point", "bearing", "direction", "frequency")
    shape = (2, len(bearings), 3, len(frequency))
    coords = {"point": ["lid", "foot"], "bearing": list(bearings), "direction": ["axial", "x", "y"]}
    return xr.Dataset(
        {f"transfer_{part}": (dims, rng.normal(size=shape), {"units": "m/s²/N"}) for part in ("real", "imaginary")},
        coords=coords | {"frequency": list(frequency)},
    )


@pytest.fixture(scope="module")
def answer():
    return response(spur_scene(shafts({"bearings": ENDS})), speed=[900.0, 1800.0], harmonics=3)


def test_forces_times_transfer_functions(answer, tmp_path):
    housing().to_netcdf(tmp_path / "h.nc")
    own = read_housing(tmp_path / "h.nc")
    found = housing_response(answer, own)
    speed, n = 1, 2
    f, expected = 1800 / 60 * 25 * n, 0
    for bearing in ("A", "B", "output 1", "output 2"):
        for direction in ("x", "y", "axial"):
            chosen = {"bearing": bearing, "direction": direction}
            H = own.sel(point="foot", **chosen)
            h = [complex(*(float(H[f"transfer_{p}"][k]) for p in ("real", "imaginary"))) for k in (0, 1)]
            one = answer.sel(mesh="pair", harmonic=n, **chosen).isel(speed=speed)
            F = float(one["bearing_force_amplitude"]) * np.exp(1j * float(one["bearing_force_phase"]))
            expected += (h[0] + (h[1] - h[0]) * f / 1e4) * F
    at = found.sel(mesh="pair", point="foot", harmonic=n).isel(speed=speed)
    assert_allclose(float(at["housing_amplitude"]), abs(expected), rtol=1e-10)
    assert_allclose(np.exp(1j * float(at["housing_phase"])), expected / abs(expected), atol=1e-10)
    assert found["housing_amplitude"].attrs["units"] == "m/s²"


def test_orders_beyond_the_file_are_missing_and_noted(answer):
    found = housing_response(answer, housing((0.0, 1000.0)))
    missing = np.isnan(found["housing_amplitude"].sel(mesh="pair", point="lid").values)
    assert missing.tolist() == [[False, False, True], [False, True, True]]
    assert "orders outside 0 to 1000 Hz have no housing response" in found.attrs["notes"]


def test_what_does_not_fit_is_one_line(answer, tmp_path):
    with pytest.raises(InputError, match="no bearing A: must contain every"):
        housing_response(answer, housing(bearings=("B", "output 1", "output 2")))
    with pytest.raises(InputError, match="a housing needs a linear response"):
        housing_response(response(spur_scene({}), speed=900.0, harmonics=2), housing())
    housing().drop_vars("transfer_imaginary").to_netcdf(tmp_path / "h.nc")
    with pytest.raises(InputError, match="transfer_imaginary = missing"):
        read_housing(tmp_path / "h.nc")
    with pytest.raises(InputError, match=r"none\.nc: no such file"):
        read_housing(tmp_path / "none.nc")
    housing((5.0, 1.0)).to_netcdf(tmp_path / "d.nc")
    with pytest.raises(InputError, match="must ascend"):
        read_housing(tmp_path / "d.nc")


def test_damaged_and_hostile_files_are_one_line(answer, tmp_path):
    """Bits flipped, cut, and changed through HDF5; half of them ended in a traceback once."""
    housing().to_netcdf(tmp_path / "whole.nc", engine="h5netcdf")
    whole, refused = (tmp_path / "whole.nc").read_bytes(), []
    for seed in range(60):
        (tmp_path / "h.nc").write_bytes(netcdf(np.random.default_rng(seed), whole))
        try:
            found = housing_response(answer, read_housing(tmp_path / "h.nc"))
        except InputError as fault:
            refused.append(str(fault))
        else:
            # NaN stands for orders outside the frequencies of the file
            assert not np.isinf(found["housing_amplitude"]).any()
    assert 20 < len(refused) < 60
    assert all("\n" not in line and len(line) < 300 for line in refused)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda h: h.isel(frequency=[0]), "frequency = one value: must ascend and have at least two values"),
        (
            lambda h: h.assign_coords(bearing=["A", "A", "B", "output 1"]),
            "bearing = A, A, B, output 1: must all",
        ),
        (
            lambda h: h.assign(transfer_real=h["transfer_real"] * np.nan),
            "transfer_real = not finite: must be finite",
        ),
        (
            lambda h: h.assign(transfer_imaginary=h["transfer_real"][0]),
            "transfer_imaginary = .*must have the dim",
        ),
        (lambda h: h * 1e200, r"transfer_real = .*e\+\d+: must be at most 1e"),
        (lambda h: h.isel(point=[]), "none of them empty"),
        (lambda h: h.isel(direction=[0, 1]), "housing = no direction y: must have x, y and axial"),
    ],
)
def test_transfer_functions_of_no_housing_are_one_line(answer, tmp_path, change, match):
    change(housing()).to_netcdf(tmp_path / "h.nc")
    with pytest.raises(InputError, match=match):
        housing_response(answer, read_housing(tmp_path / "h.nc"))
