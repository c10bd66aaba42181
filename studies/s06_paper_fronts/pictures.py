"""Figures: Figures 5, 8, 9 and 10 of Garambois et al. 2017 with our data, and the progress of the searches."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.lazy import xr
from gearbench.plotting import BLUE, GREEN, ORANGE, legend_below, new_figure, write_figure
from studies.s06_paper_fronts import tables
from studies.s06_paper_fronts.data import SHOWN
from studies.s06_paper_fronts.findings import LEAD, WIDE, front, measures
from studies.s06_paper_fronts.search import MODULE, TOOLS

#: Okabe–Ito colours and markers of the tools, which stay distinct in grey.
COLOUR = {1: BLUE, 2: ORANGE, 3: GREEN}
MARKER = {1: "o", 2: "s", 3: "^"}
#: Number of boxes in Figure 9; more would hide each other.
BOXES = 10
ACROSS, UP = "m$_k$, mean RMS of mesh stiffness [%]", "m$_{ste}$, mean RMS of transmission error [µm]"
_STYLE: Any = {"font.size": 12, "axes.titlesize": 12, "figure.titlesize": 14, "legend.fontsize": 10.5}


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Draw Figures 5, 8, 9 and 10 of the paper and the progress of the searches, and write the tables."""
    import matplotlib as mpl

    with mpl.rc_context(_STYLE):
        for name, make in (
            ("figure_5_density", figure_5),
            ("figure_8_fronts", figure_8),
            ("figure_9_dispersion", figure_9),
            ("figure_10_wide_fronts", figure_10),
            ("searches", searches),
        ):
            write_figure(make(dataset), folder / f"{name}.png")
    tables.write(dataset, folder)


def _figure(columns: int = 1, size: tuple[float, float] = (10.0, 6.6), **shared: Any) -> tuple[Any, Any]:
    figure, axes = new_figure(1, columns, size, **shared)
    return figure, axes[0] if columns > 1 else axes[0, 0]


def _label(tool: int) -> str:
    return f"tool {tool}, m$_n$ = {MODULE[tool]:g} mm"


def _columns(dataset: xr.Dataset, chosen: xr.DataArray, names: tuple[str, ...] = ("m_k", "m_ste")) -> list[Any]:
    """Values of the chosen gears, sorted by m_k."""
    values = [dataset[name].values[chosen.values] for name in names]
    order = np.argsort(values[0], kind="stable")
    return [v[order] for v in values]


