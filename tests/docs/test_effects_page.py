"""docs/effects.md is made from the registry: up to date in all but the times."""

from __future__ import annotations

import re

import pytest

from docs.effects_page import page
from gearbench.effects.registry import EFFECTS, effect_class
from tests.support.paths import ROOT

TARGET = ROOT / "docs" / "effects.md"


def without_times(text: str) -> str:
    return re.sub(r"^- Cost: .*$", "- Cost", text, flags=re.MULTILINE)


def test_the_page_is_up_to_date():
    stored = TARGET.read_text(encoding="utf-8")
    assert without_times(stored) == without_times(page()), "run: python -m docs.generate effects.md"


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_says_what_when_and_whence(name):
    effect = effect_class(name)
    assert effect.summary.startswith(("compliance: ", "gap: "))
    assert effect.use.endswith(".")
    assert effect.source
    assert f"[effects.{name}]" in TARGET.read_text(encoding="utf-8")
