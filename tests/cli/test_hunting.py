"""``gearbench hunting`` as a user meets it."""

import json

import numpy as np
import pytest
import xarray as xr

from gearbench import hunting_cycle, read_scene
from tests.hunting.test_hunting import PITCH, scene


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "pair.toml"
    waves = {"pinion": [{"order": 1, "amplitude": 6.0}]}
    made = scene({"pitch_errors": PITCH, "waviness": waves}, positions=8, segments=5)
    path.write_text(made.to_toml(), encoding="utf-8")
    return path


def test_side_bands_are_printed_written_and_drawn(run, tmp_path, file):
    target, plots = tmp_path / "hunting.nc", tmp_path / "plots"
    code, out, err = run("hunting", file, "--orders", "2", "-o", target, "--plots", plots)
    assert (code, err) == (0, "")
    assert "77 mesh cycles" in out
    with xr.open_dataset(target, engine="h5netcdf") as dataset:
        direct = hunting_cycle(read_scene(file), orders=2.0)
        name = "transmission_error_order_amplitude"
        np.testing.assert_allclose(dataset[name], direct[name], rtol=1e-9, atol=1e-12)
        assert float(dataset["mesh_order"][-1]) == pytest.approx(2.0)
    # run-out: the largest amplitude is that of the pinion's shaft
    order, value = float(direct["mesh_order"][int(np.argmax(direct[name].values))]), float(direct[name].max())
    assert order == pytest.approx(1 / 7)
    assert f"{value:.4g}" in out
    assert [path.name for path in plots.iterdir()] == ["side_bands.png"]


def test_as_json(run, file):
    code, out, _ = run("hunting", file, "--orders", "1", "--json")
    found = json.loads(out)
    assert (code, found["cycles"]) == (0, 77)
    assert max(found["largest"], key=lambda each: each["amplitude"])["mesh_order"] == pytest.approx(1 / 7)


def test_orders_that_nothing_excites_are_not_listed(run, tmp_path):
    """Small waves of first order of both gears: what lies between their orders and those of the mesh is rounding."""
    path = tmp_path / "pair.toml"
    waves = {name: [{"order": 1, "amplitude": 0.1}] for name in ("pinion", "wheel")}
    path.write_text(scene({"waviness": waves}, positions=8, segments=5).to_toml(), encoding="utf-8")
    code, out, _ = run("hunting", path, "--orders", "1", "--json")
    assert code == 0
    sizes = [each["amplitude"] for each in json.loads(out)["largest"]]
    assert 0 < len(sizes) <= 12
    assert min(sizes) > 1e-9 * max(sizes)
