"""The gallery: every program runs and draws its picture, and the page shows all of them."""

import re

import pytest

from docs.gallery import PICTURES, PROGRAMS, ROOT, draw

PAGE = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
NAMES = sorted(path.stem for path in PROGRAMS.glob("*.py"))
QUICK = {"face_width", "scatter"}


def test_the_page_shows_every_program_and_its_picture():
    assert sorted(re.findall(r"examples/gallery/(\w+)\.py", PAGE)) == NAMES
    assert sorted(re.findall(r"figures/gallery/(\w+)\.png", PAGE)) == NAMES
    assert sorted(path.stem for path in PICTURES.glob("*.png")) == NAMES
    assert all(path.stat().st_size < 250_000 for path in PICTURES.glob("*.png"))


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in NAMES])
def test_a_program_draws_its_picture(tmp_path, name):
    from matplotlib.image import imread

    drawn, shown = imread(draw(PROGRAMS / f"{name}.py", tmp_path)), imread(PICTURES / f"{name}.png")
    assert drawn.shape == shown.shape
    # curves and colours, not an empty frame, which is below 0.2 in either
    assert 0.5 < (drawn < 0.9).mean() / (shown < 0.9).mean() < 2
    assert (shown < 0.9).mean() > 0.02
