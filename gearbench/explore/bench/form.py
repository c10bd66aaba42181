"""Controls of the design bench, made from the input classes of a scene: every key with unit, limits and meaning."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import MISSING, dataclass, field, replace
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from gearbench.effects.base import Effect
from gearbench.effects.registry import effect_class, effect_names
from gearbench.errors import GearbenchError
from gearbench.geometry.names import AT_RING, GEARS, MEMBERS, SHARED
from gearbench.geometry.pair import Member, Pair, foreign_keys
from gearbench.geometry.planetary import DEVIATIONS, Planetary, PlanetaryRunOut, PlanetaryScatter
from gearbench.geometry.train_tables import TrainGear, TrainMesh
from gearbench.keys import value_at
from gearbench.results.quantities import KEYS
from gearbench.scene import Scene
from gearbench.scene_file import TABLES
from gearbench.schema import Key, keys, parts, unannotated

Kind = Literal["number", "integer", "choice", "switch", "list", "words"]

#: Tables of a planetary set that may be left out → their class, and the keys with which the page adds them [µm].
_ADDED = {
    "planetary.run_out": (PlanetaryRunOut, {"sun": 20.0}),
    "planetary.scatter": (PlanetaryScatter, {"pin_tangential": 10.0}),
}
#: Text of the group of the coast flanks.
_COAST = "Effects of the coast flanks, on which a planet or idler makes contact in its second mesh."
#: Keys of gears whose sliders stay within 20 % of the value.
_NARROW = {*keys(Pair), *keys(TrainGear)} - {"profile_shift", "helix_angle"}

#: Half range of a slider whose value is zero, by unit.
_SPANS = {"µm": 20.0, "mm": 2.0, "°": 10.0, "N·m": 100.0}
#: Greatest number of steps of a slider; a step is 1, 2 or 5 times a power of ten.
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
        "number"; "integer"; "choice" of one of ``choices``; "switch"; "list" of numbers; "words", a list of some of
        ``choices``.
    value
        Value in the scene, or the default; None if the key is absent and its value is derived.
    optional
        Whether the key may be absent.
    low, high, step
        Ends and step of the slider; None if there is no slider.
    least, most
        Least and greatest allowed value; None if there is no limit.
    choices
        Allowed values of a choice, or words of a list.
    items
        Number of sliders of a list, one for each of its numbers; 0 if it has none.
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
    items: int = 0


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
    example
        Table to begin with once it is added.
    below
        Groups within this one: tables inside the table, and effects of the flanks of a gear.
    """

    path: str
    title: str
    text: str
    controls: tuple[Control, ...]
    present: bool = True
    optional: bool = False
    example: Mapping[str, Any] = field(default_factory=dict)
    below: tuple[Group, ...] = ()


def form(scene: Scene) -> tuple[Group, ...]:
    """Groups of controls: gears, load, resolution, then every effect that the page can add or show."""
    tables, groups = scene.to_mapping(), []
    for path, kind in _tables(tables):
        group = _group(kind, path, value_at(tables, path) or {})
        groups += [replace(inner, below=()) for inner in flat((group,))] if path == "pair" else [group]
    for path, (kind, example) in _ADDED.items():
        if path.partition(".")[0] in tables:
            groups.append(_optional(kind, path, value_at(tables, path), example))
    for name, kind in _effects():
        given = value_at(tables, f"effects.{name}")
        if given is not None or not takes_files(kind):
            groups.append(_optional(kind, f"effects.{name}", given, kind.example))
    return tuple(groups)


def flat(groups: Iterable[Group]) -> Iterator[Group]:
    """Yield all groups, each followed by those within it."""
    for group in groups:
        yield group
        yield from flat(group.below)


def _tables(tables: Mapping[str, Any]) -> Iterator[tuple[str, type]]:
    """Yield the dotted names of the tables of a scene, except its effects, with their input classes."""
    if "planetary" in tables:
        yield "planetary", Planetary
        yield from ((f"planetary.{name}", TrainGear) for name in MEMBERS if name in tables["planetary"])
    elif "gears" in tables:
        yield from ((f"gears.{name}", TrainGear) for name in tables["gears"])
        yield from ((f"meshes.{number}", TrainMesh) for number in range(len(tables["meshes"])))
    yield from ((name, kind) for name, kind in TABLES.items() if name != "pair" or name in tables)


def _effects() -> Iterator[tuple[str, type[Effect]]]:
    """Yield the names and classes of all effects."""
    for name in effect_names():
        with suppress(GearbenchError):  # skip a broken effect of another package; the scene works without it
            yield name, effect_class(name)


def _group(kind: type, path: str, table: Mapping[str, Any]) -> Group:
    """Make the group of an input class with the groups of the tables inside it."""
    # an optional inner table has controls only if the scene has it
    inner = {
        name: key.table
        for name, key in keys(kind).items()
        if key.table is not None and not key.items and (NoneType not in get_args(key.hint) or name in table)
    }
    below = [_group(lower, f"{path}.{name}", table.get(name, {})) for name, lower in inner.items()]
    left_out = ("shaft",) if kind is TrainGear and path.startswith("planetary.") else ()
    # module, pressure angle and helix angle are keys of the set; only the planet's gear at the ring may have its own
    left_out += SHARED if left_out and not path.endswith(AT_RING) else ()
    if kind in (Member, TrainGear):  # keys that only internal or only external gears have
        left_out += foreign_keys(table.get("teeth", -1 if path == "planetary.ring" else 1))  # only the sign matters
    with_control = {name: key for name, key in keys(kind).items() if name not in left_out and not takes_files(kind)}
    shown = [_control(key, f"{path}.{name}", table.get(name)) for name, key in with_control.items()]
    if kind is Planetary:
        number = len(table.get("positions", ())) or table.get("planets", Planetary.planets)
        per_planet = [f"{path}.{name}" for name in DEVIATIONS]
        shown = [_of_planets(c, number) if c and c.path in per_planet else c for c in shown]
    if kind is TrainGear:
        controls, groups = _flanks(path, table)
        of_coast_flanks = _flanks(f"{path}.coast", table.get("coast", {}))
        shown += controls
        below = [*below, *groups, _titled_group(f"{path}.coast", _COAST, *of_coast_flanks)]
    # first paragraph of the docstring
    text = " ".join(parts(kind)[0].split("\n\n")[0].replace("``", "").split())
    return _titled_group(path, text, shown, [group for group in below if group.path not in _ADDED])


