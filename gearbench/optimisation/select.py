"""Selection of designs of a stored optimisation by conditions and a ranking; lists of them in CSV and Markdown."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.optimisation.conditions import Condition
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.store import FRONT, STUDY
from gearbench.results.netcdf import open_result
from gearbench.results.responses import split_statistic
from gearbench.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Resonance:
    """Frequency band that the mesh must not excite within a range of speeds.

    Parameters
    ----------
    frequency
        Lowest and highest frequency to avoid [Hz].
    speed
        Lowest and highest speed of the pinion [1/min].
    orders
        Number of mesh orders checked: frequencies k z_1 n/60 for k = 1 … ``orders``.
    """

    frequency: tuple[float, float]
    speed: tuple[float, float]
    orders: int = 1

    def __str__(self) -> str:
        (low, high), (slow, fast) = self.frequency, self.speed
        orders = "order 1" if self.orders == 1 else f"orders 1 to {self.orders}"
        return f"mesh frequency outside {low:g} to {high:g} Hz at {slow:g} to {fast:g} 1/min, {orders}"

    def avoided(self, teeth: NDArray) -> NDArray:
        """Whether pinions with these tooth counts stay outside the band at every speed and order."""
        order = np.arange(1, self.orders + 1)
        low, high = (np.multiply.outer(np.asarray(teeth), order) * n / 60 for n in self.speed)
        return np.all((high < self.frequency[0]) | (low > self.frequency[1]), axis=-1)


@dataclass(frozen=True, kw_only=True)
class Selection:
    """Selected designs, best first.

    Parameters
    ----------
    designs
        All designs of the optimisation.
    numbers
        Numbers of the selected designs in the dimension ``design``.
    score
        Scores, (number,): 0 for a design with the best value on the front in every term, 1 with the worst.
    ranking
        Weights of the terms of the score, by full name of the quantity.
    kept
        Conditions in the order applied, with the numbers of the designs left after them.
    """

    designs: Designs
    numbers: NDArray
    score: NDArray
    ranking: Mapping[str, float]
    kept: tuple[tuple[str, NDArray], ...]

    @property
    def steps(self) -> tuple[tuple[str, int], ...]:
        """Conditions in the order applied, with the number of designs left after them."""
        return tuple((condition, len(numbers)) for condition, numbers in self.kept)

    def scene(self, number: int) -> Scene:
        """Scene of a selected design, see ``chosen_scene``.

        Raises
        ------
        InputError
            If there is no such design, or a condition excludes it.
        """
        scene = chosen_scene(self.designs, number)
        for condition, numbers in self.kept:
            if number not in numbers:
                raise InputError("export", number, f"is excluded by the condition {condition}")
        return scene

    def names(self) -> tuple[str, ...]:
        """Names of the quantities to list: variables, terms of the score, statistics, limits, and the axial force."""
        dataset, study = self.designs.dataset, self.designs.study
        listed = [str(name) for name in dataset["variable"].values]
        listed += [*self.ranking, *study.statistics, *study.constraints, "axial_force", "on_front"]
        return tuple(dict.fromkeys(listed))

    def table(self, top: int | None = None) -> dict[str, NDArray]:
        """Columns of the first ``top`` designs by name: ``design``, ``score`` and the quantities of ``names``."""
        numbers = self.numbers[:top]
        columns = {"design": numbers, "score": self.score[:top]}
        return columns | {name: self.designs.values(name, numbers) for name in self.names()}


def open_designs(path: str | Path) -> Designs:
    """Open the designs of a finished optimisation from its folder or from its ``front.nc``.

    Raises
    ------
    InputError
        If there is no optimisation, or it is not finished.
    """
    path = Path(path)
    if path.is_dir():
        if not (path / FRONT).exists():
            begun = (path / STUDY).exists()
            reason = "is not finished: continue it with --resume" if begun else f"holds no optimisation (no {FRONT})"
            raise InputError("", str(path), reason)
        path = path / FRONT
    return Designs(open_result(path), str(path))


def select(
    designs: Designs,
    *,
    where: Sequence[Condition] = (),
    avoid: Sequence[Resonance] = (),
    rank: Mapping[str, float] | None = None,
    worst_case: bool = False,
) -> Selection:
    """Select the feasible designs that meet all conditions, best first; ties stay in the order of evaluation.

    Parameters
    ----------
    designs
        From ``open_designs``.
    where, avoid
        Conditions to meet, and resonances to avoid.
    rank
        Weights by name, negative if more is better; by default the objectives of the study. Values are scaled by their
        range on the front, so that weights do not depend on units.
    worst_case
        Rank by maxima over the error samples instead of means and standard deviations.

    Raises
    ------
    InputError
        If a name is not known, or a condition cannot be applied to it.
    """
    numbers = designs.require_feasible()
    ranking = _ranking(designs, rank if rank is not None else _objectives(designs), worst_case)
    # quantities computed from the scene come last, because by then fewer designs are left
    conditions = [replace(c, name=designs.find("where", c.name)) for c in where]
    ordered = sorted(conditions, key=lambda c: c.name not in designs.dataset)
    kept = [("feasible", numbers)]
    for condition in ordered:
        numbers = numbers[condition.holds(designs.values(condition.name, numbers))]
        kept.append((str(condition), numbers))
    if avoid and designs.study.of_set:
        raise InputError("avoid", str(avoid[0]), "is for pairs: the mesh frequency of a set depends on the held member")
    for resonance in avoid:
        numbers = numbers[resonance.avoided(designs.values("pinion_teeth", numbers))]
        kept.append((str(resonance), numbers))
    score = _score(designs, numbers, ranking)
    order = np.argsort(score, kind="stable")
    return Selection(designs=designs, numbers=numbers[order], score=score[order], ranking=ranking, kept=tuple(kept))


def _objectives(designs: Designs) -> dict[str, float]:
    """Weights by name that give all objectives the same influence; terms of an objective keep their proportions."""
    weights: dict[str, float] = {}
    for objective in designs.study.objectives:
        for name, weight in objective.weights.items():
            weights[name] = weights.get(name, 0.0) + weight / sum(objective.weights.values())
    return weights


def _ranking(designs: Designs, rank: Mapping[str, float], worst_case: bool) -> dict[str, float]:
    """Weights by full name; for the worst case, maxima replace the statistics."""
    weights: dict[str, float] = {}
    for name, weight in rank.items():
        full_name = designs.find("rank", name)
        if worst_case and (statistic := split_statistic(full_name)):
            full_name = f"{statistic[0]}_max"
        weights[full_name] = weights.get(full_name, 0.0) + weight
    for name in weights:
        if name in designs.dataset and designs.dataset[name].dtype.kind not in "iufb":
            raise InputError("rank", name, "must be a number")
    return weights


def _score(designs: Designs, numbers: NDArray, ranking: Mapping[str, float]) -> NDArray:
    """Score Σ |w| (x − best)/(worst − best) / Σ |w|, with best and worst on the study's front; infinite if x is NaN."""
    front = np.flatnonzero(designs.dataset["on_front"].values)
    score = np.zeros(len(numbers))
    for name, weight in ranking.items():
        on_front = designs.values(name, front).astype(float)
        on_front = on_front[np.isfinite(on_front)]
        if on_front.size == 0:
            raise InputError("rank", name, "is unknown for this front: it needs error samples")
        extent = float(np.ptp(on_front)) or 1.0
        best = float(on_front.min() if weight > 0 else on_front.max())
        score += weight * (designs.values(name, numbers).astype(float) - best) / extent
    return np.where(np.isnan(score), np.inf, score / sum(map(abs, ranking.values())))


