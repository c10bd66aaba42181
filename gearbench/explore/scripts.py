"""The page's own JavaScript, one file a task, in the folder ``js``, and its HTML."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from bokeh.models import CustomJS


def script(*names: str, **args: Any) -> CustomJS:
    """The scripts ``js/<name>.js``, one after the other, with the models and values they work on."""
    return CustomJS(args=args, code="\n".join(text_of(f"js/{name}.js") for name in names))


def text_of(name: str) -> str:
    """A file of the page."""
    return files("gearbench.explore").joinpath(*name.split("/")).read_text("utf-8")
