"""A session of the live page: picks and sliders are answered with new pictures."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from bokeh.document import Document, without_document_lock
from bokeh.models import ColumnDataSource
from pydantic import ValidationError

from gearbench.errors import GearbenchError, InputError
from gearbench.explore.catalogue import Catalogue
from gearbench.explore.controls import places, settings_of, sliders
from gearbench.explore.gear_data import summary, tables
from gearbench.explore.model import picture
from gearbench.explore.page import Page, answer_data, knee
from gearbench.explore.scripts import script


class Session:
    """One open page.

    The browser asks one question at a time, a design and what its sliders say, and gets one answer: every message
    costs both sides a turn. Computing happens on a thread beside the server. While it runs, a newer question replaces
    the one that waits: the page follows a moving slider at the speed of the model, and ends with the last value.
    """

    def __init__(self, catalogue: Catalogue, document: Document) -> None:
        self._catalogue, self._document = catalogue, document
        first = knee(catalogue)
        self._stored = lru_cache(maxsize=64)(lambda design: picture(catalogue.scene(design)))
        before = self._stored(first)
        self._question = ColumnDataSource({"design": [first], "settings": [None]}, name="question")
        self._wanted, self._running = False, False
        self._page = Page(catalogue, first, tables(before), summary(catalogue.name(first), before, before))
        moved = sliders(catalogue.scene(first))
        self._page.listen(moved)
        ask = script("ask", question=self._question, answer=self._page.answer, pick=self._page.pick, sliders=moved)
        self._page.pick.js_on_change("data", ask)
        for slider in moved:
            slider.js_on_change("value", ask)
        self._question.on_change("data", self._asked)
        self._page.put(document, moved)

    @property
    def page(self) -> Page:
        """The parts of the page."""
        return self._page

    def _asked(self, _attr: str, _old: Any, _new: Any) -> None:
        self._wanted = True
        if not self._running:
            self._running = True
            work: Any = self._work
            self._document.add_next_tick_callback(work)

    @without_document_lock
    async def _work(self) -> None:
        """Compute until nothing newer is wanted."""
        while self._wanted:
            self._wanted = False
            asked: Any = self._question.data
            found = await asyncio.to_thread(self._answer, asked["design"][0], asked["settings"][0])
            shown = asyncio.Event()
            self._document.add_next_tick_callback(lambda found=found, shown=shown: self._show(found, shown))
            await shown.wait()
        self._running = False

    def _answer(self, design: Any, values: Mapping[str, Any] | None) -> dict[str, Any]:
        """Answer to a question; what is wrong with it stands in its message."""
        try:
            scene = self._catalogue.scene(int(design))
            before, name = self._stored(int(design)), self._catalogue.name(int(design))
            if values is None:
                shown = tables(before)
                return answer_data(shown, shown, summary(name, before, before), controls=places(scene))
            changed = settings_of(scene, values).applied(scene)
            now = before if changed == before.scene else picture(changed)
            return answer_data(tables(now, teeth=False), None, summary(name, before, now))
        except ValidationError as error:
            return answer_data(message=str(error.errors()[0]["msg"]))
        except (InputError, GearbenchError, ArithmeticError) as error:
            # a design that cannot be computed has no sliders either
            return answer_data(message=str(error), controls={} if values is None else None)
        except (IndexError, KeyError, TypeError, ValueError):
            return answer_data(message="this is no question of the page")

    def _show(self, found: dict[str, Any], shown: asyncio.Event) -> None:
        self._page.answer.data = found
        shown.set()
