"""Research workbench for quiet gears: transmission error and mesh stiffness of involute gear pairs.

The public names are listed in ``__init__.pyi``; each is imported on first use, so that ``import gearbench`` costs next
to nothing.
"""

import lazy_loader

__version__ = "0.2.0.dev0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
