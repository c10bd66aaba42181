"""Responses: scalar metrics of the mesh cycle of a pair or train, with their registry.

``simulate``, ``robust``, the accuracy control, objectives and limits of an optimisation, and the explorer use this
registry. An objective is ``<response>_<statistic>`` over the error samples. Other packages add responses by
``register``, or by an entry point of the group ``gearbench.metrics`` that names a ``Metric`` or a sequence of them.
Workers of a cluster know only those from entry points.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError, one_of
from gearbench.results.cycle import (
    HARMONICS,
    MeshCycle,
    coefficients,
    fluctuation_rms,
    mean,
    relative_rms,
)
from gearbench.results.quantities import QUANTITIES, Quantity
from gearbench.results.train_cycle import NUMBERS, Curve, TrainCycle

#: Group of the entry points.
GROUP = "gearbench.metrics"
#: Name of the group before version 1.0.
OLD_GROUP = "gearbench.responses"

#: Statistic over the error samples → function of the values (sample,), and its name in words.
STATISTICS: Mapping[str, tuple[Callable[[NDArray], float], str]] = MappingProxyType(
    {
        "mean": (lambda x: float(x.mean()), "mean"),
        "std": (lambda x: float(x.std(ddof=1)) if len(x) > 1 else float("nan"), "standard deviation"),
        "max": (lambda x: float(x.max()), "maximum"),
    }
)
#: Endings of names of a response combined over several loads, see ``sweeps.run``.
OVER_LOADS = ("_load_mean", "_load_max")


@dataclass(frozen=True, kw_only=True)
class Metric:
    """Scalar metric of a mesh cycle.

    Parameters
    ----------
    name
        Name in Datasets; with ``_mean``, ``_std`` or ``_max`` appended it names a statistic over error samples.
    quantity
        Unit, symbol and meaning.
    reduce
        Function from a ``MeshCycle`` or ``TrainCycle`` with curves (…, position) to numbers (…).
    of_train
        Whether the metric is one of trains, whose meshes form one contact problem.
    over_speed
        Whether the metric is one of the dynamic response over the speeds of a study; a mesh cycle alone does not give
        it.

    Raises
    ------
    InputError
        If the name is not a lower-case identifier, or is the name of another quantity.
    """

    name: str
    quantity: Quantity
    reduce: Callable[[Any], NDArray]
    of_train: bool = False
    over_speed: bool = False

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or self.name != self.name.lower():
            raise InputError("response", self.name, "must be a lower-case identifier")
        if self.name in QUANTITIES:
            raise InputError("response", self.name, "is the name of another quantity")


def register(*responses: Metric) -> None:
    """Register responses; registering the same one again changes nothing.

    Raises
    ------
    InputError
        If another response has the name.
    """
    for each in responses:
        if KNOWN.setdefault(each.name, each) != each:
            raise InputError("response", each.name, "is declared already")


def response(name: str, key: str = "response") -> Metric:
    """Find a response by name; ``key`` says where the name was given.

    Raises
    ------
    InputError
        If there is no such response.
    """
    if name not in KNOWN:
        installed()
    if name not in KNOWN:
        raise InputError(key, name, one_of(name, KNOWN))
    return KNOWN[name]


def check_responses(names: Iterable[str]) -> None:
    """Refuse unknown names of responses; raises as ``response``."""
    for name in names:
        response(name, "responses")


def responses() -> Mapping[str, Metric]:
    """All responses by name, including those of other packages."""
    installed()
    return MappingProxyType(KNOWN)


def is_response(name: str) -> bool:
    """Whether ``name`` is a response."""
    return name in KNOWN or name in responses()


def is_over_speed(name: str) -> bool:
    """Whether ``name`` is a metric of the dynamic response over a range of speeds."""
    return is_response(name) and response(name).over_speed


def is_of_train(name: str) -> bool:
    """Whether ``name`` is a metric of trains, see ``Metric``."""
    return is_response(name) and response(name).of_train


def split_statistic(name: str) -> tuple[str, str] | None:
    """Split a name such as "mesh_stiffness_rms_std" into metric and statistic; None for other names."""
    of, _, statistic = name.rpartition("_")
    return (of, statistic) if statistic in STATISTICS and is_response(of) else None


def statistics_of(names: Iterable[str]) -> tuple[str, ...]:
    """Names of all statistics of the responses ``names``."""
    return tuple(f"{name}_{statistic}" for name in names for statistic in STATISTICS)


def quantity(name: str) -> Quantity | None:
    """Unit, symbol and meaning of any variable of a Dataset; None for an unknown name.

    Derived names are understood: a statistic, its ``…_standard_error`` and its ``…_cell_error`` by the segments, the
    ``…_first_order`` and ``…_total`` shares of the errors in a variance, the change ``…_tightened`` of a mean if one
    error is a class finer, ``…_load_mean`` and ``…_load_max`` over several loads, the relative ``…_error`` against a
    reference with its ``…_bar``, and the value ``…_verified`` by a reference.
    """
    if name in QUANTITIES:
        return QUANTITIES[name]
    if is_response(name):
        return response(name).quantity
    of, _, statistic = name.rpartition("_")
    known = is_response(of) or of in QUANTITIES or of.endswith(OVER_LOADS)
    if statistic in STATISTICS and known and (q := quantity(of)):
        words = STATISTICS[statistic][1]
        return Quantity(q.units, f"{statistic} {q.symbol}", f"{words} over the error samples of the {q.long_name}")
    for suffix, derive in _DERIVED.items():
        if name.endswith(suffix) and (q := quantity(name.removesuffix(suffix))):
            return derive(q)
    return None


_DERIVED: Mapping[str, Callable[[Quantity], Quantity]] = MappingProxyType(
    {
        "_standard_error": lambda q: Quantity(q.units, f"s({q.symbol})", f"standard error of the {q.long_name}"),
        "_cell_error": lambda q: Quantity(q.units, f"ε({q.symbol})", f"error that segments leave of the {q.long_name}"),
        "_first_order": lambda q: Quantity("1", "S", f"share of each error in the variance of the {q.long_name}"),
        "_total": lambda q: Quantity(
            "1", "S_T", f"share of each error and its products in the {q.long_name}'s variance"
        ),
        "_tightened": lambda q: Quantity(q.units, f"Δ{q.symbol}", f"change of the mean {q.long_name}, one class finer"),
        "_verified": lambda q: Quantity(q.units, q.symbol, f"{q.long_name}, compliance of the reference"),
        "_error": lambda q: Quantity("%", f"error of {q.symbol}", f"error of the {q.long_name} against the reference"),
        "_load_mean": lambda q: Quantity(
            q.units, f"⟨{q.symbol}⟩", f"weighted mean over the loads of the {q.long_name}"
        ),
        "_load_max": lambda q: Quantity(q.units, f"max {q.symbol}", f"greatest over the loads of the {q.long_name}"),
        "_pinion": lambda q: Quantity(q.units, f"{q.symbol},1", f"{q.long_name} of the pinion"),
        "_wheel": lambda q: Quantity(q.units, f"{q.symbol},2", f"{q.long_name} of the wheel"),
        "_bar": lambda q: Quantity(q.units, f"± {q.symbol}", f"{q.long_name}: what the reference's own error adds"),
    }
)


def described(variables: Mapping[str, tuple[Any, Any]], missing: str = "") -> dict[str, tuple]:
    """Add the attributes of known quantities to variables, name → (dimensions, values).

    A variable with NaN among its values also gets the text ``missing`` as an attribute, which says why.
    """
    columns = {}
    for name, (dims, values) in variables.items():
        values, q = np.asarray(values), quantity(name)
        attrs = {} if q is None else q.attrs
        if missing and values.dtype.kind == "f" and np.isnan(values).any():
            attrs["missing"] = missing
        columns[name] = (dims, values, attrs)
    return columns


@cache
def installed() -> tuple[str, ...]:
    """Register the responses of other packages, once; return their names.

    Raises
    ------
    InputError
        If an entry point cannot be imported, or does not name a ``Metric`` or a sequence of them.
    """
    all_metrics: list[Metric] = []
    for entry in (*entry_points(group=GROUP), *_of_old_group()):
        key = f"{entry.group}.{entry.name}"
        try:
            loaded = entry.load()
        except (ImportError, AttributeError) as error:
            raise InputError(key, entry.value, f"cannot be imported: {error}") from None
        metrics = list(loaded) if isinstance(loaded, Iterable) else [loaded]
        if not all(isinstance(metric, Metric) for metric in metrics):
            raise InputError(key, entry.value, "must be a Metric, or a sequence of them")
        all_metrics += metrics
    register(*all_metrics)
    return tuple(metric.name for metric in all_metrics)


def _of_old_group() -> Sequence[EntryPoint]:
    """Entry points under the group's former name, supported until version 1.1."""
    entries = tuple(entry_points(group=OLD_GROUP))
    if entries:
        names = ", ".join(entry.name for entry in entries)
        warnings.warn(f"{names}: the entry point group {OLD_GROUP} is now {GROUP}", DeprecationWarning, stacklevel=2)
    return entries


