"""Conversation with an open page: the server answers the newest question and drops older ones.

``live`` and ``bench.session`` use it, and define what a question asks for. A question is the data of a Bokeh source.
"""

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

#: Function that yields the answers to a question, given its data and a function that says whether a newer one waits.
Answerer = Callable[[Any, Callable[[], bool]], Iterator[dict[str, Any]]]


class Conversation:
    """Exchange of questions and answers between browser and server.

    The browser sends one message per question, because every message costs a round trip. The server sends one or
    several answers, the quick ones first, and computes them on a separate thread. A newer question replaces the waiting
    one and ends the answers to the one before. The page therefore follows a moving slider as fast as the model can be
    computed, and finally shows the slider's last value.

    Parameters
    ----------
    document
        The open page.
    question, answer
        Source that the browser fills, and source that it shows; answers are written to it as ``packed``.
    answers
        Function that yields the answers to a question.
    rest
        Time without a newer question after which the second answer to a question is begun [s]. If it began earlier, it
        would delay the first answer to the next question while a slider moves.
    """

    def __init__(
        self, document: Document, question: ColumnDataSource, answer: ColumnDataSource, answers: Answerer, *,
        rest: float = 0.0,
    ) -> None:  # fmt: skip
        self._document, self._question, self._answer, self._answers = document, question, answer, answers
        self._rest, self._newer = rest, asyncio.Event()
        self._wanted, self._running = False, False
        question.on_change("data", self._asked)

    def _asked(self, _attr: str, _old: Any, _new: Any) -> None:
        """Note a new question, and start answering unless ``_work`` is running."""
        self._wanted = True
        self._newer.set()
        if not self._running:
            self._running = True
            work: Any = self._work  # Any: Bokeh's types do not know coroutines as callbacks
            self._document.add_next_tick_callback(work)

    @without_document_lock
    async def _work(self) -> None:
        """Answer until no question waits."""
        while self._wanted:
            self._wanted = False
            self._newer.clear()
            answers, rest = self._answers(self._question.data, lambda: self._wanted), self._rest
            while not self._wanted and (answer := await asyncio.to_thread(_next, answers)) is not None:
                shown = asyncio.Event()
                self._document.add_next_tick_callback(lambda answer=answer, shown=shown: self._show(answer, shown))
                await shown.wait()
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._newer.wait(), rest)
                rest = 0.0  # only the second answer waits
        self._running = False

    def _show(self, answer: dict[str, Any], shown: asyncio.Event) -> None:
        """Send an answer to the page, and set the event ``shown``."""
        self._answer.data = answer
        shown.set()


def _next(answers: Iterator[dict[str, Any]]) -> dict[str, Any] | None:
    """Next answer, packed; None after the last."""
    answer = next(answers, None)
    return None if answer is None else packed(answer)


def packed(answer: dict[str, Any]) -> dict[str, list[str]]:
    """Pack an answer into one JSON text, in one column; arrays are 4-byte floats in base 64.

    Bokeh would send every array as two separate messages, and every message costs a round trip.
    """
    return {"packed": [json.dumps(answer, default=_array, separators=(",", ":"))]}


def _array(values: np.ndarray) -> dict[str, Any]:
    """Array for JSON: its little-endian 4-byte floats in base 64, and its shape."""
    floats = np.ascontiguousarray(values, dtype="<f4")
    return {"float32": base64.b64encode(floats.tobytes()).decode("ascii"), "shape": values.shape}
