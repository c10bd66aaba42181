"""The design bench in a real browser: layout, keyboard, screen readers, changes, files; and the page of studies."""

import subprocess
import sys
import tomllib
from importlib.resources import files

import numpy as np
import pytest

from gearbench.explore.bench.session import example
from gearbench.explore.catalogue import catalogue, fronts
from gearbench.explore.stored import open_results
from gearbench.results.netcdf import save
from gearbench.scene_file import parse_scene, read_scene
from gearbench.simulation import simulate
from tests.browser.chromium import chromium, faults, missing, shot, wait
from tests.support.explore_designs import front
from tests.support.paths import EXAMPLES

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(missing()), reason=missing() or "–")]

SIZES = {"wide": (1440, 900), "small": (1000, 700), "phone": (390, 844)}
DRAWN = "return !!window.Bokeh?.documents[0]?.is_idle && (!document.getElementById('numbers') ||"
DRAWN += " !!document.querySelector('#numbers tbody tr'))"
MODEL = "const model = (name) => Bokeh.documents[0].get_model_by_name(name); "
SWEPT = MODEL + "return model('now torque').data.torque.length > 0"
SCENE = MODEL + "return model('now scene').data.text[0]"
NUMBER = """
const row = [...document.querySelectorAll("#numbers tbody tr")].find((r) => r.textContent.startsWith(arguments[0]));
return [...row.children].map((c) => c.textContent);
"""
#: Elements that a keyboard should reach, and those of them that it does.
REACHED = """
const controls = [...document.querySelectorAll("button, input, select, summary, a[href]")].filter(
  (e) => !e.disabled && e.checkVisibility());
return controls.filter((e) => e.tabIndex < 0).map((e) => e.id || e.dataset.path || e.outerHTML);
"""


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(example().to_toml(), encoding="utf-8")
    return path


@pytest.fixture
def set_file(tmp_path):
    tables = read_scene(EXAMPLES / "planetary.toml").to_mapping()
    scene = parse_scene({**tables, "effects": {"hertz": {}}, "resolution": {"positions": 8}})
    path = tmp_path / "set.toml"
    path.write_text(scene.to_toml(), encoding="utf-8")
    return path


@pytest.fixture
def studies_file(tmp_path):
    save(front(300), tmp_path / "front.nc")
    return tmp_path / "front.nc"


def resize(driver, size):
    """Give the page this size, smaller than a window of the system may be."""
    width, height = SIZES[size]
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)


def show(driver, url, size="wide"):
    resize(driver, size)
    driver.get(url)
    wait(lambda: driver.execute_script(DRAWN), "the page was not drawn")


def enter(driver, path, value):
    """Give a number input a value as a hand does."""
    code = """
    const input = document.querySelector(`[data-path="${arguments[0]}"]`);
    input.closest("details").open = true;
    input.focus(); input.value = arguments[1];
    input.dispatchEvent(new Event("input", { bubbles: true })); input.blur();
    input.dispatchEvent(new Event("change", { bubbles: true }));
    """
    driver.execute_script(code, path, value)


def in_scene(driver, *keys):
    """A value of the scene that is shown."""
    table = tomllib.loads(driver.execute_script(SCENE))
    for key in keys:
        table = table.get(key, {})
    return table


@pytest.mark.parametrize("page", ["scene_file", "set_file", "studies_file"])
def test_pages_fit_every_window_and_serve_everyone(request, explored, tmp_path, page):
    url = explored(request.getfixturevalue(page))
    axe = files("axe_core_python").joinpath("axe.min.js").read_text("utf-8")
    with chromium(tmp_path) as driver:
        for size in SIZES:
            show(driver, url, size)
            shot(driver, f"8_{page}_{size}")
            wide, room = driver.execute_script(
                "const e = document.documentElement; return [e.scrollWidth, e.clientWidth]"
            )
            assert wide <= room, f"{size}: {wide} of {room} px"
            driver.execute_script("for (const e of document.querySelectorAll('details')) e.open = true")
            assert driver.execute_script(REACHED) == []
            driver.execute_script(axe)
            found = driver.execute_async_script("axe.run().then(arguments[0])")["violations"]
            serious = [(v["id"], v["nodes"][0]["target"]) for v in found if v["impact"] in {"serious", "critical"}]
            assert serious == []
        assert faults(driver) == []


