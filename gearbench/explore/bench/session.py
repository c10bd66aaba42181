"""Design bench as a live page (``bench``) or as an HTML file without controls (``bench_html``)."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Sequence
from typing import Any

from bokeh.document import Document

from gearbench.errors import InputError
from gearbench.explore.bench.answers import Answers, over_torque, warnings
from gearbench.explore.bench.page import BenchPage
from gearbench.explore.conversation import Conversation
from gearbench.explore.gear import OVERLAID
from gearbench.explore.gear_data import tables
from gearbench.explore.look import text_of
from gearbench.explore.model import Picture, picture, with_scatter, without_scatter
from gearbench.explore.static import as_file
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene

#: Time without a slider move after which the answer at the full resolution is begun [s].
REST = 0.12


class BenchSession:
    """One open bench. Its page asks questions, which are tables of a scene, and ``Answers`` solves them.

    Parameters
    ----------
    scene
        The first gear.
    begin
        Results of the first gear.
    document
        The open page.
    beside
        Results of other gears, which are the initial variants.
    """

    def __init__(self, scene: Scene, begin: Picture, document: Document, beside: Sequence[Picture] = ()) -> None:
        self.page = BenchPage(scene, tables(begin), variants(beside))
        self._conversation = Conversation(document, self.page.question, self.page.answer, Answers(scene), rest=REST)
        self.page.put(document)


def bench(scene: Scene, *others: Scene) -> Callable[[Document], object]:
    """Solve ``scene`` and ``others``, and return a function that opens a bench with ``others`` as variants.

    Raises
    ------
    InputError
        If ``scene`` has several loads, or pairs and trains are mixed.
    GearbenchError
        If its contact problem cannot be solved.
    """
    _check(scene, others)
    begin, beside = picture(scene), [picture(other) for other in others]
    return lambda document: BenchSession(scene, begin, document, beside)


def bench_html(scene: Scene, *others: Scene) -> str:
    """HTML text of a bench without server and controls: results of ``scene``, with ``others`` as variants.

    Raises as ``bench``.
    """
    _check(scene, others)
    results, solved = without_scatter(scene)
    shown = {**tables(with_scatter(results, solved)), **over_torque(scene)}
    beside = [picture(other) for other in others]
    page = BenchPage(scene, {**shown, "warnings": {"text": warnings(solved)}}, variants(beside))
    document = Document()
    page.put(document, live=False)
    return as_file(document)


def _check(scene: Scene, others: Sequence[Scene]) -> None:
    """Refuse several loads, and trains beside pairs."""
    _ = scene.single_load
    for other in others:
        if other.coupled != scene.coupled:
            raise InputError("", other.name or "a scene", "pairs and trains have separate pages: open them one by one")


def variants(beside: Sequence[Picture]) -> list[dict[str, Any]]:
    """Convert results to variants for ``js/compare.js``: name, number, scene, numbers and curves."""
    entries = []
    for i, result in enumerate(beside, start=1):
        shown = {**tables(result, teeth=False), **over_torque(result.scene)}
        data = {"scene": json.dumps(result.scene.to_mapping()), "numbers": shown["numbers"]}
        curves = {name: shown[name] for name in OVERLAID}
        entries.append({"name": result.scene.name or f"variant {i}", "number": i, **data, "curves": curves})
    return entries


def example() -> Scene:
    """Read the helical pair that the bench shows if no file is named."""
    return parse_scene(tomllib.loads(text_of("bench/example.toml")))
