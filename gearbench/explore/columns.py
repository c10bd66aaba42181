"""One quantity of many designs: name, label with unit, kind, values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.quantities import QUANTITIES

Kind = Literal["variable", "limit", "statistic"]

#: Last parts of keys of a scene → their name and unit.
_KEYS = MappingProxyType(
    {
        "helix_angle": ("helix angle β", "°"),
        "pressure_angle": ("pressure angle α_n", "°"),
        "normal_module": ("normal module m_n", "mm"),
        "face_width": ("face width b", "mm"),
        "centre_distance": ("centre distance a′", "mm"),
        "addendum_fraction": ("addendum fraction", ""),
        "teeth": ("teeth z", ""),
        "torque": ("torque T", "N·m"),
        "crowning.amount": ("crowning C_β", "µm"),
        "tip_relief.amount": ("tip relief f", "µm"),
        "tip_relief.length": ("tip relief length L", "mm"),
        "tip_relief.length_fraction": ("tip relief L/h_e", ""),
        "root_relief.amount": ("root relief", "µm"),
        "root_relief.length": ("root relief length", "mm"),
        "root_relief.length_fraction": ("root relief L/h_e", ""),
        "end_relief.amount": ("end relief", "µm"),
        "end_relief.length": ("end relief length", "mm"),
        "profile_slope.amount": ("profile slope", "µm"),
        "helix_slope.amount": ("helix slope", "µm"),
    }
)
_STATISTIC = MappingProxyType({"mean": "mean of", "std": "σ of", "max": "maximum of"})


@dataclass(frozen=True, kw_only=True)
class Column:
    """A quantity of many designs.

    Parameters
    ----------
    name
        Its name in the stored result.
    label, unit
        To show; the unit is "" where it has none.
    kind
        Variable of the study, limited quantity, or statistic over the error samples.
    values
        (design,); NaN where unknown. Places in ``categories`` where the quantity is a text.
    categories
        The texts, or empty.
    """

    name: str
    label: str
    unit: str
    kind: Kind
    values: NDArray
    categories: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """Label with unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest known value; NaN where none is known."""
        known = self.values[np.isfinite(self.values)]
        return (float(known.min()), float(known.max())) if known.size else (np.nan, np.nan)


def variable_column(name: str, paths: Sequence[str], values: NDArray) -> Column:
    """Column of a variable that changes the keys ``paths`` of a scene."""
    label, unit = next((_KEYS[tail] for path in paths for tail in _tails(path) if tail in _KEYS), (name, ""))
    if label == name:
        label = ".".join(name.split(".")[-2:]).replace("_", " ")
    if values.dtype.kind in "iufb":
        return Column(name=name, label=label, unit=unit, kind="variable", values=values.astype(float))
    texts = values.astype(str)
    categories, codes = np.unique(texts, return_inverse=True)
    names = tuple(map(str, categories))
    return Column(name=name, label=label, unit="", kind="variable", values=codes.astype(float), categories=names)


def constraint_column(name: str, values: NDArray) -> Column:
    """Column of a limited quantity."""
    quantity = QUANTITIES[name]
    label = f"{quantity.long_name} {quantity.symbol}"
    return Column(name=name, label=label, unit=_unit(quantity.units), kind="limit", values=values.astype(float))


def statistic_column(name: str, values: NDArray) -> Column:
    """Column of a statistic over the error samples, e.g. "mesh_stiffness_rms_std"."""
    response, statistic = name.rsplit("_", 1)
    quantity = QUANTITIES[response]
    label = f"{_STATISTIC[statistic]} {quantity.symbol}"
    return Column(name=name, label=label, unit=_unit(quantity.units), kind="statistic", values=values.astype(float))


def _tails(path: str) -> tuple[str, ...]:
    """The last two parts of a key, then the last one."""
    parts = path.split(".")
    return ".".join(parts[-2:]), parts[-1]


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit
