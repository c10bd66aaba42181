"""The page's own JavaScript: one file a task, in the folder ``js``."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from bokeh.models import CustomJS


def script(name: str, **args: Any) -> CustomJS:
    """The script ``js/<name>.js`` with the models and values it works on."""
    return CustomJS(args=args, code=files("gearbench.explore").joinpath("js", f"{name}.js").read_text("utf-8"))
