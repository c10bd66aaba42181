"""Input classes: pydantic dataclasses whose fields are the keys of a TOML table.

Scenes, studies and the documentation use this one reader. The numpy docstring of an input class gives the meaning of
its keys. Every error in a table is one line that names key, value and the allowed values.
"""

from __future__ import annotations

import inspect
import json
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt
from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from gearbench.errors import InputError, one_of

T = TypeVar("T")

#: Configuration of all input classes: they refuse unknown keys, NaN, infinities and silent conversions.
STRICT = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

_MISSING = ("missing", "missing_argument", "missing_keyword_only_argument")
_UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")
_RANGE = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
#: Beginning of a fault's type → message.
_TYPES = {
    "int": "must be a whole number",
    "float": "must be a number",
    "bool": "must be true or false",
    "tuple": "must be a list",
    "string": "must be text",
}


@dataclass(frozen=True, kw_only=True)
class Key:
    """A key of a table.

    Parameters
    ----------
    name
        Name of the key.
    hint
        Type of the value, with its limits.
    default
        Value if the key is absent; ``dataclasses.MISSING`` if it is required.
    meaning
        One or more sentences, with the unit in brackets.
    table
        Input class of the table that the key holds; None if it holds a value.
    """

    name: str
    hint: Any
    default: Any
    meaning: str
    table: type | None

    @property
    def unit(self) -> str:
        """Unit of the value, "" if it has none."""
        match = re.search(r"\[([^]]+)\]", self.meaning)
        return match[1] if match else ""

    @property
    def items(self) -> bool:
        """Whether the key holds a list, or a table of items by name."""
        return any(get_origin(unannotated(hint)[0]) in (tuple, dict) for hint in self.hints)

    @property
    def hints(self) -> tuple[Any, ...]:
        """Types of the value, without None."""
        every = get_args(self.hint) if NoneType in get_args(self.hint) else (self.hint,)
        return tuple(hint for hint in every if hint is not NoneType)

    @property
    def number(self) -> type | None:
        """``int`` or ``float`` if the key holds a number or a list of numbers; else None."""
        types = {hint for hint in _within(self.hint) if hint in (int, float)}
        return float if float in types else int if types else None

    @property
    def limits(self) -> tuple[float | None, float | None, bool]:
        """Least and greatest value of a number (None without a limit), and whether the least itself is excluded."""
        notes = [note for hint in _within(self.hint) for note in unannotated(hint)[1]]
        flat = [limit for note in notes for limit in (note.metadata if isinstance(note, FieldInfo) else (note,))]
        bounds = {type(note): note for note in flat}
        least = bounds[Ge].ge if Ge in bounds else bounds[Gt].gt if Gt in bounds else None
        most = bounds[Le].le if Le in bounds else bounds[Lt].lt if Lt in bounds else None
        return least, most, Gt in bounds

    def fault(self, value: Any) -> str | None:
        """Message on a wrong type of ``value``; None if the type is right. Limits are not checked."""
        faults = _faults(TypeAdapter(self.hint, config=STRICT), value)
        wrong = (fault for fault in faults if fault["type"] not in (*_RANGE, "value_error"))
        return next((_message(fault, self.unit) for fault in wrong), None)


@cache
def keys(kind: type) -> dict[str, Key]:
    """Keys of an input class by name, in the order of its fields."""
    hints, meanings = get_type_hints(kind, include_extras=True), {}
    for base in reversed(kind.__mro__[:-1]):  # inherited fields are described in their class
        meanings |= parts(base)[1]
    keys_by_name = {}
    for field in fields(kind):
        hint, default = hints[field.name], field.default
        default = default if field.default_factory is MISSING else field.default_factory()
        table = next((t for t in _within(hint) if isinstance(t, type) and is_dataclass(t)), None)
        meaning = meanings.get(field.name, "")
        keys_by_name[field.name] = Key(name=field.name, hint=hint, default=default, meaning=meaning, table=table)
    return keys_by_name