def figure_5(dataset: xr.Dataset) -> Any:
    """Draw the density of the RMS values of one gear over the error samples."""
    from scipy.stats import gaussian_kde

    figure, axes = _figure(2, (11.5, 5.4))
    printed = dataset["row_paper"].sel(row=SHOWN)
    parts = []
    for axis, name, symbol, unit, label in (
        (axes[0], "k", "k", "%", "RMS of mesh stiffness [%]"),
        (axes[1], "ste", "ste", "µm", "RMS of transmission error [µm]"),
    ):
        values = dataset[f"sample_{name}"].values
        m, sigma, largest = values.mean(), values.std(ddof=1), values.max()
        x = np.linspace(values.min() - sigma, largest + sigma, 300)
        axis.hist(
            values, bins=min(40, values.size // 8), density=True, color="0.85", label=f"{values.size} error samples"
        )
        axis.plot(x, gaussian_kde(values)(x), color=COLOUR[1], lw=2, label="density")
        axis.axvspan(m - sigma, m + sigma, color=COLOUR[1], alpha=0.12, lw=0, label="m ± σ")
        axis.axvline(m, color=COLOUR[1], lw=1.5)
        for column, style in ((f"m_{name}", "--"), (f"max_{name}", ":")):
            meaning = "mean m" if style == "--" else "maximum M"
            axis.axvline(float(printed.sel(column=column)), color=COLOUR[2], ls=style, label=f"{meaning}, paper")
        axis.set(xlabel=label, ylabel=f"probability density [1/{unit}]")
        axis.set_title(f"m {m:.3g} {unit}, σ {sigma:.2g} {unit}, M {largest:.3g} {unit}")
        parts.append(f"{100 * sigma / m:.0f} % of RMS {'STE' if symbol == 'ste' else 'k'}")
        axis.set_ylim(bottom=0)
    legend_below(figure, axes[0], 5)
    figure.suptitle(f"Errors of class 6 scatter gear {SHOWN}: σ is {' and '.join(parts)}")
    return figure


def figure_8(dataset: xr.Dataset) -> Any:
    """Draw the three fronts, with the rows of Table 2 as printed and as re-evaluated."""
    figure, axis = _figure()
    for tool in TOOLS:
        colour, marker = COLOUR[tool], MARKER[tool]
        k, ste = front(dataset, tool)[np.argsort(front(dataset, tool)[:, 0])].T
        axis.step(k, ste, where="post", color=colour, lw=1, alpha=0.6)
        axis.plot(k, ste, marker, color=colour, ms=5, label=f"{_label(tool)}: front of {k.size} gears")
        rows = dataset.isel(row=np.flatnonzero(dataset["row_tool"].values == tool))
        ours, paper = rows["row_ours"].values, rows["row_paper"].values
        for (x, y), (px, py) in zip(ours[:, :2], paper[:, :2], strict=True):
            axis.plot([x, px], [y, py], color=colour, lw=0.6, alpha=0.5)
        axis.plot(*ours[:, :2].T, marker, mfc="white", mec=colour, mew=1.5, ms=8)
        axis.plot(*paper[:, :2].T, "x", color=colour, ms=6, alpha=0.7)
    axis.plot([], [], "o", mfc="white", mec="0.3", mew=1.5, ms=8, label="Table 2, evaluated with this model")
    axis.plot([], [], "x", color="0.3", ms=6, label="Table 2, as printed in the paper")
    axis.set(xlabel=ACROSS, ylabel=UP)
    axis.set_ylim(bottom=0)
    axis.grid(alpha=0.3)
    axis.legend(loc="upper right", frameon=False)
    figure.suptitle(_finding_8(dataset))
    return figure


def _finding_8(dataset: xr.Dataset) -> str:
    worst = max(measures(dataset, tool)["largest lead of a row"] for tool in TOOLS)
    least = {tool: float(front(dataset, tool)[:, 1].min()) for tool in TOOLS}
    first, second = sorted(TOOLS, key=least.__getitem__)[:2]
    more = f" by more than {100 * LEAD:.0f} %"
    beaten = f"No gear of Table 2 beats its tool's front{more if worst > 0 else ''}"
    if worst > LEAD:
        beaten = f"Some gears of Table 2 beat their tool's front{more}"
    below = np.floor(100 * least[second]) / 100
    return f"{beaten};\nonly m$_n$ = {MODULE[first]:g} mm comes below {below:.2f} µm of transmission error"


def figure_9(dataset: xr.Dataset) -> Any:
    """Draw the front of tool 3, and the scatter of gears spread over it."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle

    figure, axis = _figure()
    chosen = (dataset["design_tool"] == 3) & (dataset["on_front"] == 1)
    k, ste, sk, se = _columns(dataset, chosen, ("m_k", "m_ste", "sigma_k", "sigma_ste"))
    shown = _spread(k, ste, BOXES)
    boxes = [Rectangle((k[i] - sk[i], ste[i] - se[i]), 2 * sk[i], 2 * se[i]) for i in shown]
    axis.add_collection(PatchCollection(boxes, fc=COLOUR[3], ec="none", alpha=0.12))
    axis.add_collection(PatchCollection(boxes, fc="none", ec=COLOUR[3], alpha=0.8, lw=1))
    axis.plot(k, ste, MARKER[3], color="0.6", ms=4, mew=0, label=f"{_label(3)}: front of {k.size} gears")
    axis.plot(k[shown], ste[shown], MARKER[3], color=COLOUR[3], ms=7, label=f"{len(shown)} of them, spread over it")
    axis.fill([], [], fc=COLOUR[3], ec=COLOUR[3], alpha=0.3, label="their 2σ$_k$ × 2σ$_{ste}$ (mean ± σ)")
    axis.set(xlabel=ACROSS, ylabel=UP)
    axis.set_ylim(bottom=0)
    axis.grid(alpha=0.3)
    axis.legend(loc="upper right", frameon=False)
    figure.suptitle(
        f"Tool 3: manufacturing errors scatter stiffness fluctuation by {_percent(sk / k)},\n"
        f"transmission error by {_percent(se / ste)} of its mean"
    )
    return figure


def _spread(x: NDArray, y: NDArray, count: int) -> NDArray:
    """Indices of ``count`` points spread evenly along a drawn front."""
    along = np.cumsum(np.hypot(np.diff(x, prepend=x[0]) / np.ptp(x), np.diff(y, prepend=y[0]) / np.ptp(y)))
    return np.unique([int(np.argmin(np.abs(along - at))) for at in np.linspace(0, along[-1], count)])


def _percent(ratio: NDArray) -> str:
    return f"{100 * ratio.min():.0f} to {100 * ratio.max():.0f} %"


def figure_10(dataset: xr.Dataset) -> Any:
    """Draw the wide fronts, which include near-optimal gears."""
    figure, axes = _figure(3, (15.0, 6.0), sharex=True, sharey=True)
    near = dataset["in_wide_front"] == 1
    for axis, tool in zip(axes, TOOLS, strict=True):
        own = dataset["design_tool"] == tool
        axis.plot(*_columns(dataset, own), "o", color="0.85", ms=2, mew=0, label=f"{int(own.sum())} feasible gears")
        text = f"{int((own & near).sum())} within {100 * WIDE:.0f} % of the front"
        axis.plot(*_columns(dataset, own & near), MARKER[tool], color=COLOUR[tool], ms=4, alpha=0.45, mew=0, label=text)
        F = _columns(dataset, own & (dataset["on_front"] == 1))
        axis.plot(*F, "-", color="black", lw=1.4, label=f"front of {F[0].size}")
        axis.set(xlabel="m$_k$ [%]", title=_label(tool))
        axis.grid(alpha=0.3)
        axis.legend(loc="upper right", frameon=False, markerscale=2)
    k, ste = _columns(dataset, near)
    axes[0].set(xlim=(k.min() - 0.3, k.max() + 0.7), ylim=(0, 1.25 * ste.max()), ylabel="m$_{ste}$ [µm]")
    best = int((dataset["on_front"] == 1).sum())
    figure.suptitle(
        f"Near-optimal gears are many: {k.size} within {100 * WIDE:.0f} % of a front in both objectives, "
        f"{k.size / best:.0f} for each gear on it"
    )
    return figure


def searches(dataset: xr.Dataset) -> Any:
    """Draw hypervolume and number of new designs over the generations."""
    figure, axes = _figure(2, (11.5, 5.2))
    generation = dataset["generation"].values
    for tool in TOOLS:
        run = dataset.sel(tool=tool)
        volume = run["generation_hypervolume"].values
        axes[0].plot(generation, 100 * (volume / volume[-1] - 1), color=COLOUR[tool], label=_label(tool))
        axes[1].plot(generation, run["generation_evaluated"], color=COLOUR[tool], lw=1.2)
    axes[0].set(xlabel="generation [–]", ylabel="hypervolume against the last generation [%]")
    axes[0].set_ylim(-10, 0.5)
    axes[1].set(xlabel="generation [–]", ylabel="designs not known before [–]")
    axes[1].set_ylim(bottom=0)
    for axis in axes:
        axis.grid(alpha=0.3)
    axes[0].legend(loc="lower right", frameon=False)
    new = 1 - float(dataset["designs"].sum() / dataset["asked"].sum())
    seconds = float(dataset["wall_s"].sum())
    figure.suptitle(
        f"{int(dataset['asked'].sum())} designs asked for in {seconds / 60:.1f} min; "
        f"{100 * new:.0f} % of them were known already"
    )
    return figure
