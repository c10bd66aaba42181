"""Decision help: designs of a stored optimisation that meet conditions, best first, as a list in CSV and Markdown."""

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
    """Frequencies that the mesh must not excite in a range of speeds.

    Parameters
    ----------
    frequency
        Lowest and highest frequency to avoid [Hz].
    speed
        Lowest and highest speed of the pinion [rpm].
    orders
        Number of mesh orders that count, k z_1 n/60 for k = 1 … ``orders``.
    """

    frequency: tuple[float, float]
    speed: tuple[float, float]
    orders: int = 1

    def __str__(self) -> str:
        (low, high), (slow, fast) = self.frequency, self.speed
        return f"mesh frequency outside {low:g} to {high:g} Hz at {slow:g} to {fast:g} rpm, orders 1 to {self.orders}"

    def avoided(self, teeth: NDArray) -> NDArray:
        """Whether a pinion of that tooth count stays outside at every speed and order."""
        order = np.arange(1, self.orders + 1)
        low, high = (np.multiply.outer(np.asarray(teeth), order) * n / 60 for n in self.speed)
        return np.all((high < self.frequency[0]) | (low > self.frequency[1]), axis=-1)


@dataclass(frozen=True, kw_only=True)
class Selection:
    """The designs that are left, best first.

    Parameters
    ----------
    designs
        All designs of the optimisation.
    numbers
        Numbers of those left in the dimension ``design``.
    score
        Their scores, (number,): 0 is as good as the best of the front in every term, 1 as bad as its worst.
    ranking
        Weight of each term of the score by the full name of its quantity.
    kept
        Numbers of the designs that each condition left, in the order they were applied.
    """

    designs: Designs
    numbers: NDArray
    score: NDArray
    ranking: Mapping[str, float]
    kept: tuple[tuple[str, NDArray], ...]

    @property
    def steps(self) -> tuple[tuple[str, int], ...]:
        """Number of designs that each condition left."""
        return tuple((condition, len(numbers)) for condition, numbers in self.kept)

    def scene(self, number: int) -> Scene:
        """Scene of a design that is left, see ``chosen_scene``.

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
        """Columns of the list by name: ``design``, ``score`` and the quantities of ``names``."""
        numbers = self.numbers[:top]
        columns = {"design": numbers, "score": self.score[:top]}
        return columns | {name: self.designs.values(name, numbers) for name in self.names()}


def open_designs(path: str | Path) -> Designs:
    """Open the designs of a finished optimisation from its folder, or from the file of its front.

    Raises
    ------
    InputError
        If there is none, or the optimisation is not finished.
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
    """Feasible designs that meet all conditions, best first; equal ones in the order they were found.

    Parameters
    ----------
    designs
        From ``open_designs``.
    where, avoid
        Conditions to meet.
    rank
        Weights by name. Each quantity counts from its least to its greatest value on the front of the study, so that
        weights are independent of units; negative if more is better. By default the objectives
        of the study.
    worst_case
        Rank by the maxima over the error samples instead of means and standard deviations.

    Raises
    ------
    InputError
        If a name is not known, or a condition cannot be applied to it.
    """
    numbers = designs.require_feasible()
    ranking = _ranking(designs, rank if rank is not None else _objectives(designs), worst_case)
    # quantities computed from the scene come last, for the designs that are left
    found = [replace(c, name=designs.find("where", c.name)) for c in where]
    ordered = sorted(found, key=lambda c: c.name not in designs.dataset)
    kept = [("feasible", numbers)]
    for condition in ordered:
        numbers = numbers[condition.holds(designs.values(condition.name, numbers))]
        kept.append((str(condition), numbers))
    if avoid and designs.study.of_set:
        raise InputError("avoid", str(avoid[0]), "is for pairs: the mesh frequency of a set depends on what is held")
    for resonance in avoid:
        numbers = numbers[resonance.avoided(designs.values("pinion_teeth", numbers))]
        kept.append((str(resonance), numbers))
    score = _score(designs, numbers, ranking)
    order = np.argsort(score, kind="stable")
    return Selection(designs=designs, numbers=numbers[order], score=score[order], ranking=ranking, kept=tuple(kept))