def _titled_group(path: str, text: str, controls: Iterable[Control | None], below: Iterable[Group]) -> Group:
    """Make a group; its title comes from the path: "Pinion" (pair.pinion), "Meshes: 0", "Sun: tip relief"."""
    head, *rest = path.split(".")
    shown = rest[-1:] if head == "pair" else path.split(".") if head == "meshes" else rest
    return Group(
        path=path,
        title=": ".join(part.replace("_", " ") for part in shown or [head]).capitalize(),
        text=text,
        controls=tuple(control for control in controls if control is not None),
        below=tuple(below),
    )


def _optional(kind: type, path: str, given: Mapping[str, Any] | None, example: Mapping[str, Any]) -> Group:
    """Make the group of a table that may be left out; ``given`` is None if the scene does not have it."""
    group = _group(kind, path, example if given is None else given)
    return replace(group, present=given is not None, optional=True, example=example)


def _flanks(path: str, table: Mapping[str, Any]) -> tuple[list[Control | None], list[Group]]:
    """Controls and groups of the effects that the flanks of one gear of a train may have.

    These are the effects that have a value or a table for each gear of a pair.
    """
    controls, groups = [], []
    for name, kind in _effects():
        key, dotted = keys(kind).get(GEARS[0]), f"{path}.{name}"
        if key is None or takes_files(kind):
            continue
        if key.table is None:  # a value
            controls.append(_control(replace(key, name=name), dotted, table.get(name)))
        elif not key.items:
            example = {name: value for name, value in kind.example.items() if name in keys(key.table)}
            groups.append(_optional(key.table, dotted, table.get(name), example))
    return controls, groups


def _of_planets(control: Control, number: int) -> Control:
    """Add a slider for each planet to the control of a list of deviations [µm]."""
    # the sign makes the range symmetric about zero
    low, high, step = _span(-max(map(abs, control.value), default=0.0), None, None, "µm", whole=False)
    return replace(control, items=number, low=low, high=high, step=step)


def takes_files(kind: type) -> bool:
    """Whether an input class refers to files (it then has a key …_sha256); the page cannot change its table."""
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
        least, most, least_excluded = key.limits
        ends = {"least_excluded": least_excluded, "narrow": key.name in _NARROW, "one_sign": path == "load.torque"}
        low, high, step = _span(value, least, most, unit, whole=plain is int, **ends)
        kind: Kind = "integer" if plain is int else "number"
        return Control(**common, kind=kind, value=value, least=least, most=most, low=low, high=high, step=step)
    if get_origin(plain) is tuple:
        items = [unannotated(item)[0] for item in get_args(plain)]
        value = None if value is None else list(value)
        if get_origin(items[0]) is Literal:
            return Control(**common, kind="words", value=value, choices=get_args(items[0]))
        if all(item in (int, float, ...) for item in items):
            return Control(**common, kind="list", value=value)
    return None


def _span(
    value: float | None,
    least: float | None,
    most: float | None,
    unit: str,
    *,
    whole: bool,
    least_excluded: bool = False,
    narrow: bool = False,
    one_sign: bool = False,
) -> tuple[float | None, float | None, float | None]:
    """Lower end, upper end and step of a slider for ``value``: round numbers within the limits ``least`` and ``most``.

    The slider runs from zero to about twice the value. For a negative value or zero, it is symmetric about zero. If
    ``narrow``, it runs from 20 % below to 20 % above the value. If ``one_sign``, it keeps the sign of the value and
    leaves out 0, as for a torque, which at 0 would load neither flank. All three are None if the value is absent.
    """
    if value is None:
        return None, None, None
    if value > 0:
        low, high = 0.0, round_up(2 * value)
    else:
        high = round_up(-2 * value) if value else _SPANS.get(unit, 1.0)
        low = -high
    if narrow and value:
        low, high = sorted((0.8 * value, 1.2 * value))
    step = 1.0 if whole else round_up((high - low) / _STEPS)
    low, high = math.floor(low / step) * step, math.ceil(high / step) * step
    low = low if least is None else max(low, math.ceil(least / step) * step + (step if least_excluded else 0.0))
    high = high if most is None else min(high, math.floor(most / step) * step)
    low, high, step = _round(low), _round(high), _round(step)
    if one_sign:
        low, high = (max(low, step), high) if value > 0 else (low, min(high, -step))
    return low, high, step


def _round(value: float) -> float:
    """Round to ten digits, so that a decimal looks as a person writes it."""
    return float(f"{value:.10g}")


def round_up(value: float) -> float:
    """Least of 1, 2, 5 times a power of ten (from 1e-6) that is not below ``value``."""
    power = 1e-6
    while True:
        for step in (1, 2, 5):
            if step * power >= value * (1 - 1e-12):
                return step * power
        power *= 10
