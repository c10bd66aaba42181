"""Values on contact lines as an image of the flank."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import read_scene, simulate
from gearbench.plot import load_map
from gearbench.results.flank_map import over_flank
from tests.support.paths import EXAMPLES

PATH, ACROSS = np.linspace(2.0, 8.0, 31), np.linspace(0.0, 10.0, 21)


def lines(slope: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact lines u = u_0 + slope·y over the whole face, each with segments at positions of its own."""
    draw = np.random.default_rng(seed)
    start = np.linspace(1.0 - 11 * slope, 9.0 + slope, 60)
    y = (np.arange(7) + draw.uniform(0.2, 0.8, (60, 7))) * 10 / 7
    return start[:, None] + slope * y, y, 2 * np.minimum(y, 10 - y)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_a_plane_is_reproduced_whatever_the_segments_of_each_line(slope):
    u, y, width = lines(slope)
    image = over_flank(u, y, width, 3.0 + 2.0 * u, PATH, ACROSS)
    inside = (y[:, 0].max() < ACROSS) & (y[:, -1].min() > ACROSS)
    assert inside.sum() > 5
    assert_allclose(image[:, inside], np.repeat((3.0 + 2.0 * PATH)[:, None], inside.sum(), axis=1), rtol=1e-12)


def test_lines_of_the_coast_flanks_run_the_other_way():
    u, y, width = lines(0.3)
    values = 3.0 + u * y
    backwards = (u[:, ::-1], y[:, ::-1], width[:, ::-1], values[:, ::-1])
    assert np.array_equal(over_flank(u, y, width, values, PATH, ACROSS), over_flank(*backwards, PATH, ACROSS))


@pytest.mark.parametrize("feature", ["profile", "face"])
def test_a_kink_of_the_profile_or_of_the_face_is_drawn_straight(feature):
    """Lines far apart cross a relief at different y: between them its edge must not wave."""
    slope = 0.3
    start = np.linspace(1.0 - 11 * slope, 9.0 + slope, 25)
    y = np.linspace(0.05, 9.95, 100) + np.zeros((25, 1))
    u = start[:, None] + slope * y
    across = np.linspace(1.8, 8.2, 41)  # further out a neighbour no longer reaches the same u

    def load(u, y):
        return np.minimum(1.0, (7.0 - u) / 2.0) if feature == "profile" else np.minimum(1.0, 0.1 + 0.2 * y)

    image = over_flank(u, y, np.full_like(u, 0.1), load(u, y), PATH, across)
    assert_allclose(image, np.broadcast_to(load(PATH[:, None], across), image.shape), atol=0.01)


def test_where_no_line_is_there_is_nothing():
    u, y, width = lines(0.0)
    width[:] = 0.1
    image = over_flank(u, y + 5.0, width, np.ones_like(u), PATH, ACROSS)
    assert np.isnan(image[:, ACROSS < 5.4]).all()
    assert_allclose(image[:, (ACROSS > 9.0) & (ACROSS < 10.0)], 1.0)


def test_the_map_is_the_pressure_of_the_segments_on_either_gear():
    """On a spur pair without modifications over the face: at the u of each phase, all along the face."""
    scene = read_scene(EXAMPLES / "gears" / "osu_50.toml").without("off_line_contact")
    dataset = simulate(scene, outputs=("line_load", "flank_pressure"))
    pair = scene.pair
    for index in (0, 1):
        drawn = load_map(dataset, index, scale=700.0).collections[0]
        shown = np.asarray(drawn.get_array()).reshape(300, 300)
        path = np.linspace(pair.meshing.path_start, pair.meshing.path_end, 300)
        middle = shown[:, 150]
        present = (dataset["segment_length"] > 0).values
        u, p = dataset["path_position"].values[present], dataset["flank_pressure"].values[present]
        # between phases and between 300 points the pressure is straight: 1 % of its largest value near the relief;
        # where a pair takes its load it rises within a few of them
        near, spread = np.abs(u[:, None] - u) <= 2 * (path[1] - path[0]), p.max() * 0.03
        found = np.interp(u, path, middle)
        assert np.all(found >= np.where(near, p, np.inf).min(axis=1) - spread)
        assert np.all(found <= np.where(near, p, -np.inf).max(axis=1) + spread)
        assert drawn.get_clim() == (0.0, 700.0)
