"""Files that try to run scripts in the page: none does, live or exported, and the console stays clean."""

import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from gearbench.optimisation.study_file import load_study
from gearbench.optimisation.variables import Variable
from gearbench.results.netcdf import save
from tests.browser.chromium import chromium, faults, missing, open_page
from tests.explore_designs import EXAMPLES, front

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing() or "–")

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
    study = load_study(EXAMPLES / "optimise_small.toml")
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


def check(driver):
    """Nothing ran, and the console is clean."""
    time.sleep(0.5)  # images that fail to load say so late
    assert driver.execute_script("return window.ran ?? null") is None
    assert faults(driver) == []
