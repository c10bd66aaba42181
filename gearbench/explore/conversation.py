"""Questions of an open page and their answers: the newest question counts."""

from __future__ import annotations

import asyncio
import base64
import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np
from bokeh.document import Document, without_document_lock
from bokeh.models import ColumnDataSource

#: Answers to the data of a question, one after the other; they may end once the function says that a newer one waits.
Answers = Callable[[Any, Callable[[], bool]], Iterator[dict[str, Any]]]


class Conversation:
    """Messages between browser and server.

    The browser asks one question at a time, because every message costs both sides a turn, and gets one answer or
    several, the quick ones first. Computing happens on a thread beside the server. While it runs, a newer question
    replaces the one that waits and ends the answers to the older one: the page follows a moving slider at the speed of
    the model, and ends with the last value.

    Parameters
    ----------
    document
        The open page.
    question, answer
        The source that the browser fills, and the one that it shows: it gets answers as ``packed``.
    answers
        From the data of a question to answers.
    rest
        Time without a newer question after which the second answer is begun [s]: once begun it would hold up the first
        answer to the next question of a slider that moves.
    """

    def __init__(
        self, document: Document, question: ColumnDataSource, answer: ColumnDataSource, answers: Answers, *,
        rest: float = 0.0,
    ) -> None:  # fmt: skip
        self._document, self._question, self._answer, self._answers = document, question, answer, answers
        self._rest, self._newer = rest, asyncio.Event()
        self._wanted, self._running = False, False
        question.on_change("data", self._asked)

    def _asked(self, _attr: str, _old: Any, _new: Any) -> None:
        self._wanted = True
        self._newer.set()
        if not self._running:
            self._running = True
            work: Any = self._work
            self._document.add_next_tick_callback(work)

    @without_document_lock
    async def _work(self) -> None:
        """Compute until nothing newer is wanted."""
        while self._wanted:
            self._wanted = False
            self._newer.clear()
            answers, rest = self._answers(self._question.data, lambda: self._wanted), self._rest
            while not self._wanted and (found := await asyncio.to_thread(_next, answers)) is not None:
                shown = asyncio.Event()
                self._document.add_next_tick_callback(lambda found=found, shown=shown: self._show(found, shown))
                await shown.wait()
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._newer.wait(), rest)
                rest = 0.0
        self._running = False

    def _show(self, found: dict[str, Any], shown: asyncio.Event) -> None:
        self._answer.data = found
        shown.set()


def _next(answers: Iterator[dict[str, Any]]) -> dict[str, Any] | None:
    found = next(answers, None)
    return None if found is None else packed(found)


def packed(answer: dict[str, Any]) -> dict[str, list[str]]:
    """An answer as one column of one text, JSON, its arrays 4-byte floats in base 64.

    Bokeh would send each array as two messages of its own, and every message costs both sides a turn.
    """
    return {"packed": [json.dumps(answer, default=_array, separators=(",", ":"))]}


def _array(values: np.ndarray) -> dict[str, Any]:
    little = np.ascontiguousarray(values, dtype="<f4")
    return {"float32": base64.b64encode(little.tobytes()).decode("ascii"), "shape": values.shape}
