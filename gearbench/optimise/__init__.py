"""Optimisation of macro- and micro-geometry. The package is also the function: ``gearbench.optimise(study, …)``."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearbench.optimise.designs import design_scene
    from gearbench.optimise.run import optimise
    from gearbench.optimise.study import OptimisationStudy
    from gearbench.optimise.study_file import load_study

_PUBLIC = {
    "OptimisationStudy": "gearbench.optimise.study",
    "design_scene": "gearbench.optimise.designs",
    "load_study": "gearbench.optimise.study_file",
    "optimise": "gearbench.optimise.run",
}

__all__ = ["OptimisationStudy", "design_scene", "load_study", "optimise"]


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'gearbench.optimise' has no attribute {name!r}")


class _Package(ModuleType):
    """A package that can be called, because the function bears its name."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return getattr(import_module(_PUBLIC["optimise"]), "optimise")(*args, **options)  # noqa: B009


sys.modules[__name__].__class__ = _Package
