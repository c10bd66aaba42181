"""The explorer in a real browser: start, select, filter, export; how long it takes; nothing on the console."""

import subprocess
import sys

import numpy as np
import pytest

from gearbench.explore.catalogue import catalogue, fronts
from gearbench.explore.stored import open_results
from gearbench.results.netcdf import save
from gearbench.scene_file import read_scene
from gearbench.simulation import simulate
from tests.browser.changes import CHANGES, change_times
from tests.browser.chromium import chromium, faults, missing, open_page, shot, wait
from tests.support.explore_designs import front

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(missing()), reason=missing() or "–")]

PICK = """
const d = model("designs").data, i = arguments[0];
model("pick").data = { design: [i], x: [d.x[i]], y: [d.y[i]] };
"""
MODEL = "const model = (name) => Bokeh.documents[0].get_model_by_name(name); "


def text(driver, name):
    return driver.execute_script("return document.getElementById(arguments[0]).innerHTML", name)


def grey(driver):
    """Pixels of the cloud that show a design left out."""
    code = "return model('raster').data.image[0].reduce((n, pixel) => n + ((pixel & 0xffffff) === 0xd2d2d2), 0)"
    return driver.execute_script(MODEL + code)


def summary(driver):
    return text(driver, "summary")


def helix(driver):
    return driver.execute_script(MODEL + "return model('filter pair.helix_angle').value")


def test_select_filter_and_export(served, tmp_path):
    url = served(400)
    designs = catalogue(open_results([tmp_path / "front.nc"]))
    with chromium(tmp_path) as driver:
        open_page(driver, url)
        shot(driver, "1_start")
        assert_front(driver, fronts(designs))

        # a click on a point of the cloud picks that design
        chosen = pick_by_click(driver, designs)
        wait(lambda: summary(driver).endswith(f"design {designs.number[chosen]}"), "the pick was not computed")
        shot(driver, "2_picked")

        assert grey(driver) == 0
        # a filter leaves the designs that keep it, and the front of those
        column = designs.column("effects.crowning.amount")
        driver.execute_script(MODEL + "model('filter effects.crowning.amount').value = [2.5, 5.5]")
        kept = (column.values >= 2.5) & (column.values <= 5.5)
        wait(
            lambda: f"<b>{kept.sum()}</b>" in text(driver, "count"),
            "not filtered",
        )
        assert_front(driver, fronts(designs, kept))
        assert grey(driver) > 0
        shot(driver, "3_filtered")

        # the export is the scene that is shown, and it can be simulated
        press(driver, "Save scene file")
        (file,) = wait(lambda: list(tmp_path.glob("*.toml")), "nothing was downloaded")
        wait(lambda: file.stat().st_size > 0, "an empty file")
        assert read_scene(file) == designs.scene(chosen)
        assert faults(driver) == []


def test_ranges_are_brushed_on_the_axes_of_the_parallel_coordinates(served, tmp_path):
    from selenium.webdriver import ActionChains

    with chromium(tmp_path) as driver:
        open_page(driver, served(200))
        full = helix(driver)
        x, low = place(driver, "parallel", 2, 0.2)
        _, high = place(driver, "parallel", 2, 0.7)
        actions = ActionChains(driver, duration=50)
        actions.w3c_actions.pointer_action.move_to_location(x, low).pointer_down().move_to_location(
            x, (low + high) // 2
        )
        actions.w3c_actions.pointer_action.move_to_location(x, high).pointer_up()
        actions.perform()
        wait(
            lambda: helix(driver) != full,
            "not brushed",
        )
        value = helix(driver)
        ends = full[0] + np.array([0.2, 0.7]) * (full[1] - full[0])
        np.testing.assert_allclose(value, ends, atol=0.06 * (full[1] - full[0]))  # a few pixels
        press(driver, "Clear filters")
        wait(
            lambda: helix(driver) == full,
            "not cleared",
        )
        assert faults(driver) == []


COMPARED = """
const rows = [...document.querySelectorAll("#numbers tr")];
return rows.map((row) => [...row.children].map((cell) => cell.firstChild?.textContent ?? ""));
"""


def test_picks_are_compared_in_a_table_and_by_their_curves(served, tmp_path):
    url = served(300)
    designs = catalogue(open_results([tmp_path / "front.nc"]))
    picks = fronts(designs)[[0, 2, 4]]
    with chromium(tmp_path) as driver:
        open_page(driver, url)
        assert "300" not in text(driver, "results")  # one of them is no gear
        assert text(driver, "results").endswith("299 designs, plate teeth, clamped</li>")
        means = []
        for chosen in picks:
            name = designs.name(int(chosen))
            driver.execute_script(MODEL + PICK, int(chosen))
            wait(lambda name=name: summary(driver) == name, "not picked")
            driver.find_element("id", "keep").click()
            means.append(simulate(designs.scene(int(chosen)))["transmission_error_mean"].item())
        rows = driver.execute_script(COMPARED)
        assert rows[0] == ["", "picked", *(designs.name(int(chosen)) for chosen in picks)]
        table = {row[0]: row[1:] for row in rows[1:]}
        assert table["mean STE [µm]"][1:4] == [f"{mean:.2f}" for mean in means]
        # each curve is laid over those of the gear, with its mean and without
        value = MODEL + "return model('kept ste').data[arguments[0]].map((v) => Array.from(v))"
        drawn, less = (driver.execute_script(value, field) for field in ("ys", "fluctuations"))
        for curve, rest, mean in zip(drawn, less, means, strict=True):
            np.testing.assert_allclose(np.subtract(curve, rest), mean, rtol=1e-5)
        driver.find_element("id", "fluctuation").click()
        glyph = MODEL + "return model('ste').renderers.map((r) => (r.glyph.ys ?? r.glyph.y).field)"
        assert driver.execute_script(glyph) == ["fluctuation", "fluctuation", "fluctuations"]
        shot(driver, "12_picks_compared")
        # a fourth beside the one shown is one too many
        driver.find_element("id", "keep").click()
        assert "remove one first" in text(driver, "message")
        assert faults(driver) == []


