"""Controls of a scene, made from its input classes: every key with unit, limits and meaning."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from gearbench.effects.registry import effect_class, effect_names
from gearbench.errors import GearbenchError
from gearbench.results.quantities import KEYS
from gearbench.scene import Scene
from gearbench.scene_file import TABLES
from gearbench.schema import Key, keys, parts, unannotated

Kind = Literal["number", "integer", "choice", "switch", "list"]

#: Half range of a slider whose value is zero, by unit.
_SPANS = {"µm": 20.0, "mm": 2.0, "°": 10.0, "N·m": 100.0}
#: Step of a slider is its range over this number, rounded up to 1, 2 or 5 times a power of ten.
_STEPS = 200


@dataclass(frozen=True, kw_only=True)
class Control:
    """Control of one key of a scene.

    Parameters
    ----------
    path
        Dotted key, e.g. "pair.pinion.teeth".
    label, unit, meaning
        Texts to show; the unit is "" if there is none.
    kind
        Number, whole number, one of ``choices``, switch, or list of numbers.
    value
        Value in the scene, or the default; None if the key is absent and its value is derived.
    optional
        Whether the key may be absent.
    low, high, step
        Ends and step of the slider; None if there is no slider.
    least, most
        Limits of the value; None if there are none.
    choices
        Allowed values of a choice.
    """

    path: str
    label: str
    unit: str
    meaning: str
    kind: Kind
    value: Any
    optional: bool
    low: float | None = None
    high: float | None = None
    step: float | None = None
    least: float | None = None
    most: float | None = None
    choices: tuple[Any, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Group:
    """Controls of one table of a scene.

    Parameters
    ----------
    path, title, text
        Dotted name of the table, its heading, and its description.
    controls
        Controls of its keys.
    present
        Whether the scene has the table.
    optional
        Whether the table may be left out, as effects may.
    inner
        Whether the table is inside an effect's table and shown only with it.
    """

    path: str
    title: str
    text: str
    controls: tuple[Control, ...]
    present: bool
    optional: bool
    inner: bool = False


def form(scene: Scene) -> tuple[Group, ...]:
    """Groups of controls: pair, both gears, load, resolution, then every effect that the page can add or show."""
    tables = scene.to_mapping()
    groups = []
    for name, kind in TABLES.items():
        groups += _groups(kind, name, tables.get(name, {}), present=True, optional=False)
    for name in effect_names():
        given = tables["effects"].get(name)
        try:
            kind = effect_class(name)
        except GearbenchError:  # skip a broken effect of another package; the scene works without it
            continue
        if given is not None or not takes_files(kind):
            shown = kind.example if given is None else given
            groups += _groups(kind, f"effects.{name}", shown, present=given is not None, optional=True)
    return tuple(groups)


def _groups(
    kind: type, path: str, table: Mapping[str, Any], *, present: bool, optional: bool, inner: bool = False
) -> Iterator[Group]:
    """Yield the group of an input class, then the groups of the tables inside it."""
    fixed = takes_files(kind)
    # an optional inner table has controls only if the scene has it
    below = {
        name: key.table
        for name, key in keys(kind).items()
        if key.table is not None and not key.items and (NoneType not in get_args(key.hint) or name in table)
    }
    found = [] if fixed else [_control(key, f"{path}.{name}", table.get(name)) for name, key in keys(kind).items()]
    yield Group(
        path=path,
        title=": ".join(part.replace("_", " ") for part in path.split(".")[1 if inner else -1 :]).capitalize(),
        text=" ".join(parts(kind)[0].split("\n\n")[0].split()),
        controls=tuple(each for each in found if each is not None),
        present=present,
        optional=optional,
        inner=inner,
    )
    for name, lower in below.items():
        within = inner or path.startswith("effects.")
        yield from _groups(lower, f"{path}.{name}", table.get(name, {}), present=present, optional=False, inner=within)


def takes_files(kind: type) -> bool:
    """Whether an input class names files; the page shows the heading of its table but cannot change it."""
    return any(name.endswith("_sha256") for name in keys(kind))


def _control(key: Key, path: str, given: Any) -> Control | None:
    """Make the control of a value; None if the page has no control for its type."""
    if key.table is not None:
        return None
    hints = key.hints
    optional = NoneType in get_args(key.hint) or key.default is not MISSING
    default = None if key.default is MISSING else key.default
    value = default if given is None else given
    quantity = KEYS.get(".".join(path.split(".")[-2:])) or KEYS.get(key.name)
    label = key.name.replace("_", " ") if quantity is None else quantity.label
    unit = key.unit if quantity is None else quantity.unit
    common = {"path": path, "label": label, "unit": unit, "meaning": key.meaning, "optional": optional}
    plain, _ = unannotated(hints[0])
    if len(hints) == 1 and get_origin(plain) is Literal:
        return Control(**common, kind="choice", value=value, choices=get_args(plain))
    if plain is bool:
        return Control(**common, kind="switch", value=bool(value))
    if plain in (int, float):
        least, most, above = key.limits
        narrow = path.startswith("pair.") and key.name not in ("profile_shift", "helix_angle")
        low, high, step = _span(value, least, most, unit, whole=plain is int, above=above, narrow=narrow)
        if path == "load.torque" and value is not None:  # keep the sign: a torque of 0 loads neither flank
            low, high, step = _same_sign(value, low, high, step)
        kind: Kind = "integer" if plain is int else "number"
        return Control(**common, kind=kind, value=value, least=least, most=most, low=low, high=high, step=step)
    if get_origin(plain) is tuple and all(unannotated(item)[0] in (int, float, ...) for item in get_args(plain)):
        return Control(**common, kind="list", value=None if value is None else list(value))
    return None


def _span(
    value: float | None, least: float | None, most: float | None, unit: str, *, whole: bool, above: bool, narrow: bool
) -> tuple[float | None, float | None, float | None]:
    """Ends and step of a slider for ``value``: round numbers within the limits; None if the value is absent.

    The slider runs from zero to about twice the value, or, if ``narrow``, from 20 % below to 20 % above the value.
    """
    if value is None:
        return None, None, None
    low, high = (0.0, round_up(2 * value)) if value > 0 else (-1.0, 1.0)
    if value <= 0:
        low, high = (x * (round_up(-2 * value) if value else _SPANS.get(unit, 1.0)) for x in (low, high))
    if narrow and value > 0:
        low, high = 0.8 * value, 1.2 * value
    step = 1.0 if whole else round_up((high - low) / _STEPS)
    low, high = math.floor(low / step) * step, math.ceil(high / step) * step
    low = low if least is None else max(low, math.ceil(least / step) * step + (step if above else 0.0))
    high = high if most is None else min(high, math.floor(most / step) * step)
    return _round(low), _round(high), _round(step)


def _same_sign(
    value: float, low: float | None, high: float | None, step: float | None
) -> tuple[float | None, float | None, float | None]:
    """Restrict the ends of a slider to the sign of ``value``, which is not 0, and exclude 0."""
    assert low is not None
    assert high is not None
    assert step is not None
    return (max(low, step), high, step) if value > 0 else (low, min(high, -step), step)


def _round(value: float) -> float:
    return float(f"{value:.10g}")


def round_up(value: float) -> float:
    """Least of 1, 2, 5 times a power of ten (from 1e-6) that is not below ``value``."""
    power = 1e-6
    while True:
        for step in (1, 2, 5):
            if step * power >= value * (1 - 1e-12):
                return step * power
        power *= 10
