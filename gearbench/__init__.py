"""Research workbench for quiet gears: transmission error and mesh stiffness of involute gear pairs.

The public names are imported on first use, so that ``import gearbench`` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_PUBLIC = {
    "Scene": "gearbench.scene",
    "load_scene": "gearbench.scene_file",
    "load_rexs": "gearbench.exchange.rexs",
    "simulate": "gearbench.simulation",
    "robust": "gearbench.robustness.montecarlo",
}

__all__ = ["Scene", "__version__", "load_rexs", "load_scene", "optimise", "response", "robust", "simulate"]

if TYPE_CHECKING:
    from gearbench.exchange.rexs import load_rexs
    from gearbench.optimise.run import optimise
    from gearbench.response.analysis import response
    from gearbench.robustness.montecarlo import robust
    from gearbench.scene import Scene
    from gearbench.scene_file import load_scene
    from gearbench.simulation import simulate


def __getattr__(name: str) -> Any:
    if name in ("optimise", "response"):  # packages, and the functions too
        return import_module(f"gearbench.{name}")
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'gearbench' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