def unannotated(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """Split a type into the bare type and its annotations."""
    notes: tuple[Any, ...] = ()
    while hasattr(hint, "__metadata__"):
        notes += hint.__metadata__
        hint = hint.__origin__
    return hint, notes


def _within(hint: Any) -> Iterator[Any]:
    """Yield a type and all types inside it."""
    yield hint
    for part in get_args(hint):
        yield from _within(part)


def parts(kind: type) -> tuple[str, dict[str, str]]:
    """Split the docstring of a class into the text before its parameters, and the texts by parameter."""
    text, _, rest = (inspect.getdoc(kind) or "").partition("\n\nParameters\n----------\n")
    meanings = {}
    for names, meaning in re.findall(
        r"^(\S.*)\n((?:    .*\n?|\n)+)", re.split(r"\n\n\w+\n---", rest)[0], flags=re.MULTILINE
    ):
        meanings |= dict.fromkeys(names.split(", "), " ".join(meaning.split()))
    return text, meanings


def read_toml(path: Path) -> dict[str, Any]:
    """Read the tables of a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML; names the file.
    """
    try:
        text = path.read_text(encoding="utf-8")
        return tomllib.loads(text)
    except OSError as error:
        reason = (error.strerror or "cannot be read").lower()
        raise InputError("", reason, "must be a readable TOML file", str(path)) from None
    except UnicodeDecodeError:
        raise InputError("", "not UTF-8 text", "must be a readable TOML file", str(path)) from None
    except RecursionError:
        raise InputError("", "not TOML", "nested too deeply", str(path)) from None
    except ValueError as error:
        raise InputError("", "not TOML", str(error), str(path)) from None


def as_table(key: str, table: Any) -> Mapping[str, Any]:
    """Check that the value at ``key`` is a table, and return it.

    Raises
    ------
    InputError
        If it is not a table.
    """
    if not isinstance(table, Mapping):
        raise InputError(key, table, f"must be a table: [{key}]")
    return table


@cache
def _adapter(kind: type[T]) -> TypeAdapter[T]:
    return TypeAdapter(kind)


def read(kind: type[T], table: Any, key: str = "") -> T:
    """Make an object of an input class from the table at ``key``; an object of the class is returned unchanged.

    Raises
    ------
    InputError
        If the table is not valid; names key, value and the allowed values.
    """
    if isinstance(table, kind):
        return table
    try:
        # as JSON, because strict input classes take tables and lists from text only
        return _adapter(kind).validate_json(_json(as_table(key, table)))
    except ValidationError as error:
        raise _one_line(error.errors(), kind).within(key) from None


def make(kind: type[T], **given: Any) -> T:
    """Make an object of an input class from its fields.

    Raises
    ------
    InputError
        As in ``read``.
    """
    try:
        return kind(**given)
    except ValidationError as error:
        raise _one_line(error.errors(), kind) from None


def changed(table: T, **parts: Any) -> T:
    """Return an input object with changed fields.

    Raises
    ------
    InputError
        As in ``read``.
    """
    try:
        return replace(table, **parts)  # type: ignore[type-var]
    except ValidationError as error:
        raise _one_line(error.errors(), type(table)) from None


def check(kind: type, table: Any, key: str, later: Iterable[str]) -> None:
    """Check the table at ``key``, in which the dotted keys ``later`` will be set afterwards.

    Raises
    ------
    InputError
        If a key is unknown, a value is not allowed, or a key is missing that is not set later.
    """
    table = json.loads(_json(as_table(key, table)))
    for path in later:
        below = table
        for part in path.split(".")[:-1]:
            below = below.setdefault(part, {})
            if not isinstance(below, dict):
                break

    def excused(fault: Any) -> bool:
        at = tuple(map(str, fault["loc"]))
        below = [path for path in later if tuple(path.split("."))[: len(at)] == at]
        return bool(below) and (fault["type"] in _MISSING or fault["type"] == "value_error")

    faults = [fault for fault in _faults(TypeAdapter(kind), table) if not excused(fault)]
    if faults:
        raise _one_line(faults, kind).within(key)


def given(table: Any) -> dict[str, Any]:
    """Fields of an input object that differ from their defaults; nested objects become tables."""
    values = {name: (getattr(table, name), key.default) for name, key in keys(type(table)).items()}
    return {
        name: _plain(value)
        for name, (value, default) in values.items()
        if value is not None and not (value == default and type(value) is type(default))
    }


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return given(value)
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def _json(value: Any) -> str:
    return json.dumps(value, default=str)


def _faults(adapter: TypeAdapter, value: Any) -> list[Any]:
    try:
        adapter.validate_json(_json(value))
    except ValidationError as error:
        return error.errors()
    return []


def _message(fault: Any, unit: str) -> str:
    text: str = fault["msg"].replace("Input should", "must").removeprefix("Value error, ")
    if fault["type"] in _RANGE:
        text = text.replace("less than or equal to", "at most").replace("greater than or equal to", "at least")
        return f"{text} {unit}".strip()
    message = _TYPES.get(fault["type"].partition("_")[0], text)
    return f"{message}, in {unit}" if unit and message == _TYPES["float"] else message


def _one_line(faults: list[Any], kind: type) -> InputError:
    """Choose the most helpful fault of a validation, as one line: a misspelt key before the missing one."""
    fault = next((fault for fault in faults if fault["type"] in _UNKNOWN), faults[0])
    key = ".".join(str(part) for part in fault["loc"])
    cause = fault.get("ctx", {}).get("error")
    if isinstance(cause, InputError):
        return cause.within(key) if key else cause
    if fault["type"] in _MISSING:
        return InputError(key, "missing", "is required")
    unit = ""
    for part in map(str, fault["loc"][:-1] if fault["type"] in _UNKNOWN else fault["loc"]):
        if part in keys(kind):  # an index of a list is not one: the key before it gives the class of the items
            unit, kind = keys(kind)[part].unit, keys(kind)[part].table or kind
    if fault["type"] in _UNKNOWN:
        return InputError(key, "unknown key", one_of(str(fault["loc"][-1]), keys(kind)))
    return InputError(key, repr(fault["input"]), _message(fault, unit))
