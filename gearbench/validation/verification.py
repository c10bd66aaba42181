"""Report of a verified front, as text and pictures: shift of the designs and rank correlation."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearbench.lazy import Axes, xr
from gearbench.optimisation.select import markdown_name
from gearbench.plotting import BLUE, GREEN, GREY, ORANGE, PURPLE, as_label, write_figure
from gearbench.results.responses import quantity

_STYLES = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "^"), (PURPLE, "D"))


def heading(label: str) -> tuple[str, str]:
    """Symbol and unit of an objective; for a weighted sum, the whole label without a unit."""
    q = quantity(label)
    return (label.replace("_", " "), "") if q is None else (q.symbol, q.units)


def findings(dataset: xr.Dataset) -> list[str]:
    """Findings of the verification, one line per objective and one for the front."""
    lines = []
    for i, label in enumerate(map(str, dataset["objective_name"].values)):
        shift, rho = dataset["shift"].values[:, i], float(dataset["rank_correlation"].values[i])
        span = f"{np.nanmin(shift):+.1f} to {np.nanmax(shift):+.1f} %, median {np.nanmedian(shift):+.1f} %"
        lines.append(f"{heading(label)[0]}: rank correlation {_rho(rho)}, shift {span}")
    count, kept = dataset.sizes["design"], int(dataset["on_front_verified"].sum())
    lines.append(f"{kept} of {count} designs are not dominated by another with finite elements")
    failed = count - int(dataset["verified"].sum())
    return lines if failed == 0 else [*lines, f"{failed} designs could not be evaluated with finite elements"]


def _rho(value: float) -> str:
    """Format a rank correlation, which is unknown for fewer than three designs."""
    return f"{value:.3f}" if np.isfinite(value) else "unknown"


def markdown(dataset: xr.Dataset, name: str) -> str:
    """Markdown text of the findings and a table of all designs."""
    lines = [f"# {markdown_name(name) or 'study'}: front verified with finite elements", ""]
    lines += [f"- {line}" for line in findings(dataset)]
    lines += ["", "Each objective: stored / with finite elements (shift).", ""]
    labels = list(map(str, dataset["objective_name"].values))
    variables = [str(v) for v in dataset.attrs["variables"].split(", ")]
    heads = ["design", *variables, *(f"{short} [{unit}]" if unit else short for short, unit in map(heading, labels))]
    lines += ["| " + " | ".join([*heads, "still on the front"]) + " |", "|---:" * (len(heads) + 1) + "|"]
    for number in range(dataset.sizes["design"]):
        row = dataset.isel(design=number)
        cells = [str(int(row["number"])), *(_cell(row[name].item()) for name in variables)]
        pairs = zip(row["objective"].values, row["objective_verified"].values, row["shift"].values, strict=True)
        cells += [f"{old:.4g} / {new:.4g} ({shift:+.1f} %)" for old, new, shift in pairs]
        kept = "yes" if row["on_front_verified"] else "no" if row["verified"] else str(row["reason"].item())
        lines.append("| " + " | ".join([*cells, kept]) + " |")
    return "\n".join(lines) + "\n"


def _cell(value: object) -> str:
    return f"{value:g}" if isinstance(value, (int, float)) else str(value)


def moved(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Draw the first two objectives of all designs, joined by a line to their values by finite elements."""
    before, after = dataset["objective"].values, dataset["objective_verified"].values
    for a, b in zip(before, after, strict=True):
        axes.plot([a[0], b[0]], [a[1], b[1]], color=GREY, lw=0.8)
    axes.plot(before[:, 0], before[:, 1], "o", mfc="white", mec=BLUE, mew=1.5, ms=6, label="fast model, as searched")
    axes.plot(after[:, 0], after[:, 1], "s", color=ORANGE, ms=5, label="finite elements")
    (x, x_unit), (y, y_unit) = (heading(str(label)) for label in dataset["objective_name"].values[:2])
    axes.set(xlabel=f"{x} [{x_unit or '–'}]", ylabel=f"{y} [{y_unit or '–'}]")
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return axes


def shifts(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Draw the relative change of all objectives over the rank of the design in the stored front."""
    from matplotlib.ticker import MaxNLocator

    for i, label in enumerate(map(str, dataset["objective_name"].values)):
        colour, marker = _STYLES[i % len(_STYLES)]
        rank = 1 + np.argsort(np.argsort(dataset["objective"].values[:, 0], kind="stable"))
        short, unit = heading(label)
        text = (
            f"{short if unit else f'objective {i + 1}'}: rank correlation {_rho(dataset['rank_correlation'].values[i])}"
        )
        axes.plot(rank, dataset["shift"].values[:, i], marker, color=colour, ms=5, label=text)
    axes.axhline(0, color=GREY, lw=0.8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="rank on the front, by the first objective [–]", ylabel="change by finite elements [%]")
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return axes


def draw_verification(dataset: xr.Dataset, folder: Path, name: str) -> Path:
    """Write ``verification.png``: shift of the designs in the objectives."""
    import matplotlib.pyplot as plt

    two = dataset.sizes["objective_name"] > 1
    with plt.rc_context({"font.size": 11}):
        figure, axes = plt.subplots(1, 1 + two, figsize=(6.5 + 6.0 * two, 5.4), layout="constrained", squeeze=False)
        if two:
            moved(dataset, axes[0, 0])
        shifts(dataset, axes[0, -1])
        for axis in axes.flat:
            axis.grid(alpha=0.3)
        rho = dataset["rank_correlation"].values
        order = f", their order holds to a rank correlation of {np.nanmin(rho):.3f}" if np.any(np.isfinite(rho)) else ""
        largest = np.nanmax(np.abs(dataset["shift"].values))
        figure.suptitle(f"{as_label(name or 'study')}: finite elements move objectives by up to {largest:.0f} %{order}")
        return write_figure(figure, folder / "verification.png")
