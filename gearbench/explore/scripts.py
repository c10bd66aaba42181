"""The page's own JavaScript, one file a task, in the folder ``js``, and its HTML."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from bokeh.models import CustomJS


def script(name: str, **args: Any) -> CustomJS:
    """The script ``js/<name>.js`` with the models and values it works on."""
    return CustomJS(args=args, code=text_of(f"js/{name}.js"))


def text_of(name: str) -> str:
    """A file of the page."""
    return files("gearbench.explore").joinpath(*name.split("/")).read_text("utf-8")
