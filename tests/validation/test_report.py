"""The report: one file that needs nothing from elsewhere, says what was found, and is written whole or not at all."""

from __future__ import annotations

import base64
import re
from dataclasses import replace

import pytest

from gearbench.library.garambois2017 import case
from gearbench.results.netcdf import open_result
from gearbench.validation import report
from gearbench.validation.comparison import validate
from tests.support.html import Page
from tests.support.validation_fakes import plates_for_finite_elements

HOSTILE = '<script>alert("1")</script> & sons'


@pytest.fixture(scope="module")
def dataset():
    with pytest.MonkeyPatch.context() as patch:
        plates_for_finite_elements(patch, softness=1.25, correction=2.0)
        return validate([case(1), replace(case(2), name=HOSTILE)], accuracy=0.05)


@pytest.fixture(scope="module")
def html(dataset):
    return report.render(dataset)


@pytest.fixture(scope="module")
def page(html):
    return Page(html)


def test_the_report_is_self_contained(page):
    """No address outside the page: pictures are data, links lead to places in it, styles and scripts are not loaded."""
    tags = {tag for tag, _ in page.elements}
    assert not tags & {"script", "link", "iframe", "object", "embed", "base", "form"}
    places = {attrs["id"] for _, attrs in page.elements if "id" in attrs}
    for _, attrs in page.elements:
        for name in ("src", "srcset", "href", "action", "poster", "data"):
            if name in attrs:
                value = attrs[name]
                assert value.startswith("data:image/png;base64,") or (value[0] == "#" and value[1:] in places)
    assert not re.search(r"https?://|url\(|@import|file:", page.text)
    policy = next(a["content"] for t, a in page.elements if a.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in policy


def test_pictures_are_whole_png_files_with_a_text_for_those_who_do_not_see_them(page):
    pictures = [attrs for tag, attrs in page.elements if tag == "img"]
    assert len(pictures) == 2 * 6
    for attrs in pictures:
        data = base64.b64decode(attrs["src"].split(",", 1)[1], validate=True)
        assert data.startswith(b"\x89PNG\r\n\x1a\n")
        assert data.endswith(b"IEND\xaeB`\x82")
        assert len(data) > 5000
        assert len(attrs["alt"]) > 10


def test_the_report_says_what_the_dataset_holds(page, dataset):
    text = page.text
    for i in range(2):
        one = dataset.isel(scene=i)
        for name in ("transmission_error_mean", "mesh_stiffness_peak_to_peak"):
            error, bar = (float(one[f"{name}_error{end}"]) for end in ("", "_bar"))
            digits = 1 if bar > 0.1 else 2
            assert bar > 0.01
            error = f"{error:+.{digits}f} ± {bar:.1g} %".replace("-", "−")
            assert error in text
            assert f"{float(one[name][0]):.4g} {one[name].attrs['units']}" in text
        assert f"{float(one['mac_worst'].min()):.3f}" in text
        for part in ("max", "rms"):
            error, bar = (100 * float(one[f"load_share_error_{part}{end}"]) for end in ("", "_bar"))
            assert f"{error:.1f} ± {bar:.2g} % of the load" in text
        assert "The reference is less than five times better than the difference of" in text
        assert str(one["scene_sha256"].item()) in text
        assert str(one["scene_toml"].item()).splitlines()[2] in text
    for key in ("git_revision", "versions", "host"):
        assert dataset.attrs[key] in text


def test_names_are_text_not_markup(page):
    assert HOSTILE in page.text
    assert page.text.count(HOSTILE) >= 3  # title, overview, heading


def test_report_and_dataset_are_written_together(dataset, html, tmp_path, monkeypatch):
    monkeypatch.setattr(report, "render", lambda _: html)
    folder = tmp_path / "new" / "deep"
    written = report.write(dataset, folder)
    assert sorted(path.name for path in folder.iterdir()) == ["report.html", "validation.nc"]
    assert {path.name for path in written} == {"report.html", "validation.nc"}
    assert open_result(folder / "validation.nc")["mac"].identical(dataset["mac"])
    assert (folder / "report.html").read_text(encoding="utf-8") == html


@pytest.mark.parametrize("stage", ["save", "render"])
def test_a_failure_leaves_what_was_there(dataset, html, tmp_path, monkeypatch, stage):
    monkeypatch.setattr(report, "render", lambda _: html)
    (tmp_path / "report.html").write_text("before")

    def full(*_):
        raise OSError("no space left on device")

    monkeypatch.setattr(report, stage, full)
    with pytest.raises(OSError, match="no space"):
        report.write(dataset, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    assert (tmp_path / "report.html").read_text() == "before"
