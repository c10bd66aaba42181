"""Measured flank topographies: files, invalid files, and gaps with exact solutions."""

import math
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gearbench import robust, save, sweep
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.crowning import Crowning
from gearbench.effects.flank_grid import read_grid
from gearbench.effects.topography import Topography
from gearbench.errors import InputError
from gearbench.results.origin import scene_of
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import read_scene
from gearbench.simulation import simulate
from tests.support.texts import HELICAL

SCENE = f"{HELICAL}[effects.topography]\n"


def csv(along, coordinate, face, deviation):
    """Text of a grid file with all digits."""
    rows = [f"{along}," + ",".join(repr(float(y)) for y in face)]
    rows += [",".join(repr(float(v)) for v in (c, *line)) for c, line in zip(coordinate, deviation, strict=True)]
    return "\n".join(rows) + "\n"


@pytest.fixture
def scene(tmp_path):
    """Write the scene and its file of deviations and load them."""

    def make(text: str | bytes, *, name: str = "flank.csv", tables: str = 'pinion = "flank.csv"') -> Scene:
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        (tmp_path / "scene.toml").write_text(SCENE + tables)
        return read_scene(tmp_path / "scene.toml")

    return make


def gap(scene):
    """Gap of the topography (position, pair, segment) [µm], and the contact lines."""
    lines = scene_lines(scene, mesh_phases(scene)[0])
    effect = scene.effect("topography")
    assert isinstance(effect, Topography)
    return 1e3 * effect.gap(lines), lines


RADII, FACE = np.linspace(24.0, 29.5, 7), np.linspace(-1.0, 21.0, 5)


@pytest.mark.parametrize("along", ["radius", "diameter", "roll_length"])
def test_a_grid_that_is_bilinear_is_reproduced(scene, along):
    made = scene(csv("radius", RADII, FACE, np.zeros((7, 5))))
    gear = made.pair.gears[0]
    grid = read_grid("pinion", "x", csv(along, [1, 2], [0, 1], [[0, 0], [0, 0]]).encode())
    x = grid.coordinate_of(gear, RADII)

    def truth(x, y):
        return 3.0 + 2.0 * (x - 20.0) - 0.4 * y + 0.1 * (x - 20.0) * y

    gaps, lines = gap(scene(csv(along, x, FACE, truth(x[:, None], FACE))))
    # a few roundings of numbers of size 100
    np.testing.assert_allclose(gaps, truth(grid.coordinate_of(gear, lines.radii[0]), lines.y), atol=1e-12)


def test_crowning_converges_at_second_order(scene):
    errors = []
    for n in (5, 9, 17, 33):
        face = np.linspace(0, 20, n)
        crowned = 6 * (2 * face / 20 - 1) ** 2
        gaps, lines = gap(scene(csv("radius", [25.0, 29.0], face, [crowned, crowned])))
        errors.append(np.abs(gaps - 1e3 * Crowning(amount=6.0).gap(lines)).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2) < 0.2), orders


def test_both_gears_add_and_each_has_its_own_radii(scene, tmp_path):
    (tmp_path / "wheel.csv").write_text(csv("radius", [42.0, 46.0], [0.0], [[0.0], [4.0]]))
    gaps, lines = gap(
        scene(csv("radius", [25.0, 29.0], [0.0], [[0], [8]]), tables='pinion = "flank.csv"\nwheel = "wheel.csv"')
    )
    expected = 2 * np.clip(lines.radii[0] - 25, 0, 4) + np.clip(lines.radii[1] - 42, 0, 4)
    np.testing.assert_allclose(gaps, expected, atol=1e-12)


def test_the_edge_continues_beyond_the_grid(scene):
    gaps, lines = gap(scene(csv("radius", [26.0, 28.5], [2.0, 18.0], [[1, 2], [3, 4]])))
    corner = (lines.radii[0] >= 28.5) & (lines.y >= 18)
    assert corner.any()
    np.testing.assert_array_equal(gaps[corner], 4.0)


def test_excess_material_is_a_negative_gap(scene):
    text = csv("radius", [25.0, 29.0], [0.0], [[0], [8]])
    missing, _ = gap(scene(text))
    excess, _ = gap(scene(text, tables='pinion = "flank.csv"\npositive = "excess"'))
    np.testing.assert_array_equal(excess, -missing)


def test_netcdf_and_csv_are_the_same(scene, tmp_path):
    deviation = np.arange(35.0).reshape(7, 5)
    text = csv("radius", RADII, FACE, deviation)
    one, _ = gap(scene(text))
    for factor, units, engine in ((1.0, "µm", "h5netcdf"), (1e-3, "mm", "h5netcdf"), (1.0, "um", "scipy")):
        array = xr.DataArray(
            factor * deviation.T, {"face_position": FACE, "radius": RADII}, ("face_position", "radius"), "deviation",
            {"units": units},
        )  # fmt: skip
        path = tmp_path / f"{engine}.nc"
        array.to_dataset().to_netcdf(path, engine=engine)
        other, _ = gap(scene(path.read_bytes(), name="flank.nc", tables='pinion = "flank.nc"'))
        np.testing.assert_allclose(other, one, rtol=1e-14)


