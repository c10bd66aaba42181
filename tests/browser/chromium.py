"""A headless Chromium with its driver, and the page in it."""

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.support.paths import ROOT

OUT = ROOT / "out" / "browser"


def missing() -> str:
    """What is missing for a browser; empty where nothing is."""
    try:
        import bokeh  # noqa: F401
        import selenium  # noqa: F401
    except ImportError as error:
        return f"{error.name}: install gearbench[explore,dev]"
    lacking = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
    return f"{' and '.join(lacking)}: run `make programs` (Debian's chromium and chromium-driver)" if lacking else ""


@contextmanager
def chromium(downloads: Path, *, offline: bool = False) -> Iterator[Any]:
    """A browser that saves downloads into a folder; ``offline``: it reaches no host at all."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for argument in (
        "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=1640,1260",
        *(["--host-resolver-rules=MAP * ~NOTFOUND"] if offline else []),
    ):  # fmt: skip
        options.add_argument(argument)
    options.add_experimental_option("prefs", {"download.default_directory": str(downloads)})
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    driver.set_script_timeout(120)
    try:
        yield driver
    finally:
        driver.quit()


def open_page(driver: Any, url: str) -> None:
    """Open the page and wait until it is drawn."""
    driver.get(url)
    wait(lambda: driver.execute_script(READY), "the page was not drawn")


READY = """
const doc = window.Bokeh?.documents[0];
return !!doc && doc.is_idle && doc.get_model_by_name("designs")?.explore?.painted === true;
"""


def wait(condition: Any, message: str, seconds: float = 60) -> Any:
    """Wait until ``condition`` returns something true."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < end, message
        time.sleep(0.05)
    return value


def faults(driver: Any) -> list[str]:
    """Errors and warnings on the console."""
    return [line["message"] for line in driver.get_log("browser") if line["level"] in {"SEVERE", "WARNING"}]


def shot(driver: Any, name: str) -> None:
    """Write a screenshot to ``out/browser``."""
    OUT.mkdir(parents=True, exist_ok=True)
    driver.save_screenshot(str(OUT / f"{name}.png"))
