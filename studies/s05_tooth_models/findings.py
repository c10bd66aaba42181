"""Findings: limits that the best fast teeth keep on every pair, distribution of errors, error over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.lazy import xr
from gearbench.plotting import BLUE, ORANGE, new_figure, write_figure
from studies.s05_tooth_models.data import ERRORS, MODELS

#: Recommended model by support, and its limits: errors of mean and peak-to-peak [%], worst MAC.
BEST = {"clamped": "solid", "rim": "solid + ring"}
LIMITS = {"mean": 3.0, "peak_to_peak": 6.0, "mac": 0.97}


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check the best fast tooth on every pair: mean within 3 %, peak-to-peak within 6 %, worst MAC at least 0.97."""
    found = []
    for support, model in BEST.items():
        here = dataset.sel({f"{support}_model": model})
        for name in ERRORS:
            limit = LIMITS["mean" if "mean" in name else "peak_to_peak"]
            error = np.abs(here[f"{support}_{name}"])
            text = (
                f"{support}, {model}: {name.replace('_', ' ')} at most {float(error.max()):.2f} % (limit {limit:g} %)"
            )
            found.append((text, bool((error <= limit).all())))
        worst = float(here[f"{support}_mac"].min())
        found.append((f"{support}, {model}: worst MAC {worst:.4f} (limit {LIMITS['mac']})", worst >= LIMITS["mac"]))
    return found


#: Labels of the errors in the order of ``ERRORS``.
LABELS = ("mean STE", "peak-to-peak STE", "mean k", "peak-to-peak k")


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Draw the distribution of the errors of every model, and error over time."""
    for support in MODELS:
        figure, axes = new_figure(1, 4, (13, 4.2), sharey=True)
        boxes(axes[0], dataset[[f"{support}_{name}" for name in ERRORS]], LIMITS, (-50, -5, 0, 5, 50, 500))
        for axis in axes[0]:
            axis.axvline(0, color="0.4", lw=0.8)
        best = float(np.abs(dataset[f"{support}_{ERRORS[0]}"].sel({f"{support}_model": BEST[support]})).max())
        held = "Clamped teeth" if support == "clamped" else "Teeth on their gear bodies"
        figure.suptitle(
            f"{held}, {dataset.sizes['design']} pairs against finite elements: {BEST[support]} within {best:.1f} % in"
            " mean STE\n(box: quartiles; whiskers: all pairs; shaded: limits 3 % and 6 %)",
            fontsize=10,
        )
        write_figure(figure, folder / f"errors_{support}.png")
    _front(dataset, folder)


def boxes(axes: Any, errors: xr.Dataset, limits: dict[str, float], ticks: Sequence[int]) -> None:
    """Draw quartiles and ranges of ``errors`` (pair, model), one error per panel; linear up to the first tick."""
    models = [str(name) for name in next(iter(errors.coords.values())).values]
    for axis, (name, values), label in zip(axes, errors.data_vars.items(), LABELS, strict=True):
        columns = [column[np.isfinite(column)] for column in values.values.T]
        style = {"whis": (0, 100), "widths": 0.6, "medianprops": {"color": BLUE}}
        axis.boxplot(columns, orientation="horizontal", **style)
        limit = limits["mean" if "mean" in str(name) else "peak_to_peak"]
        axis.axvspan(-limit, limit, color=BLUE, alpha=0.15, lw=0)
        axis.set_xscale("symlog", linthresh=min(tick for tick in ticks if tick > 0))
        axis.set_xticks(ticks, [f"{tick}".replace("-", "−") for tick in ticks])
        axis.set(xlabel=f"error of {label} [%]", yticks=range(1, len(models) + 1), yticklabels=models)
    axes[0].invert_yaxis()  # the panels share this axis


def _front(dataset: xr.Dataset, folder: Path) -> None:
    figure, ((axis,),) = new_figure(1, 1, (7, 4.6))
    for support, marker, colour in (("clamped", "o", BLUE), ("rim", "s", ORANGE)):
        error = abs(dataset[f"{support}_transmission_error_mean_error"]).max("design")
        seconds = dataset[f"{support}_seconds"].median("design")
        axis.loglog(1e3 * seconds, error, marker, color=colour, label=f"against FE, {support}")
        for model in dataset[f"{support}_model"].values:
            at = {f"{support}_model": model}
            at_cost = (1e3 * float(seconds.sel(at)), float(error.sel(at)))
            axis.annotate(str(model), at_cost, xytext=(5, 4), textcoords="offset points", fontsize=8)
        axis.axvline(1e3 * float(dataset[f"{support}_reference_seconds"].median()), color=colour, ls=":", lw=1)
    axis.set(xlabel="time for the compliance of a pair [ms] (dotted: FE)", ylabel="largest error of mean STE [%]")
    axis.set_title("The solid tooth buys a factor of ten in accuracy for a few milliseconds", fontsize=10)
    axis.legend(frameon=False)
    axis.grid(alpha=0.3)
    write_figure(figure, folder / "accuracy_and_time.png")
