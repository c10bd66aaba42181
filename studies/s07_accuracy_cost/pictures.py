"""Figures: work–precision diagrams, front of all models, promises and scaling."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gearbench.effort.figures import LEAST, cheapest, work_precision_diagram
from gearbench.lazy import xr
from gearbench.plotting import BLUE, GREEN, GREY, ORANGE, PURPLE, new_figure, write_figure
from studies.s07_accuracy_cost.findings import TIMES, diagram, met, ratios, scaling_part
from studies.s07_accuracy_cost.gears import gears
from studies.s07_accuracy_cost.scaling import exponent, speed_up

FAMILIES = {"plate": (BLUE, "o"), "solid": (ORANGE, "s"), "finite elements": (GREEN, "^")}


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Draw work–precision diagrams, front of all models, promises and scaling."""
    draw_diagrams(dataset, folder)
    if "model" in dataset.dims:
        draw_front(dataset, folder)
    draw_promises(dataset, folder)
    draw_scaling(scaling_part(dataset), folder)


def draw_diagrams(dataset: xr.Dataset, folder: Path) -> None:
    """Draw error over time and over memory for the scenes, with the gears in use in a separate figure."""
    names = dict.fromkeys(dataset["setting_scene"].values.tolist())
    paper, in_use = ([name for name in names if (name in gears()) == own] for own in (False, True))
    time = "Gauss panels, segments and the solver reach rounding; models and samples are what costs"
    memory = "About a megabyte is enough for a plate; solid teeth of high order take hundreds"
    _panels(dataset, paper, "processor_seconds", time, folder / "work_precision_time.png")
    _panels(dataset, paper, "megabytes", memory, folder / "work_precision_memory.png")
    if in_use:
        order = "Gears in use on their bodies: segments and Gauss points are cheap, the order of solid teeth costs"
        _panels(dataset, in_use, "processor_seconds", order, folder / "gears.png", columns=3)


