"""Dynamic response of a scene with ``[system]``. The package is also the function: ``gearbench.response(scene, …)``."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

__all__ = ["response"]


def __getattr__(name: str) -> Any:
    if name == "response":
        from gearbench.response.analysis import response

        return response
    raise AttributeError(f"module 'gearbench.response' has no attribute {name!r}")


class _Package(ModuleType):
    """A package that can be called, because the function bears its name."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        from gearbench.response.analysis import response

        return response(*args, **options)


sys.modules[__name__].__class__ = _Package
