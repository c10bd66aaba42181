"""Studies from TOML files: every fault is one line naming file, key, value and what is allowed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from gearbench.errors import InputError
from gearbench.optimise.constraints import check_limited
from gearbench.optimise.dataset import DIMENSIONS
from gearbench.optimise.schema import check_base, check_variable
from gearbench.optimise.study import Algorithm, Limit, Objective, OptimisationStudy, Robustness
from gearbench.optimise.variables import Variable
from gearbench.results.responses import quantity
from gearbench.scene_file import read_toml, validate

T = TypeVar("T")

_TABLES: dict[str, type] = {"algorithm": Algorithm, "robustness": Robustness}
_KEYS = tuple(field.name for field in fields(OptimisationStudy))


def load_study(path: str | Path) -> OptimisationStudy:
    """Read a study from a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read, is no TOML, or does not describe a study that can be run.
    """
    path = Path(path)
    try:
        return parse_study(read_toml(path))
    except InputError as error:
        raise error.in_file(str(path)) from None


def parse_study(tables: Mapping[str, Any]) -> OptimisationStudy:
    """Study from nested tables (as read from TOML), checked against what a scene may hold.

    Raises
    ------
    InputError
        Naming key, value and what is allowed.
    """
    for key in tables:
        if key not in _KEYS:
            raise InputError(key, "unknown key", f"allowed: {', '.join(_KEYS)}")
    for key in ("base", "variables", "objectives"):
        if key not in tables:
            raise InputError(key, "missing", "is required")
    parts: dict[str, Any] = {key: tables[key] for key in ("name",) if key in tables}
    parts["base"] = _table("base", tables["base"])
    parts["variables"] = tuple(_variables("", _table("variables", tables["variables"])))
    parts["objectives"] = tuple(_objectives(tables["objectives"]))
    parts["constraints"] = dict(_constraints(_table("constraints", tables.get("constraints", {}))))
    for key, kind in _TABLES.items():
        if key in tables:
            parts[key] = _parse(key, kind, _table(key, tables[key]))
    try:
        study = OptimisationStudy(**parts)
    except ValidationError as error:
        fault = error.errors()[0]
        cause = fault.get("ctx", {}).get("error")
        if isinstance(cause, InputError):
            raise cause from None
        raise InputError(".".join(map(str, fault["loc"])), repr(fault["input"]), fault["msg"]) from None
    check_study(study)
    return study


def check_study(study: OptimisationStudy) -> None:
    """Check the keys of a study against what a scene may hold.

    Raises
    ------
    InputError
        If a key of the base or of a variable is no key of a scene, a value has the wrong type, something required is
        missing, two variables change the same key, or the errors to draw are missing.
    """
    driven: dict[str, str] = {}
    for variable in study.variables:
        if variable.name in DIMENSIONS or quantity(variable.name) is not None:
            raise InputError(f"variables.{variable.name}", "reserved name", "results are called so: use another name")
        for path in check_variable(variable):
            if path in driven:
                raise InputError(f"variables.{variable.name}", path, f"is changed by variables.{driven[path]} too")
            driven[path] = variable.name
    check_base(study.base, driven)
    if study.robustness.samples > 0 and "manufacturing_errors" not in study.base.get("effects", {}):
        allowed = "samples need base.effects.manufacturing_errors; give samples = 0 to optimise without errors"
        raise InputError("robustness.samples", study.robustness.samples, allowed)


def _table(key: str, table: Any) -> Mapping[str, Any]:
    if not isinstance(table, Mapping):
        raise InputError(key, table, f"must be a table: [{key}]")
    return table


def _parse(key: str, kind: type[T], table: Mapping[str, Any]) -> T:
    try:
        return validate(kind, table)
    except InputError as error:
        raise error.within(key) from None


def _variables(prefix: str, tables: Mapping[str, Any]) -> Iterator[Variable]:
    """Variables of nested tables: one is where the keys are those of a variable."""
    for name, table in tables.items():
        key = f"{prefix}{name}"
        if not isinstance(table, Mapping):
            raise InputError(f"variables.{key}", table, "must be a table, e.g. { min = 0.0, max = 5.0, step = 1.0 }")
        if "name" in table:
            raise InputError(f"variables.{key}.name", table["name"], f"the variable's name is {key}")
        if table and all(isinstance(value, Mapping) for value in table.values()):
            yield from _variables(f"{key}.", table)
        else:
            yield _parse(f"variables.{key}", Variable, {"paths": [key], **table, "name": key})


def _objectives(given: Any) -> Iterator[Objective]:
    if not isinstance(given, (list, tuple)):
        raise InputError("objectives", given, "must be a list of names, or of tables of weights")
    for item in given:
        weights = {item: 1.0} if isinstance(item, str) else item
        if not isinstance(weights, Mapping):
            raise InputError("objectives", item, "must be a name, or a table of weights")
        try:
            yield validate(Objective, {"weights": weights})
        except InputError as error:
            raise InputError(f"objectives.{error.key.removeprefix('weights.')}", error.value, error.allowed) from None


def _constraints(tables: Mapping[str, Any]) -> Iterator[tuple[str, Limit]]:
    for name, table in tables.items():
        check_limited(name)
        yield name, _parse(f"constraints.{name}", Limit, _table(f"constraints.{name}", table))
