"""The design bench, live or as a file."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from functools import partial

from bokeh.document import Document

from gearbench.explore.bench.answers import answers, numbers, over_torque, warnings
from gearbench.explore.bench.page import BenchPage
from gearbench.explore.conversation import Conversation
from gearbench.explore.gear_data import tables
from gearbench.explore.model import Picture, outline, picture, scattered
from gearbench.explore.scripts import text_of
from gearbench.explore.static import as_file
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene


class BenchSession:
    """One open bench: a question is the tables of a scene.

    Parameters
    ----------
    scene
        The gear to begin with.
    begin
        Its picture.
    document
        The open page.
    """

    def __init__(self, scene: Scene, begin: Picture, document: Document) -> None:
        self.page = BenchPage(scene, {**tables(begin), **numbers(begin)})
        self._talk = Conversation(document, self.page.question, self.page.answer, partial(answers, scene))
        self.page.put(document)


def bench(scene: Scene) -> Callable[[Document], object]:
    """Pages of a bench that begins with ``scene``, which is solved now.

    Raises
    ------
    GearbenchError
        If its contact problem is not solved.
    """
    begin = picture(scene)
    return lambda document: BenchSession(scene, begin, document)


def bench_html(scene: Scene) -> str:
    """The bench as one page that needs no server: all it shows of ``scene``, without controls."""
    now, solved = outline(scene)
    shown = {**tables(scattered(now, solved)), **numbers(now), **over_torque(scene)}
    page = BenchPage(scene, {**shown, "warnings": {"text": warnings(now, solved)}})
    document = Document()
    page.put(document, live=False)
    return as_file(document)


def example() -> Scene:
    """A helical pair to begin with where no file is named."""
    return parse_scene(tomllib.loads(text_of("bench/example.toml")))