def chosen_scene(designs: Designs, number: int) -> Scene:
    """Scene of a design, named after the study and the design's number.

    Raises
    ------
    InputError
        If there is no such design, or it is not feasible.
    """
    designs.require_design("export", number, feasible=True)
    return replace(designs.scene(number), name=f"{designs.study.name or 'study'}, design {number}")


def csv_text(selection: Selection) -> str:
    """CSV text: a header with the names of the quantities, then one line per design, best first, in full precision.

    Units are those of the stored optimisation: µm, %, mm, °, MPa, N.
    """
    table = selection.table()
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(map(_no_formula, table))
    writer.writerows([_no_formula(_plain(value)) for value in row] for row in zip(*table.values(), strict=True))
    return out.getvalue()


def markdown_text(selection: Selection, top: int | None = None) -> str:
    """Markdown text: heading, conditions, and a table of the designs, best first."""
    designs, table = selection.designs, selection.table(top)
    lines = [f"# {markdown_name(designs.study.name) or 'study'}: selected designs", ""]
    lines += [f"- {condition}: {left} designs left" for condition, left in selection.steps]
    lines.append(f"- model of the gear bodies: {designs.support(selection.numbers[:top]) or '–'}")
    lines += [
        "",
        f"Ranked by {ranking_text(selection)}: each is 0 at its best value on the front and 1 at its worst.",
        "",
    ]
    heads = [heading(selection, name) for name in table]
    lines.append("| " + " | ".join(map(_cell, heads)) + " |")
    lines.append("|" + " ---: |" * len(heads))
    for row in zip(*table.values(), strict=True):
        lines.append("| " + " | ".join(_cell(shown(_plain(value))) for value in row) + " |")
    return "\n".join(lines) + "\n"


def ranking_text(selection: Selection) -> str:
    """Terms of the score with their weights, as text."""
    text = " + ".join(name if w == 1 else f"{w:g} {name}" for name, w in selection.ranking.items())
    return text.replace("+ -", "− ")


def heading(selection: Selection, name: str) -> str:
    """Name of a column, with its unit."""
    unit = selection.designs.unit(name) if name in selection.designs.names else ""
    return f"{name} [{unit}]" if unit else name


def shown(value: Any) -> str:
    """Format a value for readers: five digits."""
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def markdown_name(text: str) -> str:
    """Escape a name so that Markdown shows it literally."""
    return re.sub(r"([\\`*\[\]<>|])", r"\\\1", " ".join(text.split()))


def _no_formula(value: Any) -> Any:
    """Put an apostrophe before a text that a spreadsheet would take for a formula; return numbers unchanged."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value


def _plain(value: Any) -> Any:
    """Convert a NumPy scalar to a Python number; return other values unchanged."""
    return value.item() if hasattr(value, "item") else value


def _cell(text: str) -> str:
    """Escape a text for a cell of a Markdown table."""
    return text.replace("|", "\\|").replace("\n", " ")
