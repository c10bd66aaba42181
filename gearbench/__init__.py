"""Research workbench for quiet gears: transmission error and mesh stiffness of involute gear pairs.

``__init__.pyi`` lists the public names. They are imported on first use, so that ``import gearbench`` is fast. Plots are
in ``gearbench.plot``, base classes for extensions in ``gearbench.plugin``.
"""

from importlib import import_module
from typing import Any
from warnings import warn

import lazy_loader

__version__ = "1.0.0"

_public, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

#: Earlier public name → its successor; the old names work for one version.
_RENAMED = {
    "load_scene": "gearbench.read_scene",
    "load_study": "gearbench.read_study",
    "load_rexs": "gearbench.read_rexs",
    "load_housing": "gearbench.read_housing",
    "load": "gearbench.open_result",
    "Response": "gearbench.plugin.Metric",
    "Scatter": "gearbench.SizeScatter",
    **{
        name: f"gearbench.plugin.{name}"
        for name in ("ComplianceEffect", "Dense", "Effect", "GapEffect", "LineLaw", "LowRank", "MeshCycle", "Quantity")
    },
    **{
        name: f"gearbench.plot.{name}"
        for name in (
            "contributions", "density", "draw_relief", "draw_robust", "draw_simulation", "draw_sweep",
            "load_distribution", "load_map", "order_spectrum", "over_two_periods",
        )
    },
}  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _RENAMED:
        return _public(name)
    module, _, successor = _RENAMED[name].rpartition(".")
    warn(f"gearbench.{name} is now {_RENAMED[name]}", DeprecationWarning, stacklevel=2)
    return getattr(import_module(module), successor)