def test_the_hash_knows_what_is_in_the_file_and_not_where_it_is(scene, tmp_path):
    text = csv("radius", [25.0, 29.0], [0.0], [[0], [8]])
    first = scene(text)
    assert scene(text).digest == first.digest
    assert scene(text.replace("8.0", "8.5")).digest != first.digest
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for name in ("flank.csv", "scene.toml"):
        (elsewhere / name).write_text((tmp_path / name).read_text())
    (elsewhere / "flank.csv").write_text(text)
    assert read_scene(elsewhere / "scene.toml").digest == first.digest


def test_a_file_that_changed_is_refused(scene, tmp_path):
    made = scene(csv("radius", [25.0, 29.0], [0.0], [[0], [8]]))
    (tmp_path / "again.toml").write_text(made.to_toml())
    assert read_scene(tmp_path / "again.toml") == made
    (tmp_path / "flank.csv").write_text(csv("radius", [25.0, 29.0], [0.0], [[0], [9]]))
    text = made.to_toml().replace(made.to_toml().split('sha256 = "')[1][:64], "0" * 64)
    (tmp_path / "again.toml").write_text(text)
    with pytest.raises(InputError, match=r"again.toml: effects\.topography\.pinion_sha256.*has changed"):
        read_scene(tmp_path / "again.toml")


def test_effects_survive_pickling_and_replace(scene, tmp_path):
    made = scene(csv("radius", [25.0, 29.0], [0.0], [[0], [8]]))
    (tmp_path / "flank.csv").unlink()
    effect = made.effect("topography")
    assert isinstance(effect, Topography)
    np.testing.assert_array_equal(gap(pickle.loads(pickle.dumps(made)))[0], gap(made)[0])
    assert replace(effect, positive="excess").grids == effect.grids


def test_german_files_are_understood():
    text = "# remark\nroll length;0,0;10,5\n\n8,25;1,5;2\n9,5;-1;0\n"
    grid = read_grid("pinion", "x", text.encode("utf-8-sig"))
    assert grid.along == "roll_length"
    np.testing.assert_array_equal(grid.face, [0, 10.5])
    np.testing.assert_array_equal(grid.deviation, [[1.5, 2], [-1, 0]])


GOOD = "radius,0,10,20\n25,0,1,2\n27,1,2,3\n29,2,3,4\n"
FAULTS = {
    "word": ("27,1,2,3", "27,1,two,3", "flank.csv, row 3, column 3: 'two'"),
    "short row": ("27,1,2,3", "27,1,2", "flank.csv, row 3 = 3? "),
    "no coordinate": ("radius", "height", "row 1"),
    "rows fall": ("27,1,2,3", "24,1,2,3", "flank.csv, radius"),
    "not finite": ("27,1,2,3", "27,1,nan,3", "radius 27, y 10"),
    "no gear is as large": ("29,2,3,4", "1e200,2,3,4", "must be within ±100000 mm"),
    "one line": ("\n25,0,1,2\n27,1,2,3\n29,2,3,4\n", "\n", "first row"),
    "diameters": ("radius", "diameter", "half of the active flank"),
}


@pytest.mark.parametrize(("old", "new", "says"), FAULTS.values(), ids=FAULTS.keys())
def test_faults_name_file_and_row(scene, old, new, says):
    assert old in GOOD
    scene(GOOD)
    with pytest.raises(InputError) as fault:
        scene(GOOD.replace(old, new))
    message = str(fault.value)
    assert "scene.toml: effects.topography.pinion = " in message
    assert says.removesuffix(" = 3? ") in message
    assert "\n" not in message


def test_files_that_are_missing(scene, tmp_path):
    with pytest.raises(InputError, match=r"effects\.topography\.wheel = none\.csv: must be a readable file"):
        scene(GOOD, tables='wheel = "none.csv"')
    with pytest.raises(InputError, match="a file is required"):
        scene(GOOD, tables="")
    with pytest.raises(InputError, match="UTF-8"):
        scene(b"\xff\xfe\x00radius")


def test_netcdf_faults(scene, tmp_path):
    for dims, attrs, says in (
        (("radius", "y"), {"units": "µm"}, "0 fitting variables"),
        (("radius", "face_position"), {}, "units missing"),
        (("radius", "face_position"), {"units": "m"}, "units m"),
    ):
        array = xr.DataArray(np.zeros((2, 2)), {dims[0]: [25.0, 29.0], dims[1]: [0.0, 20.0]}, dims, "d", attrs)
        array.to_dataset().to_netcdf(tmp_path / "f.nc", engine="h5netcdf")
        with pytest.raises(InputError, match=says):
            scene(Path(tmp_path / "f.nc").read_bytes(), name="flank.nc", tables='pinion = "flank.nc"')
    with pytest.raises(InputError, match="readable netCDF"):
        scene(b"\x89HDF\r\n\x1a\nnonsense", name="flank.nc", tables='pinion = "flank.nc"')


