"""Scenes from TOML files: every fault is one line naming file, key, value and what is allowed."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from gearbench.effects.base import Effect
from gearbench.effects.registry import EFFECTS, effect_class
from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.scene import Load, Resolution, Scene

T = TypeVar("T")

_TABLES: dict[str, type] = {"pair": Pair, "load": Load, "resolution": Resolution}


def load_scene(path: str | Path) -> Scene:
    """Read a scene from a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read, is no TOML, or does not describe a scene that can be simulated.
    """
    path = Path(path)
    try:
        return parse_scene(read_toml(path))
    except InputError as error:
        raise error.in_file(str(path)) from None


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
    """Scene from nested tables (as read from TOML).

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
    parts["effects"] = tuple(_parse_effect(name, table) for name, table in effects.items())
    try:
        return Scene(**parts)
    except ValidationError as error:
        raise _one_line(error) from None


def _parse_table(key: str, kind: type[T], table: Any) -> T:
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
        raise _one_line(error) from None


def _one_line(error: ValidationError) -> InputError:
    """The first fault of a validation, as one line."""
    fault = error.errors()[0]
    key = ".".join(str(part) for part in fault["loc"])
    cause = fault.get("ctx", {}).get("error")
    if isinstance(cause, InputError):
        return cause.within(key) if key else cause
    return InputError(key, _shown(fault), _allowed(fault))


def _shown(fault: Any) -> object:
    if fault["type"] in {"missing", "missing_argument", "missing_keyword_only_argument"}:
        return "missing"
    if fault["type"] in {"unexpected_keyword_argument", "extra_forbidden"}:
        return "unknown key"
    return repr(fault["input"])


def _allowed(fault: Any) -> str:
    if fault["type"].startswith("missing"):
        return "is required"
    if fault["type"] in {"unexpected_keyword_argument", "extra_forbidden"}:
        return "remove it, or check its spelling against the documented keys"
    return fault["msg"].replace("Input should be", "must be").removeprefix("Value error, ")
