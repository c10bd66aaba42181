"""Reader of scene files (TOML), and scenes from nested tables."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from gearbench.effects.base import Effect
from gearbench.effects.registry import EFFECTS, RENAMED, effect_class, effect_names
from gearbench.errors import InputError, naming, one_of
from gearbench.geometry.names import GEARS, MEMBERS, SHARED
from gearbench.geometry.pair import Pair
from gearbench.keys import key_at, with_values
from gearbench.loads import DrivingScene, Load, WeightedLoad, greatest_load
from gearbench.named_files import circle, content, files_of, in_folder
from gearbench.scene import Operation, Resolution, Scene
from gearbench.schema import Key, as_table, changed, make, read, read_toml

_LOG = logging.getLogger(__name__)

#: Tables of a scene other than those of its effects.
TABLES: dict[str, type] = {"pair": Pair, "load": Load, "operation": Operation, "resolution": Resolution}
#: Tables of a train, which replace the table "pair".
OF_TRAIN = ("gears", "meshes", "planetary")
#: Tables of the effects, and of those that differ on the coast flanks.
EFFECT_TABLES = ("effects", "coast")
#: Keys allowed at the top level of a scene file.
TOP = ("name", *TABLES, "loads", *OF_TRAIN, *EFFECT_TABLES, "system")


def read_scene(path: str | Path) -> Scene:
    """Read a scene from a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or does not describe a scene that can be simulated.

    Examples
    --------
    >>> scene = read_scene("examples/case1.toml")
    >>> scene.name, scene.pair.pinion.teeth, scene.load.torque
    ('case 1', 33, 13200.0)
    >>> [effect.name for effect in scene.effects]
    ['tooth_bending', 'hertz']
    """
    path = Path(path)
    with naming(path), files_of(path):
        scene = parse_scene(read_toml(path))
    _LOG.info("read %s: %s", path, ", ".join(effect.name for effect in scene.effects))
    return scene


def parse_scene(tables: Mapping[str, Any]) -> Scene:
    """Read a scene from nested tables, as in TOML; a table may also be the object that it describes.

    Raises
    ------
    InputError
        If the scene is not valid; names key, value and the allowed values.
    """
    if "load" in tables and "loads" in tables:
        raise InputError("loads", "given", "conflicts with load: give one of the two")
    tables = _loaded(tables)
    if not tables.keys().isdisjoint(OF_TRAIN):
        return _train(tables)
    parts = dict(tables)
    for key in parts:
        if key not in (*TOP, "gear_names"):
            raise InputError(key, "unknown key", one_of(key, TOP))
    effects, coast = (as_table(name, parts.pop(name, {})) for name in ("effects", "coast"))
    parts |= {name: read(kind, parts[name], name) for name, kind in TABLES.items() if name in parts}
    if "gear_names" in parts:
        parts["gear_names"] = tuple(parts["gear_names"])
    if "loads" in parts:
        parts["loads"] = loads = read_loads(parts["loads"], "loads")
        parts["load"] = greatest_load(loads)
    if "system" in parts:
        parts["system"] = system = read(table_class("system"), parts["system"], "system")
        parts["further"] = tuple(_further(mesh.scene, number) for number, mesh in enumerate(system.meshes))
    return make(Scene, **parts, effects=_effects("effects", effects), coast=_effects("coast", coast))


def _scene_in(key: str, name: str) -> Scene:
    """Read the scene in the file that a scene names at ``key``; refuse a file that names itself by way of others."""
    content(key, name)
    if files := circle(name):
        raise InputError(key, name, f"must not lead back to its own file: {' → '.join(file.name for file in files)}")
    return read_scene(in_folder(name))


def _loaded(tables: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the tables with torques in place of a driving scene."""
    given = tables.get("load")
    if not isinstance(given, Mapping) or "scene" not in given:
        return tables
    load = read(DrivingScene, given, "load")
    driving = _scene_in("load.scene", load.scene)
    if driving.train is None:
        z_1, z_2 = (gear.teeth for gear in driving.pair.gears)
        ratios = {driving.gear_names[1]: abs(z_2 / z_1)}
    else:
        ratios = driving.train.passed_on(driving.geometry)
    if load.member not in ratios:
        raise InputError("load.member", load.member, one_of(load.member, ratios))
    ratio, rest = ratios[load.member], {key: table for key, table in tables.items() if key != "load"}
    if driving.loads:
        return {**rest, "loads": [changed(each, torque=ratio * each.torque) for each in driving.loads]}
    return {**rest, "load": Load(torque=ratio * driving.load.torque)}


