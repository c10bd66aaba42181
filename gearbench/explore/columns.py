"""One quantity of many designs: name, label with unit, kind, values. Names are literal text, never TeX or HTML."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import plain
from gearbench.results.quantities import KEYS
from gearbench.results.responses import quantity

#: Between the two signs of a mark at which BokehJS begins or ends to set text as TeX, and with it any HTML in it.
_TEX = re.compile(r"(?<=\$)(?=\$)|(?<=\\)(?=[\[\]()])")
_WORD_JOINER = "\u2060"


def as_text(name: str) -> str:
    """Name as literal text in BokehJS: a zero-width character separates TeX delimiters."""
    return _TEX.sub(_WORD_JOINER, plain(name))


Kind = Literal["variable", "limit", "statistic"]


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
        (design,); NaN where unknown. Indices into ``categories`` where the quantity is a text.
    categories
        The texts, or empty.
    """

    name: str
    label: str
    unit: str
    kind: Kind
    values: NDArray
    categories: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        # labels and categories stand in titles and on axes, where Bokeh would set them as TeX
        for name, value in (("label", as_text(self.label)), ("categories", tuple(map(as_text, self.categories)))):
            object.__setattr__(self, name, value)

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
    key = next((KEYS[tail] for path in paths for tail in _tails(path) if tail in KEYS), None)
    label, unit = (".".join(name.split(".")[-2:]).replace("_", " "), "") if key is None else (key.label, key.unit)
    if values.dtype.kind in "iufb":
        return Column(name=name, label=label, unit=unit, kind="variable", values=values.astype(float))
    texts = values.astype(str)
    categories, codes = np.unique(texts, return_inverse=True)
    names = tuple(map(str, categories))
    return Column(name=name, label=label, unit="", kind="variable", values=codes.astype(float), categories=names)


def known_column(name: str, kind: Kind, values: NDArray) -> Column:
    """Column of a limited quantity, or of a statistic over the error samples, e.g. "mesh_stiffness_rms_std"."""
    found = quantity(name)
    assert found is not None, name
    label = found.symbol if kind == "statistic" else found.label
    return Column(name=name, label=label, unit=found.unit, kind=kind, values=values.astype(float))


def _tails(path: str) -> tuple[str, ...]:
    """The last two parts of a key, then the last one."""
    parts = path.split(".")
    return ".".join(parts[-2:]), parts[-1]
