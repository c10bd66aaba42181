"""Session of the live page: it answers picks with the curves of the picked design."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from bokeh.document import Document
from bokeh.models import ColumnDataSource

from gearbench.explore.catalogue import Catalogue
from gearbench.explore.conversation import Conversation
from gearbench.explore.gear_data import densities, tables
from gearbench.explore.look import script
from gearbench.explore.model import ShownResults, shown_results, with_scatter, without_scatter
from gearbench.explore.page import Page, answer_data, explained, knee


class Session:
    """One open page. A question is the index of a design; its answers are the curves, then the scatter."""

    def __init__(self, catalogue: Catalogue, document: Document) -> None:
        self._catalogue = catalogue
        first = knee(catalogue)
        self._finished: dict[int, ShownResults] = {first: shown_results(catalogue.scene(first))}
        question = ColumnDataSource({"design": [first]}, name="question")
        self.page = Page(catalogue, first, tables(self._finished[first]))
        self.page.show_answers()
        self.page.pick.js_on_change("data", script("ask", question=question, pick=self.page.pick))
        self._conversation = Conversation(
            document, question, self.page.answer, lambda asked, _overtaken: self.answers(asked["design"][0])
        )
        self.page.put(document)

    def answers(self, design: Any) -> Iterator[dict[str, Any]]:
        """Yield one or two answers to a question; the last one carries an error message if there is one."""
        return explained(self._picked(design))

    def _picked(self, asked: Any) -> Iterator[dict[str, Any]]:
        """Yield the answers for a design; its finished results are kept."""
        design = int(asked)
        scene, name = self._catalogue.scene(design), self._catalogue.name(design)
        if design in self._finished:
            yield answer_data(tables(self._finished[design]), name)
            return
        results, solved = without_scatter(scene)
        yield answer_data(tables(results), name)
        if results.unfinished:
            results = with_scatter(results, solved)
            yield answer_data(densities(results), name)
        self._finished[design] = results
