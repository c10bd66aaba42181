"""Reader of study files (TOML); every error is one line that names file, key, value and the allowed values."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from gearbench.errors import InputError, naming, one_of
from gearbench.geometry.names import AT_RING, MEMBERS, RING
from gearbench.geometry.planetary import Planetary
from gearbench.optimisation.dataset import DIMENSIONS
from gearbench.optimisation.derived import DERIVED
from gearbench.optimisation.numbers import COST, NUMBERS, OF_OPERATION
from gearbench.optimisation.study import (
    RESPONSES,
    Algorithm,
    Limit,
    Objective,
    OptimisationStudy,
    Robustness,
    Speeds,
)
from gearbench.optimisation.variables import Variable
from gearbench.results.responses import is_response, quantity, responses
from gearbench.scene_file import read_loads, scene_key, table_class
from gearbench.schema import as_table, check, keys, make, read, read_toml

#: Tables of the base, of which one is given: it says whether the designs are pairs or planetary sets.
KINDS = ("pair", "planetary")
#: Prefix of the keys for random errors of a planetary set.
SCATTER = "planetary.scatter."
#: Tables of a study whose keys are the fields of a class.
_TABLES: dict[str, type] = {"algorithm": Algorithm, "robustness": Robustness, "speeds": Speeds}


def read_study(path: str | Path) -> OptimisationStudy:
    """Read a study from a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read, is not valid TOML, or does not describe a study that can be run.
    """
    with naming(path):
        return parse_study(read_toml(Path(path)))


def parse_study(tables: Mapping[str, Any]) -> OptimisationStudy:
    """Read a study from nested tables (as in TOML), and check it against the keys of a scene.

    Raises
    ------
    InputError
        If the study is not valid; the error names key, value and the allowed values.
    """
    known = keys(OptimisationStudy)
    for key in tables:
        if key not in known:
            raise InputError(key, "unknown key", one_of(key, known))
    for key in ("base", "variables", "objectives"):
        if key not in tables:
            raise InputError(key, "missing", "is required")
    parts = dict(tables)
    parts["base"] = as_table("base", tables["base"])
    parts["variables"] = tuple(_variables("", as_table("variables", tables["variables"])))
    parts["objectives"] = tuple(_objectives(tables["objectives"]))
    parts["constraints"] = dict(_constraints(as_table("constraints", tables.get("constraints", {}))))
    parts |= {key: read(kind, tables[key], key) for key, kind in _TABLES.items() if key in tables}
    study = make(OptimisationStudy, **parts)
    check_study(study)
    return study


def check_study(study: OptimisationStudy) -> None:
    """Check the keys of a study against those of a scene.

    Raises
    ------
    InputError
        If a key of the base or of a variable is not a key of a scene, a value has the wrong type, a required key is
        missing, two variables change the same key, or there are samples but no errors to draw.
    """
    set_by: dict[str, str] = {}  # key of the scene → variable that sets it
    for variable in study.variables:
        if variable.name in DIMENSIONS or quantity(variable.name) is not None:
            raise InputError(f"variables.{variable.name}", "reserved name", "results have this name: use another one")
        for path in changed_keys(variable):
            if path in set_by:
                raise InputError(f"variables.{variable.name}", path, f"is also changed by variables.{set_by[path]}")
            set_by[path] = variable.name
    if "loads" in study.base:
        _check_loads(study.base, set_by)
    _check_base(study.base, set_by)
    _check_quantities(study, set_by)
    scattered = "scatter" in study.base.get("planetary", {}) or any(p.startswith(SCATTER) for p in set_by)
    if study.robustness.samples > 0 and "manufacturing_errors" not in study.base.get("effects", {}) and not scattered:
        allowed = "samples need base.effects.manufacturing_errors; give samples = 0 to optimise without errors"
        raise InputError("robustness.samples", study.robustness.samples, allowed)


def _check_quantities(study: OptimisationStudy, set_by: Collection[str]) -> None:
    """Check the quantities of limits and objectives, and that ``costs`` lists all values of its variables."""
    used = {*study.constraints, *study.numbers}
    has_speed = "speed" in study.base.get("operation", {}) or "operation.speed" in set_by
    for name in OF_OPERATION:
        if name in used and not has_speed:
            raise InputError("base.operation.speed", "missing", f"is required for {name}")
    variables = {variable.name: variable for variable in study.variables}
    for name, costs in study.costs.items():
        if name not in variables:
            raise InputError("costs", name, f"must be the name of a variable: {', '.join(variables)}")
        grid = variables[name].grid
        if grid is None:
            raise InputError("costs", name, "is real: give the variable a step, or values")
        for value in costs.keys() ^ set(map(str, grid)):  # those that only one of the two has
            missing = value not in costs
            raise InputError(f"costs.{name}", value, "has no cost" if missing else "is not a value of the variable")
    if COST in used and not study.costs:
        raise InputError("costs", "missing", "is required where cost is an objective or a limit")


def changed_keys(variable: Variable) -> tuple[str, ...]:
    """List the keys of the scene that ``variable`` changes.

    Raises
    ------
    InputError
        If one of its paths is not a key of a scene, or its values do not have the type of that key. A value outside the
        limits of the key is accepted: the design is then an invalid gear set.
    """
    table = f"variables.{variable.name}"
    changed: list[str] = []
    for path in variable.paths:
        if path in DERIVED:
            if variable.sets is None and variable.kind == "choice":
                raise InputError(table, variable.values, f"{path} must be a number")
            changed += DERIVED[path][0]
            continue
        with naming(below=table):
            key = scene_key(path)
        if key is None:
            allowed = f"must be a key of a scene, e.g. pair.helix_angle, or one of {', '.join(DERIVED)}"
            raise InputError(table, path, allowed)
        listed = variable.grid if variable.values is not None or variable.sets is not None else None
        # of a range only the ends are checked, of a list every value
        codes = variable.bounds if listed is None else range(len(listed))
        for code in codes:
            if fault := key.fault(value := variable.assigned(code)[path]):
                # the message of `fault` says what the value must be; put the path before "must"
                raise InputError(table, repr(value), fault.replace("must", f"{path} must", 1))
        changed.append(path)
    return tuple(changed)


def _check_loads(base: Mapping[str, Any], set_by: Mapping[str, str]) -> None:
    """Check the loads of the base; with them, neither the base nor a variable may set a single load."""
    read_loads(base["loads"], "base.loads")
    if "load" in base:
        raise InputError("base.loads", "given", "conflicts with base.load: give one of the two")
    if "load.torque" in set_by:
        raise InputError(f"variables.{set_by['load.torque']}", "load.torque", "conflicts with base.loads")


def _check_base(base: Mapping[str, Any], set_by: Mapping[str, str]) -> None:
    """Check the tables of the base; ``set_by`` maps the keys that variables set to the names of the variables."""
    effects = as_table("base.effects", base.get("effects", {}))
    effects_of_variables = {path.split(".")[1]: {} for path in set_by if path.startswith("effects.")}
    geometry = "planetary" if "planetary" in base else "pair"
    for path in set_by:
        if (table := path.partition(".")[0]) in KINDS and table != geometry:
            raise InputError(f"variables.{set_by[path]}", path, f"is not a key of base.{geometry}")
    tables: dict[str, Any] = {geometry: {}} | ({} if "loads" in base else {"load": {}})
    tables |= {name: table for name, table in base.items() if name not in ("name", "effects", "loads")}
    tables |= {f"effects.{name}": table for name, table in {**effects_of_variables, **effects}.items()}
    checked_here: Collection[str] = set_by
    if geometry == "planetary":
        planetary = as_table("base.planetary", tables[geometry])
        tables[geometry] = {name: value for name, value in planetary.items() if name not in MEMBERS}
        # keys of the gears are checked by `_check_gears`
        checked_here = [path for path in set_by if path.split(".")[:2] not in [[geometry, name] for name in MEMBERS]]
        # the planet's flanks at the ring have a table of their own only if the base or a variable gives it
        has_at_ring = AT_RING in planetary or any(path.startswith(f"{geometry}.{AT_RING}.") for path in set_by)
        _check_gears({name: planetary.get(name, {}) for name in MEMBERS if name != AT_RING or has_at_ring}, set_by)
    with naming(below="base"):
        classes = [Planetary if name == "planetary" else table_class(name) for name in tables]
    for (name, table), kind in zip(tables.items(), classes, strict=True):
        try:
            set_keys = [path.removeprefix(f"{name}.") for path in checked_here if path.startswith(f"{name}.")]
            check(kind, table, f"base.{name}", set_keys)
        except InputError as error:
            where = ", here or as a variable" if error.value == "missing" else ""
            raise InputError(error.key, error.value, error.allowed + where) from None


def _check_gears(gears: Mapping[str, Any], set_by: Collection[str]) -> None:
    """Check the tables of the gears of a planetary set, by name; ``set_by`` holds the keys that variables set."""
    for name, table in gears.items():
        for path, value in _flat(f"planetary.{name}.", as_table(f"base.planetary.{name}", table)):
            try:
                key = scene_key(path)
            except InputError as error:
                raise InputError(f"base.{path}", "unknown key", error.allowed) from None
            if key and (fault := key.fault(tuple(value) if isinstance(value, list) else value)):
                raise InputError(f"base.{path}", value, fault)
        # by default the tooth number of the ring follows from the others
        if "teeth" not in table and f"planetary.{name}.teeth" not in set_by and name != RING:
            raise InputError(f"base.planetary.{name}.teeth", "missing", "is required, here or as a variable")


def _variables(prefix: str, tables: Mapping[str, Any]) -> Iterator[Variable]:
    """Yield the variables in nested tables; a table that holds only tables adds a part to their dotted names."""
    for name, table in tables.items():
        key = f"{prefix}{name}"
        if not isinstance(table, Mapping):
            raise InputError(f"variables.{key}", table, "must be a table, e.g. { min = 0.0, max = 5.0, step = 1.0 }")
        if "name" in table:
            allowed = f"must be left out: the variable has the name of its table, {key}"
            raise InputError(f"variables.{key}.name", table["name"], allowed)
        if isinstance(sets := table.get("sets"), Mapping):
            flat = {value: dict(_flat("", as_table(f"variables.{key}.sets.{value}", t))) for value, t in sets.items()}
            paths = list(next(iter(flat.values()), {}))
            yield read(Variable, {**table, "sets": flat, "paths": paths, "name": key}, f"variables.{key}")
        elif table and all(isinstance(value, Mapping) for value in table.values()):
            yield from _variables(f"{key}.", table)
        else:
            yield read(Variable, {"paths": [key], **table, "name": key}, f"variables.{key}")


def _flat(prefix: str, table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Flatten nested tables to dotted keys and values."""
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(f"{prefix}{name}.", value)
        else:
            yield f"{prefix}{name}", value


def _objectives(given: Any) -> Iterator[Objective]:
    """Yield the objectives of a list: a name stands for weight 1."""
    if not isinstance(given, (list, tuple)):
        raise InputError("objectives", given, "must be a list of names, or of tables of weights")
    for item in given:
        weights = {item: 1.0} if isinstance(item, str) else item
        if not isinstance(weights, Mapping):
            raise InputError("objectives", item, "must be a name, or a table of weights")
        try:
            yield read(Objective, {"weights": weights})
        except InputError as error:
            raise InputError(f"objectives.{error.key.removeprefix('weights.')}", error.value, error.allowed) from None


def _constraints(tables: Mapping[str, Any]) -> Iterator[tuple[str, Limit]]:
    """Yield limited quantities by name, with their limits."""
    for name, table in tables.items():
        if name not in NUMBERS and not is_response(name):
            known = dict.fromkeys([*RESPONSES, *NUMBERS, *responses()])
            raise InputError(f"constraints.{name}", "unknown quantity", one_of(name, known))
        yield name, read(Limit, table, f"constraints.{name}")