def _mean(curve: str) -> Callable[[MeshCycle], NDArray]:
    return lambda cycle: mean(getattr(cycle, curve), cycle.phases.weight)


def _peak_to_peak(curve: str) -> Callable[[MeshCycle], NDArray]:
    return lambda cycle: cycle.curves[curve].peak_to_peak


def _amplitude(curve: str, n: int) -> Callable[[MeshCycle], NDArray]:
    return lambda cycle: 2 * np.abs(coefficients(cycle.phases, getattr(cycle, curve), n)[..., -1])


def _ste_rms(cycle: MeshCycle) -> NDArray:
    return fluctuation_rms(cycle.transmission_error, cycle.phases.weight)


def _stiffness_rms(cycle: MeshCycle) -> NDArray:
    return relative_rms(cycle.mesh_stiffness, cycle.phases.weight)


def _of_train(name: str, units: str, symbol: str, words: str, reduce: Curve) -> Metric:
    def checked(cycle: Any) -> NDArray:
        if not isinstance(cycle, TrainCycle):
            raise InputError("response", name, "is for planetary sets and trains of parallel paths")
        return reduce(cycle)

    return Metric(name=name, quantity=Quantity(units, symbol, words), reduce=checked, of_train=True)


def _needs_speeds(cycle: MeshCycle) -> NDArray:
    raise InputError("mesh_force", "no speeds", "is for studies with [speeds], and for response and robust_response")


