"""Questions of a page and their answers: the newest question counts, and what is slow waits until a slider rests."""

import asyncio
import base64
import json
import threading

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="the explorer needs the extra gearbench[explore]")

from bokeh.document import Document
from bokeh.models import ColumnDataSource

from gearbench.explore.conversation import Conversation, packed


class Page:
    """A document whose callbacks run on a loop of its own."""

    def __init__(self, answers, **options):
        self.question = ColumnDataSource({"number": [0]})
        self.answer = ColumnDataSource({"number": [-1], "step": [-1]})
        self.seen = []
        document = Document()
        document.add_next_tick_callback = self.later
        self.answer.on_change("data", self.show)
        self.talk = Conversation(document, self.question, self.answer, answers, **options)

    def show(self, _attr, _old, new):
        found = json.loads(new["packed"][0])
        self.seen.append((found["number"][0], found["step"][0]))

    def later(self, callback):
        loop = asyncio.get_running_loop()
        if asyncio.iscoroutinefunction(callback):
            self.task = loop.create_task(callback())
        else:
            loop.call_soon(callback)


def run(page, numbers, pause):
    """Ask one question after another, ``pause`` seconds apart; what the page has seen once all is done."""

    async def ask():
        for number in numbers:
            page.question.data = {"number": [number]}
            await asyncio.sleep(pause)
        await page.task

    asyncio.run(ask())
    return page.seen


def test_the_slow_answer_waits_until_nothing_newer_is_asked():
    begun = []

    def answers(asked, _overtaken):
        (number,) = asked["number"]
        yield {"number": [number], "step": [1]}
        begun.append(number)
        yield {"number": [number], "step": [2]}

    seen = run(Page(answers, rest=0.25), range(1, 8), 0.05)
    assert begun == [7]
    assert seen == [*((n, 1) for n in range(1, 8)), (7, 2)]


def test_without_a_rest_the_second_answer_follows_at_once():
    def answers(asked, _overtaken):
        for step in (1, 2, 3):
            yield {"number": asked["number"], "step": [step]}

    assert run(Page(answers), [5], 0.0) == [(5, 1), (5, 2), (5, 3)]


def test_questions_asked_meanwhile_are_one_and_older_answers_end():
    release, begun = threading.Event(), []

    def answers(asked, _overtaken):
        (number,) = asked["number"]
        begun.append(number)
        assert release.wait(10)
        yield {"number": [number], "step": [1]}
        yield {"number": [number], "step": [2]}

    page = Page(answers)

    async def ask():
        for number in (1, 2, 3, 4):
            page.question.data = {"number": [number]}
            await asyncio.sleep(0.02)
        release.set()
        await page.task

    asyncio.run(ask())
    assert begun == [1, 4]
    assert page.seen == [(1, 1), (4, 1), (4, 2)]


def test_an_answer_is_one_text_with_its_arrays():
    curve, image = np.linspace(-1, 1, 7), np.array([[1.0, np.nan, 3.0], [4.0, 5.0, 6.0]])[:, ::-1]
    (text,) = packed({"now": [{"ste": {"value": curve}, "pressure": {"image": [image]}}], "message": [""]})["packed"]
    found = json.loads(text)
    assert found["message"] == [""]
    for sent, array in ((found["now"][0]["ste"]["value"], curve), (found["now"][0]["pressure"]["image"][0], image)):
        assert sent["shape"] == list(array.shape)
        np.testing.assert_array_equal(
            np.frombuffer(base64.b64decode(sent["float32"]), "<f4"), array.ravel().astype("f4")
        )