def test_change_compare_undo_and_save(explored, scene_file, tmp_path):
    with chromium(tmp_path) as driver:
        show(driver, explored(scene_file))
        wait(lambda: driver.execute_script(SWEPT), "no Harris map")
        slider = "return document.querySelector('[data-slides=\"resolution.segments\"]').value"
        assert driver.execute_script(slider) == "15"  # the default, which the scene leaves out
        first = driver.execute_script(NUMBER, "peak-to-peak")
        assert first[1] == first[2]

        enter(driver, "effects.crowning.amount", 7)
        wait(lambda: in_scene(driver, "effects", "crowning", "amount") == 7, "not computed")
        driver.find_element("id", "variant").click()
        enter(driver, "effects.tip_relief.amount", 3)
        wait(lambda: in_scene(driver, "effects", "tip_relief", "amount") == 3, "not computed")
        wait(lambda: driver.execute_script(NUMBER, "peak-to-peak")[3] != first[1], "no new number")
        heads = "return [...document.querySelectorAll('#numbers thead th')].map((c) => c.firstChild.textContent)"
        assert driver.execute_script(heads) == ["baseline", "variant 1", "now"]
        numbers = driver.execute_script(NUMBER, "peak-to-peak")
        assert numbers[1] == first[1] != numbers[2]  # the variant is that of the curves shown, not of the answer before
        for figure in ("ste", "stiffness", "ste_orders", "stiffness_orders", "torque"):
            assert driver.execute_script(MODEL + f"return model('kept {figure}').data.xs.length") == 1
        assert driver.execute_script(MODEL + "return model('kept harris').data.xs.length") > 1

        # an effect that is added begins with an example, and leaves without a trace
        driver.execute_script("document.querySelector('[data-table=\"effects.end_relief\"]').click()")
        wait(lambda: in_scene(driver, "effects", "end_relief"), "not added")
        driver.find_element("id", "undo").click()
        wait(lambda: not in_scene(driver, "effects", "end_relief"), "not undone")
        driver.find_element("id", "undo").click()
        wait(lambda: in_scene(driver, "effects", "tip_relief", "amount") == 8, "not undone")
        shot(driver, "9_bench_changed")

        # a fault is a line, and the curves before it stay
        enter(driver, "pair.face_width", -1)
        wait(lambda: "must be greater than 0" in driver.find_element("id", "message").text, "no message")
        assert driver.execute_script("return document.body.classList.contains('stale')")
        driver.find_element("id", "undo").click()
        wait(lambda: driver.find_element("id", "message").text == "", "the message stayed")
        assert not driver.execute_script("return document.body.classList.contains('stale')")

        driver.find_element("id", "save").click()
        file = wait(lambda: next((p for p in tmp_path.glob("example*.toml") if p.stat().st_size), None), "no file")
        assert read_scene(file).effect("crowning").amount == 7
        driver.find_element("id", "pictures").click()
        drawn = wait(lambda: next((p for p in tmp_path.glob("*.svg") if p.stat().st_size), None), "no picture")
        assert drawn.read_text(encoding="utf-8").count("<svg") >= 8
        assert faults(driver) == []


def test_the_last_of_many_moves_is_what_stays(explored, scene_file, tmp_path):
    """Answers that are overtaken are never shown over newer ones."""
    move = """
    const slider = document.querySelector('[data-slides="load.torque"]');
    slider.value = arguments[0];
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    """
    with chromium(tmp_path) as driver:
        show(driver, explored(scene_file))
        for torque in range(60, 200, 5):
            driver.execute_script(move, torque)
        wait(lambda: in_scene(driver, "load", "torque") == 195, "an older answer stayed")
        least = MODEL + "return model('now torque').data.torque[0] ?? 0"
        wait(lambda: abs(driver.execute_script(least) - 0.2 * 195) < 0.1, "no Harris map of the last answer")
        assert in_scene(driver, "load", "torque") == 195
        assert faults(driver) == []


SLIDE = """
const slider = document.querySelector(`[data-slides="${arguments[0]}"]`);
slider.value = arguments[1];
slider.dispatchEvent(new Event("input", { bubbles: true }));
slider.dispatchEvent(new Event("change", { bubbles: true }));
"""
#: Messages that the page sends from now on.
COUNTED = """
const count = window.counted = { messages: 0 }, send = WebSocket.prototype.send;
WebSocket.prototype.send = function (message) { count.messages += 1; return send.call(this, message); };
"""
#: The first point of the first planet in the drawing, and the load shares there.
DRAWN_SET = (
    MODEL
    + """
const [gears, names, , labels] = model("gears").renderers.map((each) => each.data_source.data);
return [gears.xs[names.name.indexOf("planet 1")][0], [...labels.share]];
"""
)


