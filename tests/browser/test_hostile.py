"""Files that try to run scripts in the page: none does, live or exported, and the console stays clean."""

import re
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from gearbench.explore.bench.session import example
from gearbench.explore.look import text_of
from gearbench.optimisation.study_file import read_study
from gearbench.optimisation.variables import Variable
from gearbench.results.netcdf import save
from gearbench.scene import Resolution
from gearbench.scene_file import read_scene
from gearbench.simulation import simulate
from tests.browser.chromium import chromium, faults, missing, open_page, wait
from tests.browser.test_bench import DRAWN
from tests.support.explore_designs import front
from tests.support.paths import STUDY

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(missing()), reason=missing() or "–")]

RUN = "window.ran=1"
#: Names that ran a script somewhere once, or would where one layer of the page took text for markup, TeX or code.
NAMES = [
    f"<img src=x onerror={RUN}>", f"<script>{RUN}</script>", f"</script><script>{RUN}</script>",
    f"$$x$$<img src=x onerror={RUN}>", f"$$\\text{{<img src=x onerror={RUN}>}}$$", f"\\[x\\]<svg onload={RUN}>",
    f"\\(x\\)<img src=x onerror={RUN}>", f"$$\\href{{javascript:{RUN}}}{{x}}$$", f"\"><img src=x onerror={RUN}>",
    f"'><svg/onload={RUN}>", "<iframe srcdoc='<script>parent.ran=1</script>'>", f"${{{RUN}}}", f"{{{{{RUN}}}}}",
    f"`;{RUN};//", f"\\u003cimg src=x onerror={RUN}\\u003e", f"<!--<script>{RUN}//-->", f"<style onload={RUN}></style>",
    f"@{{x}}{{safe}}<img src=x onerror={RUN}>", f"<math><mtext><img src=x onerror={RUN}></mtext></math>",
    f"$$$$<details open ontoggle={RUN}>$$",
]  # fmt: skip


def hostile(name: str, path: Path) -> Path:
    """A result whose study, and a value of one of whose variables, have the name."""
    grid = path.with_suffix(".csv")
    grid.write_text("radius,-4,4\n15,0,0\n20,0,0\n")
    study = read_study(STUDY)
    choice = Variable(name="flank", paths=("effects.topography.pinion",), values=(name, str(grid)))
    return save(front(24, 1, replace(study, name=name, variables=(*study.variables, choice))), path)


def test_twenty_hostile_files_run_no_script(explored, tmp_path):
    paths = [hostile(name, tmp_path / f"{i}.nc") for i, name in enumerate(NAMES)]
    assert len(paths) == 20
    with chromium(tmp_path) as driver:
        for at in range(0, 20, 4):
            url = explored(*paths[at : at + 4])
            open_page(driver, url)
            check(driver)
        for at in range(0, 20, 10):
            page = tmp_path / f"{at}.html"
            command = [sys.executable, "-m", "gearbench", "explore", *map(str, paths[at : at + 10])]
            subprocess.run([*command, "--export", str(page)], check=True, capture_output=True)
            open_page(driver, page.as_uri())
            check(driver)


#: Names of scenes and the files that they are downloaded as.
FILES = {
    "../../etc/passwd": "_etc_passwd.toml", "..": "_.toml", "C:\\x.exe": "C_x_exe.toml", "": "scene.toml",
    "con": "con_.toml", "COM1": "COM1_.toml", "console": "console.toml", "a" * 300: "a" * 80 + ".toml",
    "x\u202egpj.exe": "x_gpj_exe.toml", "a\nb": "a_nb.toml", "a.nc\x00.toml": "a_nc_u0000_toml.toml",
    "Rad 5/6 ± 2 µm": "Rad_5_6_2_m.toml",
}  # fmt: skip
ASKED = """
const found = [], click = HTMLAnchorElement.prototype.click;
HTMLAnchorElement.prototype.click = function () { found.push(this.download); };
for (const text of arguments[0]) downloadScene(text);
HTMLAnchorElement.prototype.click = click;
return found;
"""


def test_twenty_hostile_scenes_run_no_script_on_the_bench(explored, tmp_path):
    paths = []
    for i, name in enumerate(NAMES):
        scene = replace(example(), name=name, resolution=Resolution(positions=4, segments=3))
        paths.append(save(simulate(scene), tmp_path / f"{i}.nc"))
    with chromium(tmp_path) as driver:
        for at in range(0, 20, 4):
            page = tmp_path / f"{at}.html"
            several = paths[at : at + 4]
            command = [sys.executable, "-m", "gearbench", "explore", *map(str, several), "--export", str(page)]
            subprocess.run(command, check=True, capture_output=True)
            for url in (page.as_uri(), *([explored(*several)] if at % 8 == 0 else [])):
                driver.get(url)
                wait(lambda: driver.execute_script(DRAWN), "the page was not drawn")
                assert NAMES[at] in driver.execute_script("return document.body.innerText")
                check(driver)


def test_a_hostile_name_gives_a_harmless_name_of_a_file(explored, tmp_path):
    scenes = {name: replace(example(), name=name) for name in (*FILES, *NAMES)}
    file = tmp_path / "scene.toml"
    file.write_text(scenes[NAMES[0]].to_toml(), encoding="utf-8")
    downloads = tmp_path / "downloads"
    downloads.mkdir()
    with chromium(downloads) as driver:
        driver.get(explored(file))
        wait(lambda: driver.execute_script(DRAWN), "the page was not drawn")
        driver.execute_script("document.getElementById('save').click()")
        (saved,) = wait(lambda: list(downloads.glob("*.toml")), "nothing was downloaded")
        wait(lambda: saved.stat().st_size > 0, "an empty file")
        texts = [scene.to_toml() for scene in scenes.values()]
        asked = driver.execute_script(text_of("js/download.js") + ASKED, texts)
        check(driver)
    assert saved.name == "_img_src_x_onerror_window_ran_1_.toml"
    assert read_scene(saved).name == NAMES[0]
    found = dict(zip(scenes, asked, strict=True))
    assert {name: found[name] for name in FILES} == FILES
    assert all(re.fullmatch(r"\w{1,81}\.toml", name, re.ASCII) for name in asked)


def check(driver):
    """Nothing ran, and the console is clean."""
    time.sleep(0.5)  # images that fail to load say so late
    assert driver.execute_script("return window.ran ?? null") is None
    assert faults(driver) == []