def test_sixty_thousand_designs(served, tmp_path):
    """All there, and nothing on the console after sixty changes of each kind; ``make bench`` times them."""
    with chromium(tmp_path) as driver:
        open_page(driver, served(60_001))
        assert driver.execute_script(MODEL + "return model('designs').data.x.length") == 60_000
        shot(driver, "5_sixty_thousand")
        found = change_times(driver)
        shot(driver, "6_sixty_thousand_filtered")
        assert set(found) == set(CHANGES)
        assert faults(driver) == []


def test_the_file_works_without_any_network(tmp_path):
    save(front(300), tmp_path / "front.nc")
    page = tmp_path / "page.html"
    command = [sys.executable, "-m", "gearbench", "explore", str(tmp_path / "front.nc"), "--export", str(page), "-q"]
    assert subprocess.run(command, check=True, capture_output=True).stdout == b""
    designs = catalogue(open_results([tmp_path / "front.nc"]))
    with chromium(tmp_path, offline=True) as driver:
        open_page(driver, page.as_uri())
        shot(driver, "7_file")
        first, last = fronts(designs)[[0, -1]]
        for chosen in (first, last):
            driver.execute_script(MODEL + PICK, int(chosen))
            wait(lambda chosen=chosen: summary(driver).endswith(f"design {designs.number[chosen]}"), "no picture")
        driver.execute_script(MODEL + "model('filter effects.crowning.amount').value = [2.5, 5.5]")
        kept = designs.column("effects.crowning.amount").values
        kept = (kept >= 2.5) & (kept <= 5.5)
        wait(
            lambda: f"<b>{kept.sum()}</b>" in text(driver, "count"),
            "not filtered",
        )
        press(driver, "Save scene file")
        (file,) = wait(lambda: list(tmp_path.glob("*.toml")), "nothing was downloaded")
        assert wait(lambda: file.stat().st_size, "an empty file")
        assert read_scene(file) == designs.scene(last)
        assert faults(driver) == []
        resources = driver.execute_script("return performance.getEntriesByType('resource').map((r) => r.name)")
        assert [name for name in resources if not name.startswith(("blob:", "data:"))] == []


def assert_front(driver, expected):
    """The fronts that the browser draws are those that Python finds."""
    drawn = driver.execute_script(MODEL + "return Array.from(model('front').data.design)")
    assert sorted(drawn) == sorted(expected.tolist())


def place(driver, figure, x, y):
    """Pixel of the window where a point of a figure is drawn."""
    code = """
    const view = Bokeh.index.find_one_by_id ? Bokeh.index.find_one_by_id(model(arguments[0]).id)
      : [...Bokeh.index].map((v) => v).find(Boolean);
    const box = view.el.getBoundingClientRect(), frame = view.frame;
    return [box.left + frame.x_scale.compute(arguments[1]), box.top + frame.y_scale.compute(arguments[2])];
    """
    return [round(v) for v in driver.execute_script(MODEL + code, figure, x, y)]


def pick_by_click(driver, designs):
    """Click on the design at the lower right end of the cloud, clear of the legend; its number."""
    from selenium.webdriver import ActionChains

    x, y = (designs.column(f"{name}_rms_mean").values for name in ("mesh_stiffness", "transmission_error"))
    chosen = int(np.argmax(x / np.ptp(x) - y / np.ptp(y)))
    at = place(driver, "cloud", float(x[chosen]), float(y[chosen]))
    actions = ActionChains(driver)
    actions.w3c_actions.pointer_action.move_to_location(*at).click()
    actions.perform()
    wait(
        lambda: driver.execute_script(MODEL + "return model('pick').data.design[0]") == chosen,
        "the click picked nothing",
    )
    return chosen


def press(driver, label):
    """Press a button; it lives in the shadow of its widget."""
    code = """
    const find = (root) => {
      for (const e of root.querySelectorAll("*")) {
        if (e.tagName === "BUTTON" && e.textContent.trim() === arguments[0]) return e;
        const found = e.shadowRoot && find(e.shadowRoot);
        if (found) return found;
      }
    };
    find(document).click();
    """
    driver.execute_script(code, label)