def test_a_set_shares_its_load_as_simulate_says_and_turns(explored, set_file, tmp_path):
    with chromium(tmp_path) as driver:
        show(driver, explored(set_file))
        wait(lambda: driver.execute_script(SWEPT), "no Harris map")
        driver.execute_script(SLIDE, "planetary.pin_radial.1", 16)
        wait(lambda: in_scene(driver, "planetary", "pin_radial") == [0, 16, 0, 0], "not computed")
        expected = simulate(parse_scene(tomllib.loads(driver.execute_script(SCENE))))
        factor = f"{float(expected['mesh_load_factor']):.3f}"
        wait(lambda: driver.execute_script(NUMBER, "mesh load factor")[2] == factor, "not that of simulate")
        share = expected["load_sharing"].values[:4, 0]  # at phase 0
        wait(lambda: driver.execute_script(DRAWN_SET)[1] == [f"{each:.2f}" for each in share], "not drawn")

        # the drawing turns, and the server is not told
        driver.execute_script(COUNTED)
        before = driver.execute_script(DRAWN_SET)[0]
        driver.find_element("id", "turn").click()
        wait(lambda: abs(driver.execute_script(DRAWN_SET)[0] - before) > 0.05, "does not turn")
        driver.find_element("id", "turn").click()
        assert driver.execute_script("return counted.messages") == 0
        shot(driver, "12_set_turned")

        # a fault is a line; an undone change is gone, also one of a list
        enter(driver, "planetary.planets", 3)
        wait(lambda: "one for each of the 3 planets" in driver.find_element("id", "message").text, "no message")
        for _ in range(2):
            driver.find_element("id", "undo").click()
        wait(lambda: not in_scene(driver, "planetary", "pin_radial"), "not undone")
        wait(lambda: driver.find_element("id", "message").text == "", "the message stayed")

        # fewer planets, without their errors
        enter(driver, "planetary.pin_tangential", "")
        enter(driver, "planetary.planets", 3)
        wait(lambda: driver.execute_script(DRAWN_SET)[1] == ["1.00"] * 3, "not three equal shares")
        enter(driver, "planetary.floating", "sun, ring")
        wait(lambda: "nothing holds" in driver.find_element("id", "message").text, "no message")
        enter(driver, "planetary.floating", "ring")
        wait(lambda: in_scene(driver, "planetary", "floating") == ["ring"], "not computed")
        driver.execute_script("document.querySelector('[data-table=\"planetary.run_out\"]').click()")
        hidden = "return document.querySelector('[data-figure=\"revolution\"]').hidden"
        wait(lambda: not driver.execute_script(hidden), "no revolution")
        assert faults(driver) == []


def test_a_single_result_as_a_file_shows_no_empty_panels(scene_file, tmp_path):
    page, result = tmp_path / "page.html", tmp_path / "result.nc"
    save(simulate(read_scene(scene_file)), result)
    command = [sys.executable, "-m", "gearbench", "explore", str(result), "--export", str(page), "-q"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("", "")
    with chromium(tmp_path, offline=True) as driver:
        show(driver, page.as_uri())
        figures = driver.execute_script(
            "return [...document.querySelectorAll('[data-figure]')].filter((f) => f.checkVisibility())"
            ".map((f) => f.dataset.figure)"
        )
        assert figures == [
            "ste",
            "stiffness",
            "ste_orders",
            "stiffness_orders",
            "harris",
            "torque",
            "pressure",
            "teeth",
        ]
        assert driver.execute_script(SWEPT)
        heads = "return [...document.querySelectorAll('#numbers thead th')].map((c) => c.textContent)"
        assert driver.execute_script(heads) == ["example"]
        assert driver.execute_script("return document.querySelectorAll('button, form').length") == 0
        shot(driver, "11_single_result")
        assert faults(driver) == []


def test_any_quantity_across_up_and_as_colour(explored, studies_file, tmp_path):
    choose = """
    const [id, title] = arguments, select = document.getElementById(id);
    select.value = [...select.options].find((option) => option.textContent.startsWith(title)).value;
    select.dispatchEvent(new Event("change"));
    """
    designs = catalogue(open_results([studies_file]))
    with chromium(tmp_path) as driver:
        show(driver, explored(studies_file))
        wait(lambda: driver.execute_script(MODEL + "return model('designs')?.explore?.painted"), "not painted")
        drawn = MODEL + "return Array.from(model('front').data.design)"
        assert sorted(driver.execute_script(drawn)) == sorted(fronts(designs).tolist())
        # less scatter is better, too: a front of its own
        driver.execute_script(choose, "across", "max RMS k")
        expected = front_of(designs, "mesh_stiffness_rms_max", "transmission_error_rms_mean")
        wait(lambda: sorted(driver.execute_script(drawn)) == expected, "not the front of the axes chosen")
        # of a variable less is not better
        driver.execute_script(choose, "up", "crowning")
        wait(lambda: driver.execute_script(drawn) == [], "a front of a variable")
        label = MODEL + "return model('cloud').left[0].axis_label"
        assert driver.execute_script(label) == designs.column("effects.crowning.amount").title
        driver.execute_script(choose, "colour", "helix angle")
        shades = MODEL + "return new Set(model('designs').explore.shade).size"
        wait(lambda: driver.execute_script(shades) > 3, "no colours")
        shot(driver, "10_axes_chosen")
        assert faults(driver) == []


def front_of(designs, across, up):
    """Designs that no other has both values below or equal of."""
    x, y = designs.column(across).values, designs.column(up).values
    order = np.lexsort((y, x))
    return sorted(
        int(i)
        for i, before in zip(order, np.minimum.accumulate(np.r_[np.inf, y[order]]), strict=False)
        if y[i] < before
    )
