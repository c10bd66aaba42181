"""Keys of a study against what a scene may hold: found before anything is computed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, get_args, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError

from gearbench.effects.registry import EFFECTS, effect_class
from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.optimise.derived import DERIVED, SETS
from gearbench.optimise.variables import Variable
from gearbench.scene import Load, Resolution

_TABLES: Mapping[str, type] = {"pair": Pair, "load": Load, "resolution": Resolution}
_STRICT = ConfigDict(strict=True, allow_inf_nan=False)
#: A value outside its range makes no gear, which is an answer; a value of the wrong type is a mistake.
_RANGE = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")


def check_variable(variable: Variable) -> tuple[str, ...]:
    """Keys of the scene that ``variable`` changes.

    Raises
    ------
    InputError
        If one of its paths is no key of a scene, or its values do not have the type of that key.
    """
    key = f"variables.{variable.name}"
    keys: list[str] = []
    for path in variable.paths:
        if path in DERIVED:
            if variable.kind == "choice":
                raise InputError(key, variable.values, f"{path} must be a number")
            keys += SETS[path]
            continue
        hint = _hint(path, key)
        for code in variable.bounds if variable.values is None else range(len(variable.values)):
            fault = _fault(hint, variable.value(code))
            if fault is not None and fault["type"] not in _RANGE:
                raise InputError(key, repr(fault["input"]), fault["msg"].replace("Input should", f"{path} must"))
        keys.append(path)
    return tuple(keys)


def check_base(base: Mapping[str, Any], driven: Mapping[str, str]) -> None:
    """Check the tables of the base, where ``driven`` are the keys that variables set.

    Raises
    ------
    InputError
        If a key is unknown, has the wrong type or is out of range, or if something required is missing.
    """
    for name, table in base.items():
        if name not in (*_TABLES, "effects", "name"):
            raise InputError(f"base.{name}", "unknown key", f"allowed: {', '.join((*_TABLES, 'effects'))}")
        if name != "name" and not isinstance(table, Mapping):
            raise InputError(f"base.{name}", table, f"must be a table: [base.{name}]")
    for name in ("pair", "load"):
        _check_table(name, _TABLES[name], base.get(name, {}), driven)
    if "resolution" in base:
        _check_table("resolution", Resolution, base["resolution"], driven)
    effects = {path.split(".")[1] for path in driven if path.startswith("effects.")}
    for name in dict.fromkeys((*base.get("effects", {}), *sorted(effects))):
        if name not in EFFECTS:
            raise InputError(f"base.effects.{name}", "unknown effect", f"allowed: {', '.join(EFFECTS)}")
        _check_table(f"effects.{name}", effect_class(name), base.get("effects", {}).get(name, {}), driven)


def _check_table(key: str, kind: type, table: Any, driven: Mapping[str, str]) -> None:
    if not isinstance(table, Mapping):
        raise InputError(f"base.{key}", table, f"must be a table: [base.{key}]")
    hints = get_type_hints(kind, include_extras=True)
    names = [field.name for field in fields(kind)]
    for name, value in table.items():
        if name not in names:
            raise InputError(f"base.{key}.{name}", "unknown key", f"allowed: {', '.join(names)}")
        if _nested(hints[name]) is None:
            fault = _fault(hints[name], value)
            if fault is not None:
                message = fault["msg"].replace("Input should be", "must be")
                raise InputError(f"base.{key}.{name}", repr(fault["input"]), message)
    for field in fields(kind):
        path, nested = f"{key}.{field.name}", _nested(hints[field.name])
        below = any(p == path or p.startswith(f"{path}.") for p in driven)
        required = field.default is MISSING and field.default_factory is MISSING
        if nested is not None and (field.name in table or below):
            _check_table(path, nested, table.get(field.name, {}), driven)
        elif required and field.name not in table and not below:
            raise InputError(f"base.{path}", "missing", "is required, here or as a variable")


def _hint(path: str, key: str) -> Any:
    """Type of the key ``path`` of a scene."""
    head, *rest = path.split(".")
    kind: Any = _TABLES.get(head)
    if head == "effects" and rest and rest[0] in EFFECTS:
        kind, rest = effect_class(rest[0]), rest[1:]
    for part in rest:
        kind = _nested(kind)
        hints = get_type_hints(kind, include_extras=True) if kind is not None else {}
        names = [field.name for field in fields(kind)] if kind is not None else []
        if part not in names:
            raise InputError(key, path, "must be a key of a scene" + (f": {', '.join(names)}" if names else ""))
        kind = hints[part]
    if kind is None or not rest or _nested(kind) is not None:
        raise InputError(key, path, f"must be a key of a scene, e.g. pair.helix_angle, or one of {', '.join(DERIVED)}")
    return kind


def _nested(hint: Any) -> type | None:
    """The table that a key holds, None where it holds a value."""
    return next((t for t in (hint, *get_args(hint)) if isinstance(t, type) and is_dataclass(t)), None)


def _fault(hint: Any, value: Any) -> Any:
    """The first fault of ``value`` as a key of that type, None where there is none."""
    try:
        TypeAdapter(hint, config=_STRICT).validate_json(json.dumps(value, default=str))
    except ValidationError as error:
        return error.errors()[0]
    return None
