"""Scenes from TOML files: every fault is one line naming file, key, value and what is allowed."""

from __future__ import annotations

import json
import logging
import tomllib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

from pydantic import TypeAdapter, ValidationError

from gearbench.effects.base import Effect
from gearbench.effects.files import content, files_in, in_folder
from gearbench.effects.registry import EFFECTS, effect_class
from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.scene import Load, Resolution, Scene

T = TypeVar("T")

_LOG = logging.getLogger(__name__)

_TABLES: dict[str, type] = {"pair": Pair, "load": Load, "resolution": Resolution}


def load_scene(path: str | Path) -> Scene:
    """Read a scene from a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read, is no TOML, or does not describe a scene that can be simulated.

    Examples
    --------
    >>> scene = load_scene("examples/case1.toml")
    >>> scene.name, scene.pair.pinion.teeth, scene.load.torque
    ('case 1', 33, 13200.0)
    >>> [effect.name for effect in scene.effects]
    ['tooth_bending', 'hertz']
    """
    path = Path(path)
    try:
        with files_in(path.parent):
            scene = parse_scene(read_toml(path))
    except InputError as error:
        raise error.in_file(str(path)) from None
    _LOG.info("read %s: %s", path, ", ".join(effect.name for effect in scene.effects))
    return scene


def read_toml(path: Path) -> dict[str, Any]:
    """Tables of a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read or is no TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError("", (error.strerror or "cannot be read").lower(), "must be a readable TOML file") from None
    except UnicodeDecodeError:
        raise InputError("", "not UTF-8 text", "must be a readable TOML file") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError("", "not TOML", str(error)) from None


def parse_scene(tables: Mapping[str, Any]) -> Scene:
    """Scene from nested tables (as read from TOML); a table may also be the object it describes.

    Raises
    ------
    InputError
        Naming key, value and what is allowed.
    """
    parts = dict(tables)
    effects = parts.pop("effects", {})
    if not isinstance(effects, Mapping):
        raise InputError("effects", effects, "must be a table with one table for each effect")
    for name, kind in _TABLES.items():
        if name in parts:
            parts[name] = _parse_table(name, kind, parts[name])
    if "system" in parts:
        from gearbench.system.schema import System

        parts["system"] = system = _parse_table("system", System, parts["system"])
        parts["further"] = tuple(_further(mesh.scene, number) for number, mesh in enumerate(system.meshes))
    parts["effects"] = tuple(_parse_effect(name, table) for name, table in effects.items())
    try:
        return Scene(**parts)
    except ValidationError as error:
        raise _one_line(error, Scene) from None


def _further(name: str, number: int) -> Scene:
    """Scene of a further mesh, in a file beside the scene file."""
    key = f"system.meshes.{number}.scene"
    content(key, name)
    scene = load_scene(in_folder(name))
    if scene.system is not None:
        raise InputError(key, name, "must be a scene without [system]")
    return scene


def _parse_table(key: str, kind: type[T], table: Any) -> T:
    if isinstance(table, kind):
        return table
    if not isinstance(table, Mapping):
        raise InputError(key, table, f"must be a table: [{key}]")
    try:
        return validate(kind, table)
    except InputError as error:
        raise error.within(key) from None


def _parse_effect(name: str, table: Any) -> Effect:
    if name not in EFFECTS:
        raise InputError(f"effects.{name}", "unknown effect", f"allowed: {', '.join(EFFECTS)}")
    return _parse_table(f"effects.{name}", effect_class(name), table)


def validate(kind: type[T], table: Mapping[str, Any]) -> T:
    """Object of an input class from nested tables, faults as ``InputError``."""
    # as JSON, because strict input classes take tables and lists from text only
    try:
        return TypeAdapter(kind).validate_json(json.dumps(table, default=str))
    except ValidationError as error:
        raise _one_line(error, kind) from None


_MISSING = ("missing", "missing_argument", "missing_keyword_only_argument")
_UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")


def _one_line(error: ValidationError, kind: type) -> InputError:
    """The most telling fault of a validation, as one line: a misspelt key before what is missing for it."""
    faults = error.errors()
    fault = next((fault for fault in faults if fault["type"] in _UNKNOWN), faults[0])
    key = ".".join(str(part) for part in fault["loc"])
    cause = fault.get("ctx", {}).get("error")
    if isinstance(cause, InputError):
        return cause.within(key) if key else cause
    if fault["type"] in _MISSING:
        return InputError(key, "missing", "is required")
    if fault["type"] in _UNKNOWN:
        return InputError(key, "unknown key", f"allowed: {', '.join(_keys(kind, fault['loc'][:-1]))}")
    allowed = fault["msg"].replace("Input should be", "must be").removeprefix("Value error, ")
    return InputError(key, repr(fault["input"]), allowed)


def _keys(kind: type, path: tuple[int | str, ...]) -> list[str]:
    """Keys of the table at ``path`` below an input class."""
    for part in path:
        if isinstance(part, int):  # of a list, whose items the hint before it names
            continue
        hint = get_type_hints(kind)[part]
        kind = next(t for t in (hint, *get_args(hint)) if isinstance(t, type) and is_dataclass(t))
    return [field.name for field in fields(kind)]
