"""Figures: harmonics of torsion and radial force, and K_γ over the classes; tables of the report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gearbench.lazy import xr
from gearbench.plotting import BLUE, GREY, ORANGE, legend_below, new_figure, write_figure
from studies.report import table, verdicts
from studies.s13_planetary_phasing.data import ARRANGEMENTS, CURVES, HARMONICS, LOADED, SUNS, SUPPORTS
from studies.s13_planetary_phasing.findings import NORMS, checks, factor, value

_COLOURS = dict(zip(ARRANGEMENTS, (BLUE, ORANGE, "0.45"), strict=True))
#: Support of the sun → responses shown, with their labels.
_SHOWN = {
    "floating": {"train_transmission_error": "$|\\Delta_n|$ [µm]", "sun_motion": "motion of the sun [µm]"},
    "held": {"train_transmission_error": "$|\\Delta_n|$ [µm]", "sun_force": "radial force on the sun [N]"},
}


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Write ``phasing.png``, ``load_factor.png`` and ``report.md``."""
    write_figure(phasing(dataset), folder / "phasing.png")
    write_figure(load_factor(dataset), folder / "load_factor.png")
    (folder / "report.md").write_text("\n".join(report(dataset)) + "\n", encoding="utf-8")


def phasing(dataset: xr.Dataset) -> Any:
    """Draw harmonics of torsion and radial force: bars without errors, points and lines with errors of class 6."""
    figure, axes = new_figure(2, 2, (11.0, 7.5))
    n, width = np.arange(1, HARMONICS + 1), 0.26
    for column, sun in enumerate(SUNS):
        for axis, (name, label) in zip(axes[:, column], _SHOWN[sun].items(), strict=True):
            for shift, (arrangement, colour) in zip((-width, 0.0, width), _COLOURS.items(), strict=True):
                z = ARRANGEMENTS[arrangement]
                nominal, mean, q95 = (
                    [value(dataset, arrangement, sun, f"{name}_amplitude_{k}", statistic) for k in n]
                    for statistic in ("nominal", "mean", "q95")
                )
                text = f"{arrangement}, {z[0]}/{z[1]}/−{z[0] + 2 * z[1]}"
                axis.bar(n + shift, nominal, width, color=colour, alpha=0.55, label=text)
                axis.vlines(n + shift, mean, q95, color=colour, lw=1.4)
                axis.plot(n + shift, mean, "o", ms=4.5, color=colour, mec="white", mew=0.6)
            axis.set(xlabel="mesh order n", ylabel=label, xlim=(0.5, HARMONICS + 0.5))
            axis.set_xticks(n)
        axes[0, column].set_title(f"{sun} sun", fontsize=10)
    for row in axes[:1]:  # the same scale for both suns
        top = max(axis.get_ylim()[1] for axis in row)
        for axis in row:
            axis.set_ylim(0.0, top)
    figure.suptitle("bars: without errors; points: mean of the samples of class 6; lines up to 95 of 100", fontsize=10)
    legend_below(figure, axes[0, 0], 3)
    return figure


def load_factor(dataset: xr.Dataset) -> Any:
    """Draw K_γ over the class of pins and run-outs: mean and 99 % quantile, with the standards at the right."""
    figure, axes = new_figure(1, len(SUPPORTS), (11.0, 4.8), sharey=True)
    classes = dataset["iso_class"].values
    for axis, support in zip(axes.ravel(), SUPPORTS, strict=True):
        for planets, colour in zip(LOADED, (BLUE, ORANGE, "0.45"), strict=True):
            mean, most = (
                [factor(dataset, planets, support, statistic, each) for each in classes]
                for statistic in ("mean", "q99")
            )
            axis.fill_between(classes, mean, most, color=colour, alpha=0.2, lw=0)
            axis.plot(classes, mean, color=colour, lw=1.8, label=f"{planets} planets")
            for marker, (name, norm) in zip("D_", NORMS.items(), strict=True):
                label = name if planets == max(LOADED) else None
                axis.plot(classes[-1] + 0.6, norm[planets], marker, color=colour, ms=8, mew=2, label=label)
        axis.axhline(1.0, color=GREY, lw=0.7)
        axis.set(xlabel="class of pins, planets and run-outs", xlim=(classes[0] - 0.2, classes[-1] + 0.9))
        axis.set_xticks([*classes, classes[-1] + 0.6], [*map(str, classes), "norms"])
        axis.set_title(f"sun on {support:g} N/µm" if support else "floating sun", fontsize=10)
    figure.suptitle("lines: mean of the samples; areas up to 99 of 100", fontsize=10)
    axes[0, 0].set_ylabel(r"$K_\gamma$")
    legend_below(figure, axes[0, 0], 3)
    return figure


def report(dataset: xr.Dataset) -> list[str]:
    """Lines of the report: checks, RMS values of all arrangements, K_γ."""
    lines = ["# Phasing of a planetary set", "", *verdicts(checks(dataset))]
    names = [f"{name}_rms" for name in CURVES]
    for sun in SUNS:
        rows = [
            (arrangement, statistic, *(f"{value(dataset, arrangement, sun, name, statistic):.4g}" for name in names))
            for arrangement in ARRANGEMENTS
            for statistic in dataset["statistic"].values
        ]
        lines += ["", f"## {sun} sun", "", *table(("planets", "errors", *names), rows, texts=2)]
    heads = ("planets", "sun", *(f"class {each}" for each in dataset["iso_class"].values))
    rows = [
        (
            str(planets),
            f"{support:g} N/µm" if support else "floating",
            *(
                " / ".join(f"{factor(dataset, planets, support, statistic, each):.3f}" for statistic in ("mean", "q99"))
                for each in dataset["iso_class"].values
            ),
        )
        for planets in LOADED
        for support in SUPPORTS
    ]
    return [*lines, "", "## K_γ, mean / 99 of 100", "", *table(heads, rows, texts=2)]
