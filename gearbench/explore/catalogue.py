"""Catalogue: the designs of all results that the page shows, with their quantities in common columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.explore.columns import Column
from gearbench.explore.stored import Stored
from gearbench.scene import Scene

#: The two objectives, on the horizontal and the vertical axis of the front, as in Garambois et al. (2017).
ACROSS, UP = "mesh_stiffness_rms_mean", "transmission_error_rms_mean"
#: Their standard deviations.
SCATTER_ACROSS, SCATTER_UP = "mesh_stiffness_rms_std", "transmission_error_rms_std"


@dataclass(frozen=True, kw_only=True)
class Catalogue:
    """Designs of several results.

    Parameters
    ----------
    results
        The results, in the order of the command line.
    result
        Index in ``results`` of the result that holds each design, (design,).
    number
        Number of each design in the file of its result, (design,).
    columns
        Quantities of the designs; NaN if a result does not have them.
    left_out
        Number of designs left out because they lack one of the two objectives.
    """

    results: tuple[Stored, ...]
    result: NDArray
    number: NDArray
    columns: tuple[Column, ...]
    left_out: int = 0

    def __len__(self) -> int:
        return len(self.result)

    def column(self, name: str) -> Column:
        """Column with this name."""
        return next(column for column in self.columns if column.name == name)

    def of_kind(self, *kinds: str) -> dict[int, Column]:
        """Index → column, for the columns of these kinds whose values differ between the designs."""
        return {i: c for i, c in enumerate(self.columns) if c.kind in kinds and c.range[0] < c.range[1]}

    def scene(self, design: int) -> Scene:
        """Scene of a design by its index in the catalogue."""
        return self.results[self.result[design]].scene(int(self.number[design]))

    def name(self, design: int) -> str:
        """Display name of a design by its index in the catalogue."""
        return f"{self.results[self.result[design]].label}, design {self.number[design]}"


def catalogue(results: Sequence[Stored]) -> Catalogue:
    """Join the designs of ``results``; leave out designs without the two objectives of the front."""
    titles = list(dict.fromkeys(column.title for result in results for column in result.columns))
    joined = [_join(results, title) for title in titles]
    index = np.concatenate([np.full(len(result.numbers), i) for i, result in enumerate(results)])
    number = np.concatenate([result.numbers for result in results])
    complete = np.all([np.isfinite(c.values) for c in joined if c.name in (ACROSS, UP)], axis=0)
    columns = tuple(replace(column, values=column.values[complete]) for column in joined)
    return Catalogue(
        results=tuple(results),
        result=index[complete],
        number=number[complete],
        columns=columns,
        left_out=int((~complete).sum()),
    )


def _join(results: Sequence[Stored], title: str) -> Column:
    """Join one column over all results; columns of texts get a common list of categories."""
    by_result = [next((c for c in result.columns if c.title == title), None) for result in results]
    first = next(c for c in by_result if c is not None)
    categories = tuple(sorted({text for c in by_result if c is not None for text in c.categories}))
    parts = []
    for result, column in zip(results, by_result, strict=True):
        values = np.full(len(result.numbers), np.nan) if column is None else column.values
        if column is not None and column.categories:
            values = np.array([categories.index(text) for text in column.categories])[values.astype(int)]
        parts.append(values.astype(float))
    return replace(first, values=np.concatenate(parts), categories=categories)


def fronts(catalogue: Catalogue, selected: NDArray | None = None) -> NDArray:
    """Indices of the Pareto-optimal designs of every result, sorted by result, then by ``ACROSS``, (design,).

    Designs for which ``selected`` (design,) is False are left out.
    """
    x, y = catalogue.column(ACROSS).values, catalogue.column(UP).values
    selected = np.ones(len(catalogue), dtype=bool) if selected is None else selected
    by_result = []
    for result in range(len(catalogue.results)):
        designs = np.flatnonzero(selected & (catalogue.result == result))
        order = designs[np.lexsort((y[designs], x[designs]))]
        lowest_before = np.minimum.accumulate(np.concatenate([[np.inf], y[order]]))[:-1]
        by_result.append(order[y[order] < lowest_before])
    return np.concatenate(by_result)
