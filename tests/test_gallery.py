"""The gallery: every program runs and draws its picture, and the page shows all of them."""

import re

import pytest

from docs.gallery import PICTURES, PROGRAMS, ROOT, draw

PAGE = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
NAMES = sorted(path.stem for path in PROGRAMS.glob("*.py"))


def test_the_page_shows_every_program_and_its_picture():
    assert sorted(re.findall(r"examples/gallery/(\w+)\.py", PAGE)) == NAMES
    assert sorted(re.findall(r"figures/gallery/(\w+)\.png", PAGE)) == NAMES
    assert sorted(path.stem for path in PICTURES.glob("*.png")) == NAMES
    assert all(path.stat().st_size < 250_000 for path in PICTURES.glob("*.png"))


@pytest.mark.parametrize("name", NAMES)
def test_a_program_draws_what_the_page_shows(tmp_path, name):
    from matplotlib.image import imread

    drawn = imread(draw(PROGRAMS / f"{name}.py", tmp_path))
    shown = imread(PICTURES / f"{name}.png")
    assert drawn.shape == shown.shape
    # fonts and the last digit may differ, curves not: most pixels are the same
    assert (abs(drawn - shown).max(axis=-1) < 0.1).mean() > 0.97
    assert drawn.std() > 0.05
