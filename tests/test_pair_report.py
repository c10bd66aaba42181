"""The page of a pair: whole in one file, every text of a scene as text, and one load."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import simulate
from gearbench.cli.simulate import simulate as command
from gearbench.errors import InputError
from gearbench.library.garambois2017 import case
from gearbench.loads import WeightedLoad
from gearbench.pair_report import draw_teeth, write_pair_report
from gearbench.plotting import new_figure
from gearbench.scene import Resolution

ROWS = {"geometry": [("teeth", "33", "75", "1"), ("contact ratio", "1.6", "1")], "cycle": [("mean", "2", "µm")]}


@pytest.fixture(scope="module")
def scene():
    return replace(case(1, Resolution(gauss_points=4, segments=5)), name="<b>pair & wheel</b>")


def test_the_page_needs_nothing_from_elsewhere_and_reads_names_as_text(scene, tmp_path):
    path = write_pair_report(simulate(scene), tmp_path / "pair.html", "z 33/75, 5 N·m", ROWS, ["mind <this>"])
    text = path.read_text(encoding="utf-8")
    assert "&lt;b&gt;pair &amp; wheel&lt;/b&gt;" in text
    assert "<b>" not in text
    assert "mind &lt;this&gt;" in text
    assert "z 33/75, 5 N·m" in text
    assert text.count("data:image/png;base64,") == 4
    assert not re.search(r"""(?:src|href)=["'](?!data:)""", text)
    assert "<td>contact ratio</td><td>1.6</td><td></td><td>1</td>" in text
    assert "@page { size: A4" in text


def test_the_teeth_drawn_touch_on_the_path_of_contact(scene):
    """Contact points of the drawing lie on the outlines of both gears, to their chords."""
    _, ((axes,),) = new_figure(1, 1, (4, 3))
    draw_teeth(axes, scene.pair, phase=0.3)
    contacts = np.column_stack(axes.lines[1].get_data())
    assert len(contacts) >= 1
    for patch in axes.patches:
        outline = patch.get_xy()
        apart = [np.hypot(*(outline - point).T).min() for point in contacts]
        assert_allclose(apart, 0.0, atol=0.15 * scene.pair.normal_module)


def test_the_command_writes_the_page_of_one_load(scene, tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(scene.to_toml(), encoding="utf-8")
    command(file, report=tmp_path / "page.html")
    assert "mean mesh stiffness" in (tmp_path / "page.html").read_text(encoding="utf-8")
    loads = tuple(WeightedLoad(torque=torque, weight=1.0) for torque in (6000.0, 13200.0))
    file.write_text(replace(scene, load=replace(scene.load, torque=13200.0), loads=loads).to_toml(), encoding="utf-8")
    with pytest.raises(InputError, match="here give one"):
        command(file, report=Path(tmp_path / "other.html"))
    assert not (tmp_path / "other.html").exists()
