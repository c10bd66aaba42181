"""``gearbench explore``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gearbench.cli.options import Quiet

Results = Annotated[
    list[Path],
    typer.Argument(metavar="RESULT…", help="Folders or front.nc of optimisations, results.", show_default=False),
]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0: any that is free.")]
Export = Annotated[
    Path | None, typer.Option("--export", metavar="FILE.html", help="Write one self-contained page instead.")
]


def explore(results: Results, port: Port = 5006, export: Export = None, quiet: Quiet = False) -> None:
    """Open a local page over stored RESULTs: fronts, filters, and the picked gear computed anew as sliders move.

    Example: gearbench explore front --port 5006
    """
    from gearbench.errors import GearbenchError
    from gearbench.explore.catalogue import catalogue
    from gearbench.explore.stored import open_results
    from gearbench.results import check_target

    if export is not None:
        check_target(export)
    designs = catalogue(open_results(results))
    try:
        import bokeh  # noqa: F401
    except ImportError as error:
        raise GearbenchError("the explorer needs the extra: pip install 'gearbench[explore]'") from error
    if export is not None:
        from gearbench.explore.static import write

        write(designs, export)
        if not quiet:
            print(f"wrote {export}")
        return
    from gearbench.explore.server import Explorer

    explorer = Explorer(designs, port)
    explorer.run(lambda: None if quiet else print(f"{explorer.url} (end with Ctrl-C)", flush=True))