def _panels(dataset: xr.Dataset, names: Sequence[str], across: str, title: str, path: Path, columns: int = 2) -> None:
    """Draw the work–precision diagrams of several scenes in one figure."""
    rows = -(-len(names) // columns)
    figure, axes = new_figure(rows, columns, (6.5 * columns, 0.6 + 4.2 * rows), sharey=True)
    for axis, name in zip(axes.flat, names, strict=False):
        part = diagram(dataset, name)
        work_precision_diagram(part, axis, across=across)
        axis.set_title(name if across == "megabytes" else f"{name}: {_within_one_percent(part)}", fontsize=10)
        axis.set_ylim(LEAST / 3, 3.0)
        axis.legend(frameon=False, fontsize=7, loc="lower left" if columns == 2 else "center right")
    for axis in axes.flat[len(names) :]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel("largest relative error [–]")
    figure.suptitle(title)
    write_figure(figure, path)


def _within_one_percent(part: xr.Dataset) -> str:
    """Text with the times in which segments, Gauss points, and positions or solid order reach an error of 1 %."""
    words = {"segments": "segments", "gauss_points": "Gauss panels", "positions": "uniform phases"}
    if "positions" not in part["knob"].values:
        words = {"segments": "segments", "gauss_points": "Gauss panels", "solid order": "order"}
    found = {setting: cheapest(part, setting, 0.01) for setting in words}
    return "1 % by " + ", ".join(f"{words[k]} {f'{_number(1e3 * t)} ms' if t else '–'}" for k, t in found.items())


def draw_front(dataset: xr.Dataset, folder: Path) -> None:
    """Draw the error of all models at all resolutions over time and over memory, with the front marked."""
    names = list(dict.fromkeys(dataset["model_scene"].values.tolist()))
    figure, axes = new_figure(len(names), 2, (12, 0.6 + 4.6 * len(names)), sharey="row")
    for row, name in zip(axes, names, strict=True):
        part = dataset.isel(model=dataset["model_scene"].values == name)
        error = part["model_error"].max("quantity").values
        for axis, across, unit in zip(row, ("model_seconds", "model_megabytes"), ("s", "MB"), strict=True):
            for family, (colour, marker) in FAMILIES.items():
                mine = part["model_family"].values == family
                axis.plot(part[across].values[mine], error[mine], marker, color=colour, ms=5, alpha=0.8, label=family)
            best = pareto(part[across].values, error)
            axis.plot(part[across].values[best], error[best], color=GREY, lw=1, zorder=0, label="front")
            axis.axhline(
                float(part["model_bar"].max()), color=PURPLE, lw=1, ls=":", label="uncertainty of the reference"
            )
            axis.set(xscale="log", yscale="log", xlabel=f"{'processor time' if unit == 's' else 'memory'} [{unit}]")
            axis.grid(alpha=0.3)
            for i in _apart(_notable(best, part["model_label"].values), part[across].values, error):
                if unit == "s":
                    label = str(part["model_label"].values[i])
                    at = (part[across].values[i], error[i])
                    axis.annotate(label, at, (5, 5), fontsize=7, textcoords="offset points")
        row[0].set_ylabel("largest error against the finest elements [–]")
        row[0].set_title(front_finding(part), fontsize=10, loc="left")
    axes[0, 0].legend(frameon=False, fontsize=8, loc="lower left")
    figure.suptitle("From the paper's plate to 3D finite elements: teeth set up anew, and the mesh cycle solved")
    write_figure(figure, folder / "front.png")


def _apart(chosen: Sequence[int], x: np.ndarray, y: np.ndarray) -> list[int]:
    """Choose points whose labels do not overlap on logarithmic axes."""
    at = np.log10(np.column_stack([x, y]))
    # a label is about as wide as a quarter of the axes and as high as a thirtieth
    at /= np.ptp(at, axis=0) * (1 / 4, 1 / 30)
    kept: list[int] = []
    for i in chosen:
        if all(np.any(np.abs(at[i] - at[k]) > 1) for k in kept):
            kept.append(i)
    return kept


def pareto(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Indices of the Pareto-optimal points, sorted by x."""
    order = np.argsort(x)
    least = np.minimum.accumulate(np.append(np.inf, y[order]))[:-1]
    return order[y[order] < least]


def _notable(best: np.ndarray, labels: np.ndarray) -> list[int]:
    """Indices of the most expensive front point with each label."""
    return [int(best[np.flatnonzero(labels[best] == name)[-1]]) for name in dict.fromkeys(labels[best].tolist())]


def front_finding(part: xr.Dataset) -> str:
    """Text with the times of the fastest plate, and of solid teeth and finite elements with an error of about 1 %."""
    error, seconds = part["model_error"].max("quantity").values, part["model_seconds"].values
    words = [str(part["model_scene"].values[0])]
    plate = np.flatnonzero(part["model_label"].values == "plate, paper")
    i = plate[np.argmin(seconds[plate])]
    words.append(f"the paper's plate {1e3 * seconds[i]:.1f} ms, off by {100 * error[i]:.0f} %")
    for family in ("solid", "finite elements"):
        mine = np.flatnonzero((part["model_family"].values == family) & (error <= 0.02))
        if mine.size:
            i = mine[np.argmin(seconds[mine])]
            words.append(f"{family} {_time(float(seconds[i]))} for {100 * error[i]:.2g} %")
    return f"{words[0]}: {'; '.join(words[1:])}"


def _time(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds >= 1 else f"{1e3 * seconds:.0f} ms"


def draw_promises(dataset: xr.Dataset, folder: Path) -> None:
    """Draw true error over estimated and requested error, and time relative to the best setting."""
    figure, ((left, right),) = new_figure(1, 2, (12, 4.8))
    kinds = (("promise", BLUE, "o", "plates"), ("solid", ORANGE, "s", "solid teeth"), ("robust", GREEN, "^", "samples"))
    for kind, colour, marker, words in kinds:
        asked = dataset[f"{kind}_accuracy"].values
        x, y = dataset[f"{kind}_estimated"].values / asked, dataset[f"{kind}_true"].values / asked
        label = f"{words}: {100 * met(dataset, kind):.0f} % of {dataset.sizes[kind]} met"
        left.plot(x, np.maximum(y, 1e-3), marker, color=colour, ms=5, alpha=0.7, label=label)
    left.axhline(1, color=GREY, lw=1)
    left.plot([0.01, 1], [0.01, 1], color=GREY, lw=1, ls=":", label="true = estimated")
    left.set(xscale="log", yscale="log", xlabel="estimated error / accuracy asked for [–]")
    left.set_ylabel("true error / accuracy asked for [–]")
    left.legend(frameon=False, fontsize=8)
    shares = [met(dataset, kind) * dataset.sizes[kind] for kind, *_ in kinds]
    share = sum(shares) / sum(dataset.sizes[kind] for kind, *_ in kinds)
    left.set_title(f"the true error is within the accuracy asked for in {100 * share:.0f} %", fontsize=10)
    ratio = np.sort(ratios(dataset))
    right.step(ratio, np.arange(1, len(ratio) + 1) / len(ratio), where="post", color=BLUE)
    right.axvline(TIMES, color=GREY, lw=1, ls="--")
    right.set(xlabel="time of the settings chosen / time of the best settings [–]", ylabel="share of the scenes [–]")
    search = dataset["promise_search_seconds"].dropna("promise").values
    right.set_title(
        f"{100 * float((ratio <= TIMES).mean()):.0f} % within {TIMES:g}×; the choice itself takes "
        f"{1e3 * np.median(search):.0f} ms (median), {1e3 * search.max():.0f} ms at most",
        fontsize=10,
    )
    for axis in (left, right):
        axis.grid(alpha=0.3)
    figure.suptitle("Accuracy asked for on random scenes: true errors, and what the settings cost")
    write_figure(figure, folder / "promises.png")


def draw_scaling(dataset: xr.Dataset, folder: Path) -> None:
    """Draw run time over segments, samples, pairs in contact and workers."""
    words = {
        "segments": "segments on a contact line [–]",
        "samples": "error samples [–]",
        "pairs": "total contact ratio [–]",
        "workers": "workers [–]",
    }
    figure, axes = new_figure(1, 4, (15, 4))
    for axis, (name, label) in zip(axes[0], words.items(), strict=True):
        rows = dataset.isel(run=dataset["grows"].values == name)
        which = "seconds" if name == "workers" else "processor_seconds"
        axis.plot(rows["size"], 1e3 * rows[which], "o-", color=BLUE, ms=5)
        axis.set(xscale="log", yscale="log", xlabel=label)
        some = slice(None, None, 1 + rows.sizes["run"] // 6)
        axis.set_xticks(rows["size"].values[some], [_number(x) for x in rows["size"].values[some]])
        taken = 1e3 * rows[which].values[some]
        axis.set_yticks(taken, [_number(t) for t in taken])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
        if name == "workers":
            axis.set_ylabel("wall time [ms]")
            axis.set_title(f"{int(rows['size'].max())} workers: {speed_up(dataset):.1f}× as fast", fontsize=10)
        else:
            axis.set_ylabel("processor time [ms]")
            axis.set_title(f"time ~ {name}^{exponent(dataset, name):.2f} at the large end", fontsize=10)
    figure.suptitle("Time grows about in proportion to segments and samples, more slowly with the pairs in contact")
    write_figure(figure, folder / "scaling.png")


def _number(x: float) -> str:
    return f"{x:.0f}" if x >= 100 else f"{x:.3g}"
