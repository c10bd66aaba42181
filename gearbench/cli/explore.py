"""``gearbench explore``."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.cli.options import to_file
from gearbench.cli.output import answer
from gearbench.cli.rexs import StageName, load_any
from gearbench.errors import GearbenchError, InputError, install_extra

if TYPE_CHECKING:
    from gearbench.scene import Scene

Results = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="[RESULT…]",
        help="Optimisation folders or front.nc; or scenes, REXS files, results of simulate or robust.",
        show_default=False,
    ),
]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0: any free port.")]
Export = Annotated[Path | None, to_file("FILE.html", "Write one self-contained page and exit.", "--export")]


def explore(
    results: Results = None,
    stage: StageName = None,
    port: Port = 5006,
    export: Export = None,
) -> None:
    """Open a local web page: a design bench for one scene, or the designs of stored studies.

    Example: gearbench explore scene.toml --port 5006
    """
    from gearbench.files import write_text

    try:
        import bokeh  # noqa: F401
    except ImportError as error:
        raise GearbenchError(f"the explorer needs bokeh: {install_extra('explore')}") from error
    summary, page, html = _opened(results or [], stage)
    if export is not None:
        answer({**summary, "files": [write_text(export, html())]})
        return
    from gearbench.explore.server import Explorer

    explorer = Explorer(page(), port)

    def ready() -> None:
        answer({**summary, "url": explorer.url, "port": explorer.port}, [f"{explorer.url} (end with Ctrl-C)"])
        sys.stdout.flush()  # the program that starts the server waits for the address

    explorer.run(ready)


def _opened(
    results: list[Path], stage: str | None
) -> tuple[dict[str, Any], Callable[[], Callable[..., object]], Callable[[], str]]:
    """Read the results; return a summary, a function that makes the live page, and one that makes its HTML text."""
    scenes = _scenes(results, stage)
    if scenes:
        from gearbench.explore.bench.session import bench, bench_html

        names = [scene.name for scene in scenes]
        return {"scenes": names}, partial(bench, *scenes), partial(bench_html, *scenes)
    from gearbench.explore.catalogue import catalogue
    from gearbench.explore.live import Session
    from gearbench.explore.static import html
    from gearbench.explore.stored import open_results

    designs = catalogue(open_results(results))
    summary = [
        {"label": result.label, "designs": int((designs.result == i).sum())} for i, result in enumerate(designs.results)
    ]
    return ({"designs": len(designs), "results": summary}, lambda: partial(Session, designs), partial(html, designs))


def _scenes(results: list[Path], stage: str | None) -> list[Scene]:
    """Scenes of a bench from scene files, REXS files and results of one gear; the example if no file is named.

    The list is empty if all files are optimisations.

    Raises
    ------
    InputError
        If scenes and studies are mixed.
    """
    if not results:
        from gearbench.explore.bench.session import example

        return [example()]
    scene_or_none = [_scene(path, stage) for path in results]
    scenes = [scene for scene in scene_or_none if scene is not None]
    if scenes and len(scenes) < len(scene_or_none):
        raise InputError("", str(results[scene_or_none.index(None)]), "is a study: open scenes and studies separately")
    return scenes


def _scene(path: Path, stage: str | None) -> Scene | None:
    """Scene of a scene file, of a stage of a REXS file, or of a result of one gear; None for an optimisation."""
    from gearbench.exchange import is_rexs

    if path.suffix.lower() == ".toml" or is_rexs(path):
        return load_any(path, stage)[0]
    if path.is_dir():
        return None
    from gearbench.explore.stored import scene_of_run

    return scene_of_run(path)
