"""Session of the live page: it answers picks and slider moves with new results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from bokeh.document import Document
from bokeh.models import ColumnDataSource
from pydantic import ValidationError

from gearbench.errors import GearbenchError, InputError
from gearbench.explore.catalogue import Catalogue
from gearbench.explore.controls import moved, positions, sliders
from gearbench.explore.conversation import Conversation
from gearbench.explore.gear_data import densities, tables
from gearbench.explore.look import script
from gearbench.explore.model import Picture, outline, picture, scattered
from gearbench.explore.page import Page, answer_data, knee
from gearbench.results.solved import Solved

#: Number of pictures of stored designs kept in memory.
KEPT = 64
#: Scatter that takes longer than this is sent in a separate answer [s].
PATIENCE = 0.04


class Session:
    """One open page. A question is a design and the values of its sliders, or None for the stored design.

    A question gets one answer, or two if the scatter over the errors takes long: first the curves, then the scatter.
    """

    def __init__(self, catalogue: Catalogue, document: Document) -> None:
        self._catalogue = catalogue
        first = knee(catalogue)
        self._stored: dict[int, Picture] = {}
        self.slow = False
        before = self._keep(first, self._finished(*outline(catalogue.scene(first))))
        question = ColumnDataSource({"design": [first], "settings": [None]}, name="question")
        self._page = Page(catalogue, first, tables(before))
        controls = sliders(catalogue.scene(first))
        self._page.listen(controls)
        ask = script("ask", question=question, answer=self._page.answer, pick=self._page.pick, sliders=controls)
        self._page.pick.js_on_change("data", ask)
        for slider in controls:
            slider.js_on_change("value", ask)
        self._talk = Conversation(
            document, question, self._page.answer,
            lambda asked, _overtaken: self.answers(asked["design"][0], asked["settings"][0]),
        )  # fmt: skip
        self._page.put(document, controls)

    @property
    def page(self) -> Page:
        """Parts of the page."""
        return self._page

    def answers(self, design: Any, values: Mapping[str, Any] | None) -> Iterator[dict[str, Any]]:
        """Yield one or two answers to a question; the last one carries an error message if there is one."""
        try:
            yield from self._picked(int(design)) if values is None else self._moved(int(design), values)
        except ValidationError as error:
            yield answer_data(message=str(error.errors()[0]["msg"]))
        except (InputError, GearbenchError, ArithmeticError) as error:
            # a picked design that cannot be computed has no sliders
            yield answer_data(message=str(error), controls={} if values is None else None)
        except (IndexError, KeyError, TypeError, ValueError):
            yield answer_data(message="this is no question of the page")

    def _picked(self, design: int) -> Iterator[dict[str, Any]]:
        scene, name = self._catalogue.scene(design), self._catalogue.name(design)
        known = self._stored.get(design)
        if known is not None:
            yield self._as_stored(known, name, positions(scene))
            return
        now, solved = outline(scene)
        if not (self.slow and now.unfinished):
            now = self._keep(design, self._finished(now, solved))
        yield self._as_stored(now, name, positions(scene))
        if now.unfinished:
            now = self._keep(design, self._finished(now, solved))
            yield answer_data(densities(now), densities(now), name)

    @staticmethod
    def _as_stored(picture: Picture, name: str, controls: dict[str, Any]) -> dict[str, Any]:
        shown = tables(picture)
        return answer_data(shown, shown, name, controls=controls)

    def _moved(self, design: int, values: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        scene, name = self._catalogue.scene(design), self._catalogue.name(design)
        before = self._stored.get(design) or self._keep(design, picture(scene))
        changed = moved(scene, values)
        if changed == scene:
            yield answer_data(tables(before, teeth=False), None, name)
            return
        now, solved = outline(changed)
        if not (self.slow and now.unfinished):
            now = self._finished(now, solved)
        yield answer_data(tables(now, teeth=False), None, name)
        if now.unfinished:
            now = self._finished(now, solved)
            yield answer_data(densities(now), None, name)

    def _finished(self, quick: Picture, solved: Solved) -> Picture:
        """Add the scatter to a picture; its time decides whether later scatter gets a separate answer (``slow``)."""
        done = scattered(quick, solved)
        self.slow = done.seconds - quick.seconds > PATIENCE
        return done

    def _keep(self, design: int, found: Picture) -> Picture:
        """Keep the picture of a stored design; drop the oldest if there are more than ``KEPT``."""
        self._stored[design] = found
        while len(self._stored) > KEPT:
            del self._stored[next(iter(self._stored))]
        return found
