"""Columns of the catalogue: one quantity of many designs each, with the words that the page shows for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.results.quantities import KEYS
from gearbench.results.responses import quantity

Kind = Literal["variable", "limit", "statistic"]


@dataclass(frozen=True, kw_only=True)
class Column:
    """Quantity of many designs.

    Parameters
    ----------
    name
        Name in the stored result.
    label, unit
        Label and unit to show; the unit is "" if there is none.
    kind
        Variable of the study, limited quantity, or statistic over the error samples.
    values
        Values, (design,); NaN if unknown. For a quantity of texts, indices into ``categories``.
    categories
        Texts of the quantity; empty if it is a number.
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
        """Least and greatest known value; NaN if none is known."""
        known = self.values[np.isfinite(self.values)]
        return (float(known.min()), float(known.max())) if known.size else (np.nan, np.nan)


def variable_column(name: str, paths: Sequence[str], values: NDArray) -> Column:
    """Column of a design variable that sets the keys ``paths`` of a scene."""
    key = next((KEYS[tail] for path in paths for tail in _tails(path) if tail in KEYS), None)
    label, unit = (".".join(name.split(".")[-2:]).replace("_", " "), "") if key is None else (key.label, key.unit)
    if values.dtype.kind in "iufb":
        return Column(name=name, label=label, unit=unit, kind="variable", values=values.astype(float))
    texts = values.astype(str)
    categories, codes = np.unique(texts, return_inverse=True)
    names = tuple(map(str, categories))
    return Column(name=name, label=label, unit="", kind="variable", values=codes.astype(float), categories=names)


def known_column(name: str, kind: Kind, values: NDArray) -> Column:
    """Column of a limited quantity or of a statistic over the error samples, e.g. "mesh_stiffness_rms_std"."""
    of_name = quantity(name)
    assert of_name is not None, name
    label = of_name.symbol if kind == "statistic" else of_name.label
    return Column(name=name, label=label, unit=of_name.unit, kind=kind, values=values.astype(float))


def _tails(path: str) -> tuple[str, ...]:
    """Last two parts of a dotted key, and its last part alone: names by which ``KEYS`` may know it."""
    parts = path.split(".")
    return ".".join(parts[-2:]), parts[-1]
