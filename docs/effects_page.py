"""docs/effects.md, from the registry."""

from __future__ import annotations

from typing import Any

from docs.keys import Shown, key_tables, prose, toml_value
from gearbench.effects.base import Effect
from gearbench.effects.registry import EFFECTS, effect_class

HEAD = """# Effects

An effect is simulated if its table is in the scene. Compliances (tooth_bending, gear_body, hertz) add up, and so do the
gaps of all other effects. Signs and axes: [Conventions](conventions.md). Effects of your own:
[Adding an effect or a metric](tutorial_effect.md).

![Every shape of a flank, over face width and roll angle](figures/micro_geometry.png)
"""


def page() -> str:
    """The text of docs/effects.md."""
    shown: Shown = {}
    return HEAD + "".join(section(effect_class(name), shown) for name in EFFECTS)


def section(effect: type[Effect], shown: Shown) -> str:
    """Section of one effect: its equations and keys, use, source and needs."""
    facts = {"Use": effect.use, "Source": effect.source}
    facts |= {"Requires": _reasons(effect.requires), "Conflicts with": _reasons(effect.conflicts)}
    listed = "".join(f"- {key}: {value}\n" for key, value in facts.items() if value)
    table = _table(f"effects.{effect.name}", effect.example)
    head = f"\n## {effect.name}\n\n{prose(effect)}\n\n{listed}\n```toml\n{table}```\n"
    return head + key_tables(effect, shown, f"[{effect.name}](#{effect.name})")


def _table(name: str, table: dict[str, Any]) -> str:
    """A table as TOML, those below it after its values."""
    below = {key: value for key, value in table.items() if isinstance(value, dict)}
    rows = {key: value for key, value in table.items() if isinstance(value, list) and isinstance(value[0], dict)}
    values = {key: value for key, value in table.items() if key not in below and key not in rows}
    own = "".join(f"{key} = {toml_value(value)}\n" for key, value in values.items())
    text = f"[{name}]\n{own}"
    text += "".join(f"[{_table(f'{name}.{key}', row).replace(']', ']]', 1)}" for key in rows for row in rows[key])
    return text + "".join(_table(f"{name}.{key}", value) for key, value in below.items())


def _reasons(others: dict[str, str]) -> str:
    return "; ".join(f"{name} ({reason})" for name, reason in others.items())
