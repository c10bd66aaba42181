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
from gearbench.explore.model import ShownResults, shown_results, with_scatter, without_scatter
from gearbench.explore.static import as_file
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene

#: Time without a slider move after which the answer at the full resolution is begun [s].
REST = 0.12


def bench(scene: Scene, *others: Scene) -> Callable[[Document], object]:
    """Solve ``scene`` and ``others``, and return a function that opens a bench with ``others`` as variants.

    Raises
    ------
    InputError
        If ``scene`` has several loads, or pairs and trains are mixed.
    GearbenchError
        If the contact problem of one of them cannot be solved.
    """
    _check(scene, others)
    first_results, variant_results = shown_results(scene), [shown_results(other) for other in others]

    def opened(document: Document) -> None:
        # a question of the page is a scene as a mapping, which ``Answers`` solves
        page = BenchPage(scene, tables(first_results), variants(variant_results))
        Conversation(document, page.question, page.answer, Answers(scene), rest=REST)
        page.put(document)

    return opened


def bench_html(scene: Scene, *others: Scene) -> str:
    """HTML text of a bench without server and controls: results of ``scene``, with ``others`` as variants.

    Raises as ``bench``.
    """
    _check(scene, others)
    results, solved = without_scatter(scene)
    shown = {**tables(with_scatter(results, solved)), **over_torque(scene)}
    variant_results = [shown_results(other) for other in others]
    page = BenchPage(scene, {**shown, "warnings": {"text": warnings(solved)}}, variants(variant_results))
    document = Document()
    page.put(document, live=False)
    return as_file(document)


def _check(scene: Scene, others: Sequence[Scene]) -> None:
    """Refuse several loads, and pairs together with trains."""
    _ = scene.single_load  # raises if there are several
    for other in others:
        if other.coupled != scene.coupled:
            raise InputError("", other.name or "a scene", "pairs and trains have separate pages: open them separately")


def variants(variant_results: Sequence[ShownResults]) -> list[dict[str, Any]]:
    """Convert results to variants for ``js/compare.js``: name, number, scene, numbers and curves."""
    entries = []
    for i, result in enumerate(variant_results, start=1):
        shown = {**tables(result, teeth=False), **over_torque(result.scene)}
        data = {"scene": json.dumps(result.scene.to_mapping()), "numbers": shown["numbers"]}
        curves = {name: shown[name] for name in OVERLAID}
        entries.append({"name": result.scene.name or f"variant {i}", "number": i, **data, "curves": curves})
    return entries


def example() -> Scene:
    """Read the helical pair that the bench shows if no file is named."""
    return parse_scene(tomllib.loads(text_of("bench/example.toml")))
