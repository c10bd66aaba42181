"""docs/effects.md is made from the registry."""

from __future__ import annotations

import pytest

from docs.effects_page import page
from gearbench.effects.registry import EFFECTS, effect_class
from tests.support.paths import ROOT

TARGET = ROOT / "docs" / "effects.md"


def test_the_page_is_up_to_date():
    assert TARGET.read_text(encoding="utf-8") == page(), "run: python -m docs.generate effects.md"


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_says_what_when_and_whence(name):
    effect = effect_class(name)
    assert effect.summary.startswith(("compliance: ", "gap: "))
    assert effect.use.endswith(".")
    assert effect.source
    assert f"[effects.{name}]" in TARGET.read_text(encoding="utf-8")
