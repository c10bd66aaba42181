"""Pages that are made from the code are up to date."""

from __future__ import annotations

import csv
from io import StringIO

import pytest

from docs.generate import FOLDER, HIGHER, PAGES
from docs.keys import key_tables, prose
from gearbench.cli.app import COMMANDS
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.registry import EFFECTS, effect_class
from gearbench.effects.tip_relief import TipRelief
from gearbench.results.cycle import HARMONICS
from gearbench.results.quantities import QUANTITIES
from gearbench.results.responses import responses


@pytest.mark.parametrize("name", PAGES)
def test_the_page_is_up_to_date(name):
    assert (FOLDER / name).read_text(encoding="utf-8") == PAGES[name](), "run: make docs-tables"


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_says_what_when_and_whence(name):
    effect = effect_class(name)
    assert effect.name == name
    assert effect.summary.startswith(("compliance: ", "gap: "))
    assert effect.use.endswith(".")
    assert effect.source
    assert f"[effects.{name}]" in PAGES["effects.md"]()


def test_every_quantity_is_on_its_page_once():
    _, *rows = csv.reader(StringIO(PAGES["data/quantities.csv"]()))
    metrics = {name: each.quantity for name, each in responses().items() if not HIGHER.search(name)}
    everything = {**QUANTITIES, **metrics}
    shown = {name.strip("`"): symbol for _, name, symbol, *_ in rows}
    assert len(rows) == len(shown)
    assert shown.keys() == everything.keys()
    assert all(not quantity.unit or shown[name].endswith(f"[{quantity.unit}]") for name, quantity in everything.items())
    assert f"harmonics 1 to {HARMONICS};" in (FOLDER / "quantities.md").read_text(encoding="utf-8")


def test_every_command_is_on_its_page():
    page = PAGES["commands.md"]()
    for command in COMMANDS:
        assert f"## gearbench {command}\n" in page


def test_keys_have_meaning_default_and_what_is_allowed():
    assert prose(TipRelief).startswith("Tip relief: e = amount · (R − (r_a − length))/length")
    table = key_tables(TipRelief)
    assert "\n- `amount`: Material missing at the tip [µm].\n" in table
    assert "\n- `amount`: Material missing at the relieved end [µm]. (required)\n" in table
    assert "\n- `start_roll_angle`: Roll angle √(R² − r_b²)/r_b of the start [°]. (0 to 180)\n" in table
    shapes = '`"linear"`, `"parabolic"`, `"circular"`'
    assert f'\n- `shape`: Shape of the relief. ({shapes}, default `"linear"`)\n' in table


def test_tables_below_a_table_are_shown_once():
    assert key_tables(ManufacturingErrors).count("\n- `drawn`:") == 1
