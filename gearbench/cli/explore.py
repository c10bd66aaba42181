"""``gearbench explore``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.options import Json, Quiet, Verbose

if TYPE_CHECKING:
    from gearbench.explore.catalogue import Catalogue

Results = Annotated[
    list[Path],
    typer.Argument(metavar="RESULT…", help="Folders or front.nc of optimisations, results.", show_default=False),
]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0: any that is free.")]
Export = Annotated[
    Path | None, typer.Option("--export", metavar="FILE.html", help="Write one self-contained page instead.")
]


def explore(
    results: Results,
    port: Port = 5006,
    export: Export = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Open a local page over stored RESULTs: fronts, filters, and the picked gear computed anew as sliders move.

    Example: gearbench explore front --port 5006
    """
    from gearbench.errors import GearbenchError
    from gearbench.explore.catalogue import catalogue
    from gearbench.explore.stored import open_results
    from gearbench.files import check_target

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
        if json:
            _print_json(designs, files=[str(export)])
        elif not quiet:
            print(f"wrote {export}")
        return
    from gearbench.explore.server import Explorer

    explorer = Explorer(designs, port)

    def ready() -> None:
        if json:
            _print_json(designs, url=explorer.url, port=explorer.port)
        elif not quiet:
            print(f"{explorer.url} (end with Ctrl-C)", flush=True)

    explorer.run(ready)


def _print_json(designs: Catalogue, **more: object) -> None:
    """The results shown, and the address; flushed, because whoever starts the server waits for the address."""
    from gearbench.cli.summary import print_mapping

    results = [
        {"label": result.label, "designs": int((designs.study == i).sum())} for i, result in enumerate(designs.results)
    ]
    print_mapping({"designs": len(designs), "results": results, **more})
    sys.stdout.flush()