def _train(tables: Mapping[str, Any]) -> Scene:
    """Read a scene with gears and meshes; if there is only one mesh, the result is the scene of a pair."""
    from gearbench.geometry.train_tables import PARTS, TrainTables

    if "pair" in tables:
        other = "planetary" if "planetary" in tables else "gears"
        raise InputError("pair", "given", f"conflicts with {other}: give one of the two")
    train = TrainTables.of(tables, effect_names())
    rest = {name: table for name, table in tables.items() if name not in PARTS}
    pairs = train.pairs()
    if train.planetary is not None:
        train.planetary.check(pairs.values())
    geometry, scenes = train.train(pairs), []
    if train.planetary is None:
        geometry.check_room()
    coast, torques = train.coast(geometry), train.shares(geometry)
    for number, (name, pair) in enumerate(pairs.items()):
        try:
            loaded, other = (train.flanks(number, coast=side) for side in (coast[name], not coast[name]))
            different = {effect: table for effect, table in other.items() if table != loaded.get(effect)}
            parts = {**rest, "pair": pair, "effects": loaded, "coast": different}
            if scenes:
                parts = parts | {"load": Load(torque=torques[name] * scenes[0].load.torque)}
                parts.pop("loads", None)
            scenes.append(parse_scene(parts))
        except InputError as error:
            raise train.named(error, number) from None
    first, *further = scenes
    if "system" in tables:
        system = train.system(geometry, as_table("system", tables["system"]))
        first = changed(first, system=read(table_class("system"), system, "system"), further=tuple(further))
    if not further:
        return changed(first, gear_names=geometry.gears)
    train = replace(train, first=(first.pair, first.effects, first.coast, first.system))
    scene = changed(first, train=train, further=tuple(further))
    _ = scene.meshes  # check every mesh with its loads
    return scene


def read_loads(tables: Any, key: str) -> tuple[WeightedLoad, ...]:
    """Read loads from the list of tables at ``key``.

    Raises
    ------
    InputError
        If they are not valid; names key, value and the allowed values.
    """
    if not isinstance(tables, list | tuple) or not tables:
        raise InputError(key, tables, f"must be one or more tables: [[{key}]]")
    return tuple(read(WeightedLoad, table, f"{key}.{i}") for i, table in enumerate(tables))


def scene_at(scene: Scene, point: Mapping[str, Any]) -> Scene:
    """Return ``scene`` with the values of ``point`` at dotted keys; items of lists count from 0.

    If ``point`` sets the torque of a scene with several loads, the result has this load alone.

    Raises
    ------
    InputError
        If a value is not allowed, or a list has no such item.
    """
    base = scene.under(scene.load) if scene.loads and "load.torque" in point else scene
    if base.train is not None and point:
        return parse_scene(with_values(base.to_mapping(), point))
    return with_values(base, {_of_pair(path, scene.gear_names): value for path, value in point.items()}, table_class)


def _of_pair(path: str, names: tuple[str, str]) -> str:
    """Translate the key of a named gear to that of a pair: "gears.motor.teeth" to "pair.pinion.teeth"."""
    head, _, below = path.partition(".")
    name, *rest = below.split(".")
    if head != "gears" or name not in names or not rest:
        return path
    gear, table = GEARS[names.index(name)], "coast" if rest[0] == "coast" else "effects"
    rest = rest[table == "coast" :]
    if rest[0] in effect_names():
        return ".".join([table, rest[0], gear, *rest[1:]])
    return ".".join(["pair", *([] if rest[0] in SHARED else [gear]), *rest])


def _effects(head: str, tables: Mapping[str, Any]) -> tuple[Effect, ...]:
    """Read effects from the tables below ``head``."""
    return tuple(read(table_class(f"{head}.{name}"), table, f"{head}.{name}") for name, table in tables.items())


def _further(name: str, number: int) -> Scene:
    """Read the scene of a further mesh from its file."""
    key = f"system.meshes.{number}.scene"
    scene = _scene_in(key, name)
    if scene.system is not None or scene.loads:
        raise InputError(key, name, "must be a scene without [system] and with one load")
    return scene


def table_class(table: str) -> type:
    """Find the input class of a table of a scene, e.g. "pair" or "effects.hertz".

    Raises
    ------
    InputError
        If a scene has no such table.
    """
    head, _, name = table.partition(".")
    if head in EFFECT_TABLES:
        if name in RENAMED:
            raise InputError(table, "old name", f"write {RENAMED[name]}")
        if name not in EFFECTS and name not in effect_names():
            raise InputError(table, "unknown effect", one_of(name, effect_names()))
        return effect_class(name)
    if table == "system":
        from gearbench.system.schema import System

        return System
    if table not in TABLES:
        raise InputError(table, "unknown key", one_of(table, TOP))
    return TABLES[table]


def _class_of_train(table: str) -> type:
    """Input class of a table of ``OF_TRAIN``."""
    from gearbench.geometry.planetary import Planetary
    from gearbench.geometry.train_tables import TrainGear, TrainMesh

    return {"gears": TrainGear, "meshes": TrainMesh, "planetary": Planetary}[table]


def scene_key(path: str) -> Key | None:
    """Find the key of a scene at a dotted path, e.g. "pair.pinion.teeth"; None if there is no such value.

    Raises
    ------
    InputError
        If the table is known but not the key; names the allowed keys.
    """
    head, *rest = path.split(".")
    if head == "planetary" and rest[:1] and rest[0] in MEMBERS:
        head = "gears"
    if head == "planetary":
        kind = _class_of_train(head)
    elif head in OF_TRAIN:
        kind, rest = _class_of_train(head), rest[1:]
        effect, *below = rest[1:] if rest[:1] == ["coast"] else rest or [""]
        if head == "gears" and effect in effect_names():
            kind, rest = effect_class(effect), [GEARS[0], *below]
    else:
        split = 1 if head in EFFECT_TABLES else 0
        try:
            kind = table_class(".".join([head, *rest[:split]]))
        except InputError:
            return None
        rest = rest[split:]
    try:
        return key_at(kind, ".".join(rest)) if rest else None
    except InputError as error:
        raise InputError("", path, error.allowed) from None