_STE, _K = "transmission_error", "mesh_stiffness"
_NUMBERS = (
    (f"{_STE}_mean", "µm", "mean δ", "mean static transmission error", _mean(_STE)),
    (f"{_STE}_rms", "µm", "RMS δ", "RMS of the fluctuating static transmission error", _ste_rms),
    (f"{_STE}_peak_to_peak", "µm", "PP δ", "peak-to-peak static transmission error", _peak_to_peak(_STE)),
    (f"{_K}_mean", "N/µm", "mean k", "mean mesh stiffness", _mean(_K)),
    (f"{_K}_rms", "%", "RMS k", "RMS of the relative fluctuation of the mesh stiffness", _stiffness_rms),
    (f"{_K}_peak_to_peak", "N/µm", "PP k", "peak-to-peak mesh stiffness", _peak_to_peak(_K)),
)
#: Amplitudes of single harmonics. Phases are not responses, because a phase has no mean over samples.
_AMPLITUDES = tuple(
    (f"{curve}_amplitude_{n}", unit, f"|{symbol}_{n}|", f"amplitude of harmonic {n} of the {of}", _amplitude(curve, n))
    for curve, unit, symbol, of in ((_STE, "µm", "δ", "transmission error"), (_K, "N/µm", "k", "mesh stiffness"))
    for n in range(1, HARMONICS + 1)
)
#: Default responses of a simulation.
USUAL = tuple(name for name, *_ in _NUMBERS)
#: Registry of all responses by name; those of other packages are added when first needed.
KNOWN: dict[str, Metric] = {
    name: Metric(name=name, quantity=Quantity(*words), reduce=reduce)
    for name, *words, reduce in (*_NUMBERS, *_AMPLITUDES)
}
#: RMS over the speeds, and over the torques if there are several, of the RMS of the mesh force.
_FORCE = Quantity("N", "RMS f", "RMS of the mesh force over the range of speeds")
KNOWN["mesh_force"] = Metric(name="mesh_force", quantity=_FORCE, reduce=_needs_speeds, over_speed=True)
KNOWN |= {each[0]: _of_train(*each) for each in NUMBERS}
