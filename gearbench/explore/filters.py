"""Filters: range sliders that hide designs outside the ranges of variables, limits and statistics."""

from __future__ import annotations

from bokeh.models import Div, RangeSlider
from bokeh.models.layouts import Column as Stack

from gearbench.explore.catalogue import Catalogue
from gearbench.explore.columns import Column
from gearbench.explore.look import PALETTE, SIDE

#: Kind of a column → heading above its sliders, in the order of the page.
_HEADS = {"statistic": "Scatter and objectives", "limit": "Limits", "variable": "Design variables"}


def sliders(catalogue: Catalogue) -> dict[int, RangeSlider]:
    """Make a range slider for every quantity that differs between the designs, by the index of its column."""
    return {i: _slider(i, column) for i, column in catalogue.of_kind("statistic", "limit", "variable").items()}


def _slider(index: int, column: Column) -> RangeSlider:
    """Make the range slider of the column ``index``; for texts, its title says which number stands for which text."""
    low, high = column.range
    # slightly wider than the values, so that rounding never hides a design at an end
    margin = 1e-6 * (high - low)
    texts = "".join(f" {i}: {text}" for i, text in enumerate(column.categories))
    return RangeSlider(
        title=column.title + texts,
        start=low - margin,
        end=high + margin,
        value=(low - margin, high + margin),
        step=(high - low + 2 * margin) / 200,
        format="0[.]000" if high < 1000 else "0",
        width=SIDE - 50,
        bar_color=PALETTE[5],
        name=f"filter {column.name}",
        tags=[index],
    )


def panel(catalogue: Catalogue, by_column: dict[int, RangeSlider]) -> Stack:
    """Arrange the sliders below a heading for each kind."""
    parts: list = []
    for kind, head in _HEADS.items():
        of_kind = [s for i, s in by_column.items() if catalogue.columns[i].kind == kind]
        parts += [Div(text=f"<b>{head}</b>"), *of_kind] if of_kind else []
    return Stack(children=parts, width=SIDE - 20, name="filters")