def _objectives(designs: Designs) -> dict[str, float]:
    """Weights that give all objectives of the study the same influence; weighted sums keep their proportions."""
    weights: dict[str, float] = {}
    for objective in designs.study.objectives:
        for name, weight in objective.weights.items():
            weights[name] = weights.get(name, 0.0) + weight / sum(objective.weights.values())
    return weights


def _ranking(designs: Designs, rank: Mapping[str, float], worst_case: bool) -> dict[str, float]:
    """Weights by full name, statistics replaced by maxima for the worst case."""
    full: dict[str, float] = {}
    for name, weight in rank.items():
        found = designs.find("rank", name)
        if worst_case and (statistic := split_statistic(found)):
            found = f"{statistic[0]}_max"
        full[found] = full.get(found, 0.0) + weight
    for name in full:
        if name in designs.dataset and designs.dataset[name].dtype.kind not in "iufb":
            raise InputError("rank", name, "must be a number")
    return full


def _score(designs: Designs, numbers: NDArray, ranking: Mapping[str, float]) -> NDArray:
    """Σ w (x − best)/(worst − best) / Σ|w|, best and worst on the front of the study; NaN counts as worst of all."""
    front = np.flatnonzero(designs.dataset["on_front"].values)
    score = np.zeros(len(numbers))
    for name, weight in ranking.items():
        on_front = designs.values(name, front).astype(float)
        on_front = on_front[np.isfinite(on_front)]
        if on_front.size == 0:
            raise InputError("rank", name, "is not known of any design on the front: were there samples?")
        spread = float(np.ptp(on_front)) or 1.0
        best = float(on_front.min() if weight > 0 else on_front.max())
        score += weight * (designs.values(name, numbers).astype(float) - best) / spread
    return np.where(np.isnan(score), np.inf, score / sum(map(abs, ranking.values())))


def chosen_scene(designs: Designs, number: int) -> Scene:
    """Scene of the chosen design, named after the study and its number.

    Raises
    ------
    InputError
        If there is no such design, or it is not feasible.
    """
    designs.require_design("export", number, feasible=True)
    return replace(designs.scene(number), name=f"{designs.study.name or 'study'}, design {number}")


def csv_text(selection: Selection, top: int | None = None) -> str:
    """One line for each design, best first; numbers to full precision, the names of the quantities in the first line.

    Units are those of the stored optimisation: µm, %, mm, °, MPa, N.
    """
    table = selection.table(top)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(map(_no_formula, table))
    writer.writerows([_no_formula(_plain(value)) for value in row] for row in zip(*table.values(), strict=True))
    return out.getvalue()


def markdown_text(selection: Selection, top: int | None = None) -> str:
    """Heading, conditions, and a table of the designs, best first."""
    designs, table = selection.designs, selection.table(top)
    lines = [f"# {markdown_name(designs.study.name) or 'study'}: selected designs", ""]
    lines += [f"- {condition}: {left} designs left" for condition, left in selection.steps]
    lines.append(f"- support of the teeth: {designs.support(selection.numbers[:top]) or '–'}")
    lines += ["", f"Ranked by {ranking_text(selection)}, each from its best to its worst on the front.", ""]
    heads = [heading(selection, name) for name in table]
    lines.append("| " + " | ".join(map(_cell, heads)) + " |")
    lines.append("|" + " ---: |" * len(heads))
    for row in zip(*table.values(), strict=True):
        lines.append("| " + " | ".join(_cell(shown(_plain(value))) for value in row) + " |")
    return "\n".join(lines) + "\n"


def ranking_text(selection: Selection) -> str:
    """The terms of the score with their weights."""
    text = " + ".join(name if w == 1 else f"{w:g} {name}" for name, w in selection.ranking.items())
    return text.replace("+ -", "− ")


def heading(selection: Selection, name: str) -> str:
    """Name of a column and its unit."""
    unit = selection.designs.unit(name) if name in selection.designs.names else ""
    return f"{name} [{unit}]" if unit else name


def shown(value: Any) -> str:
    """A value as people read it: five digits."""
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def markdown_name(text: str) -> str:
    """A name as Markdown shows it letter by letter."""
    return re.sub(r"([\\`*\[\]<>|])", r"\\\1", " ".join(text.split()))


def _no_formula(value: Any) -> Any:
    """Text that a spreadsheet would take for a formula behind an apostrophe; numbers as they are."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