def test_kinks_of_a_coarse_grid_are_on_the_path_of_contact(scene):
    made = scene(csv("radius", [25.0, 26.0, 27.0, 29.0], [0.0], [[0], [1], [0], [4]]))
    effect = made.effect("topography")
    assert isinstance(effect, Topography)
    r_b = made.pair.gears[0].base_radius
    inside = [math.sqrt(r * r - r_b * r_b) for r in (25.0, 26.0, 27.0, 29.0)]
    inside = [u for u in inside if made.pair.meshing.path_start < u < made.pair.meshing.path_end]
    assert len(inside) == 3
    np.testing.assert_allclose(effect.kinks(made.pair), inside, rtol=1e-14)


def test_lines_of_spur_pairs_are_cut_at_the_columns_of_a_coarse_grid(scene):
    """With panels between the columns bilinear gaps are smooth, and harmonics hardly depend on segments."""
    y = np.linspace(0.0, 20.0, 6)
    rough = 2.0 * np.array([3, 1, 0.3, 0, 1.2, 2.5])
    made = scene(csv("radius", [25.0, 29.0], y, [rough, rough + 0.5]))
    made = replace(made, pair=replace(made.pair, helix_angle=0.0, centre_distance=65.0))
    effect = made.effect("topography")
    assert isinstance(effect, Topography)
    assert effect.face_kinks(made.pair) == pytest.approx(y[1:-1])
    coarse, fine = (simulate(replace(made, resolution=Resolution(segments=n, positions=8))) for n in (15, 60))
    np.testing.assert_allclose(coarse["transmission_error"], fine["transmission_error"], rtol=1e-5)


TEXT = csv("radius", [25.0, 27.0, 29.0], [0.0, 20.0], [[0, 1], [2, 3], [4, 8]])
#: Answers of a process that knows nothing but the Dataset in its folder.
AFRESH = """
import sys
from gearbench import open_result, simulate
from gearbench.results.origin import scene_of
print(repr(float(simulate(scene_of(open_result(sys.argv[1])))["transmission_error_rms"])))
"""


@pytest.mark.slow
def test_a_dataset_keeps_the_grid_and_needs_no_file(scene, tmp_path):
    """A separate process in another folder, without the files, gives the same number to the last digit."""
    dataset = simulate(scene(TEXT))
    kept = dataset["topography_pinion"]
    np.testing.assert_array_equal(kept, [[0, 1], [2, 3], [4, 8]])
    np.testing.assert_array_equal(kept["topography_pinion_radius"], [25.0, 27.0, 29.0])
    assert kept.units == "µm"
    assert "positive: material missing" in kept.long_name
    assert "topography_wheel" not in dataset
    path = save(dataset, tmp_path / "result.nc")
    (tmp_path / "flank.csv").unlink()
    command = [sys.executable, "-c", AFRESH, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path.parent)
    assert done.returncode == 0, done.stderr[-1000:]
    assert float(done.stdout) == float(dataset["transmission_error_rms"])


def test_sweeps_samples_and_coast_flanks_keep_it_too(scene):
    made = scene(TEXT, tables='pinion = "flank.csv"\n[effects.manufacturing_errors.helix_slope]\namplitude = 2.0')
    own = made.effect("topography")
    assert isinstance(own, Topography)
    coast = replace(own, positive="excess")
    swept = sweep(replace(made, coast=(coast,)), torque=[50.0, 100.0])
    assert swept["topography_pinion"].dims == ("topography_pinion_radius", "topography_pinion_face_position")
    np.testing.assert_array_equal(swept["coast_topography_pinion"], swept["topography_pinion"])
    assert "material excess" in swept["coast_topography_pinion"].long_name
    assert scene_of(swept.sel(torque=50.0)).effect("topography") == own
    sampled = robust(made, samples=2)
    np.testing.assert_array_equal(sampled["topography_pinion"], swept["topography_pinion"])


def test_a_kept_grid_that_is_none_is_refused(scene):
    dataset = simulate(scene(TEXT))
    for broken, says in (
        (dataset["topography_pinion"].assign_attrs(sha256="0"), "SHA-256"),
        (dataset["topography_pinion"].assign_attrs(sha256="0" * 64, units="m"), "units m"),
        (dataset["topography_pinion"].isel(topography_pinion_radius=0).assign_attrs(sha256="1" * 64), "dimensions"),
    ):
        with pytest.raises(InputError, match=says):
            scene_of(dataset.assign(topography_pinion=broken))
