"""A session of the live page: picks and sliders are answered with new pictures."""

from __future__ import annotations

import asyncio
from functools import lru_cache
from typing import Any

from bokeh.document import Document, without_document_lock
from pydantic import ValidationError

from gearbench.errors import GearbenchError, InputError
from gearbench.explore.catalogue import Catalogue
from gearbench.explore.controls import Controls
from gearbench.explore.gear_data import summary, tables
from gearbench.explore.model import Picture, picture
from gearbench.explore.page import Page, knee
from gearbench.explore.settings import Settings
from gearbench.scene import Scene


class Session:
    """One open page.

    Computing happens on a thread beside the server. While it runs, newer settings replace those that wait: the page
    follows a moving slider at the speed of the model, and ends with the last value.
    """

    def __init__(self, catalogue: Catalogue, document: Document) -> None:
        self._catalogue, self._document = catalogue, document
        self._design = knee(catalogue)
        self._scene = catalogue.scene(self._design)
        self._stored = lru_cache(maxsize=64)(lambda design: picture(catalogue.scene(design)))
        before = self._stored(self._design)
        self._controls = Controls()
        self._controls.show(self._scene)
        self._page = Page(catalogue, self._design, tables(before), tables(before))
        self._page.summary.text = summary(catalogue.name(self._design), before, before)
        self._setting, self._wanted, self._running = False, False, False
        self._page.pick.on_change("data", self._picked)
        for slider in self._controls.sliders.values():
            slider.on_change("value", self._changed)
        self._page.put(document, list(self._controls.sliders.values()))

    @property
    def page(self) -> Page:
        """The parts of the page."""
        return self._page

    def _picked(self, _attr: str, _old: Any, new: Any) -> None:
        design = int(new["design"][0])
        if not 0 <= design < len(self._catalogue):
            return
        self._design = design
        try:
            self._scene = self._catalogue.scene(design)
        except InputError as error:
            self._page.message.text = str(error)
            return
        self._setting = True
        self._controls.show(self._scene)
        self._setting = False
        self._ask()

    def _changed(self, _attr: str, _old: Any, _new: Any) -> None:
        if not self._setting:
            self._ask()

    def _ask(self) -> None:
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
            design, scene = self._design, self._scene
            settings = self._controls.settings(scene)
            answer = await asyncio.to_thread(self._answer, design, scene, settings)
            shown = asyncio.Event()
            self._document.add_next_tick_callback(lambda answer=answer, shown=shown: self._show(answer, shown))
            await shown.wait()
        self._running = False

    def _answer(self, design: int, scene: Scene, settings: Settings) -> tuple[int, Picture, Picture] | str:
        """Pictures as stored and with the settings, or what is wrong."""
        try:
            before = self._stored(design)
            changed = settings.applied(scene)
            return design, before, before if changed == before.scene else picture(changed)
        except ValidationError as error:
            return str(error.errors()[0]["msg"])
        except (InputError, GearbenchError, ArithmeticError) as error:
            return str(error)

    def _show(self, answer: tuple[int, Picture, Picture] | str, shown: asyncio.Event) -> None:
        if isinstance(answer, str):
            self._page.message.text = answer
        else:
            design, before, now = answer
            self._page.message.text = ""
            self._page.gear.update(tables(now), tables(before))
            self._page.summary.text = summary(self._catalogue.name(design), before, now)
        shown.set()
