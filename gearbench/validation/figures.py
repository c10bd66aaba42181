"""Figures of a comparison (the Dataset of ``compare``): matplotlib figures whose titles state the finding."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.lazy import Axes, Figure, xr
from gearbench.plotting import BLUE, GREEN, GREY, ORANGE, PURPLE, legend_below, new_figure, plot_two_periods
from gearbench.results.cycle import Phases, curves

#: Colour, line style and label of both models.
STYLES: dict[str, dict[str, Any]] = {
    "reference": {"color": "black", "lw": 2.4, "ls": "-", "label": "finite elements"},
    "fast": {"color": ORANGE, "lw": 1.6, "ls": "--", "label": "fast model"},
}


def percent(value: float) -> str:
    """Format a relative error [%] with its sign."""
    return f"{value:+.1f} %".replace("-", "−") if np.isfinite(value) else "undefined"


def duration(seconds: float) -> str:
    """Format a time in seconds or milliseconds."""
    return f"{seconds:.1f} s" if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def cycle_figure(dataset: xr.Dataset) -> Figure:
    """Figure of STE and mesh stiffness over two mesh cycles for both models, as in Figure 4 of the paper."""
    figure, axes = new_figure(2, 1, (7.5, 6.2), sharex=True)
    for axis, name, word in zip(
        axes[:, 0], ("transmission_error", "mesh_stiffness"), ("STE", "stiffness"), strict=True
    ):
        draw_cycle(dataset, name, axis)
        mean, peak = (percent(float(dataset[f"{name}_{part}_error"])) for part in ("mean", "peak_to_peak"))
        axis.set_title(f"{word}: mean {mean}, peak-to-peak {peak}")
    axes[1, 0].set_xlabel("mesh phase τ [mesh periods]")
    legend_below(figure, axes[0, 0], 2)
    return figure


def draw_cycle(dataset: xr.Dataset, name: str, axis: Axes) -> None:
    """Draw a curve of the mesh cycle over two mesh cycles for both models."""
    for model, style in STYLES.items():
        plot_two_periods(axis, dataset.sel(model=model), name, **style)
    axis.axvline(sum(axis.get_xlim()) / 2, color=GREY, lw=0.8, ls=":")
    axis.set_ylabel(f"{dataset[name].attrs['symbol']} [{dataset[name].attrs['units']}]")


def load_share_figure(dataset: xr.Dataset) -> Figure:
    """Figure of the load share of a tooth pair over its passage, and of the difference between the models.

    For a set: of the load share of each mesh over two mesh cycles.
    """
    if "load_sharing" in dataset:
        return _sharing_figure(dataset)
    figure, axes = new_figure(2, 1, (7.5, 5.2), sharex=True, height_ratios=(2, 1))
    upper, lower = axes[:, 0]
    position, share = share_of_a_pair(dataset)
    for model, style in STYLES.items():
        upper.plot(position, share[model], **style)
    lower.plot(position, share["fast"] - share["reference"], color=ORANGE, lw=1.4)
    lower.axhline(0, color=GREY, lw=0.8)
    upper.set(ylabel="share of the load X [%]", ylim=(0, None))
    lower.set(xlabel="progress of a tooth pair τ + k [mesh periods]", ylabel="difference [% of load]")
    largest, rms = (100 * float(dataset[f"load_share_error_{part}"]) for part in ("max", "rms"))
    upper.set_title(f"load sharing differs by at most {largest:.1f} % of the load, {rms:.1f} % RMS")
    legend_below(figure, upper, 2)
    return figure


def _sharing_figure(dataset: xr.Dataset) -> Figure:
    figure, ((axis,),) = new_figure(1, 1, (7.5, 4.2))
    for number, name in enumerate(dataset["mesh"].values.tolist()):
        for model, style in STYLES.items():
            line = {
                "color": f"C{number}",
                "ls": style["ls"],
                "lw": 1.4,
                "label": name if model == "reference" else None,
            }
            plot_two_periods(axis, dataset.sel(model=model, mesh=name), "load_sharing", **line)
    axis.set(xlabel="mesh phase τ [mesh periods]", ylabel="load share L [–]")
    largest, factor = 100 * float(dataset["load_share_error_max"]), float(dataset["mesh_load_factor_error"])
    axis.set_title(f"load sharing differs by at most {largest:.2g} % of an even share, K_γ by {percent(factor)}")
    legend_below(figure, axis, 3)
    return figure


def share_of_a_pair(dataset: xr.Dataset) -> tuple[NDArray, dict[str, NDArray]]:
    """Progress τ + k of a tooth pair in contact [mesh periods], and its load share by model [%], (point,)."""
    phases = Phases.of_dataset(dataset)
    parts = []
    for k, index in enumerate(dataset["pair_index"].values):
        sides = [curves(phases, dataset["load_share"].sel(model=model).values[:, k]) for model in STYLES]
        for (x, one), (_, other) in zip(*sides, strict=True):
            loaded = (one > 0) | (other > 0)
            parts.append(np.array([x + index, 100 * one, 100 * other])[:, loaded])
    joined = np.concatenate(parts, axis=1)
    position, *shares = joined[:, np.argsort(joined[0], kind="stable")]
    return position, dict(zip(STYLES, shares, strict=True))


def harmonics_figure(dataset: xr.Dataset) -> Figure:
    """Figure of the harmonic amplitudes of STE and stiffness for both models."""
    figure, axes = new_figure(1, 2, (9.5, 3.8))
    for axis, name in zip(axes[0], ("transmission_error", "mesh_stiffness"), strict=True):
        harmonic = dataset["harmonic"].values
        for shift, (model, style) in zip((-0.2, 0.2), STYLES.items(), strict=True):
            amplitude = dataset[f"{name}_amplitude"].sel(model=model).values
            hatch = None if model == "reference" else "//"
            axis.bar(harmonic + shift, amplitude, 0.38, color=style["color"], hatch=hatch, label=style["label"])
        worst = dataset[f"{name}_amplitude_error"].values
        i = int(np.nanargmax(np.abs(worst)))
        axis.set_title(f"harmonic {harmonic[i]}: {percent(float(worst[i]))} of the fundamental", fontsize=10)
        attrs = dataset[f"{name}_amplitude"].attrs
        axis.set(xlabel="harmonic n [–]", ylabel=f"amplitude {attrs['symbol']} [{attrs['units']}]")
        axis.set_xticks(harmonic)
    legend_below(figure, axes[0, 0], 2)
    return figure


def mac_figure(dataset: xr.Dataset) -> Figure:
    """Figure of maps over both flanks: MAC and size ratio of the deflection shapes."""
    count = dataset.sizes["gear"]
    figure, axes = new_figure(2, count, (4.75 * count, 6.2))
    worst, mean = dataset["mac_worst"].values, dataset["mac_mean"].values
    low = min(0.9, float(np.floor(10 * worst.min()) / 10))
    spread = max(0.1, float(np.abs(dataset["norm_ratio"].values - 1).max()))
    for k, gear in enumerate(dataset["gear"].values):
        y, radius = dataset["load_position"].values, dataset["load_radius"].values[k]
        styles = (
            ("mac", "cividis", low, 1.0, f"{gear}: MAC at worst {worst[k]:.3f}, mean {mean[k]:.3f}"),
            ("norm_ratio", "PuOr_r", 1 - spread, 1 + spread, _softness(gear, float(dataset["compliance_ratio"][k]))),
        )
        for row, (name, colours, bottom, top, title) in enumerate(styles):
            axis = axes[row, k]
            drawn = axis.pcolormesh(y, radius, dataset[name].values[k], cmap=colours, vmin=bottom, vmax=top)
            axis.set(xlabel="position of the load along the face width y [mm]", ylabel="radius of the load R [mm]")
            axis.set_title(title, fontsize=10)
            if k == count - 1:
                label = "MAC [–]" if name == "mac" else "deflection over\nthat of the reference [–]"
                figure.colorbar(drawn, ax=axes[row].tolist(), label=label)
    return figure


def _softness(gear: str, ratio: float) -> str:
    word = "softer" if ratio > 1 else "stiffer"
    return f"{gear}: {100 * abs(ratio - 1):.1f} % {word} than finite elements"


def time_figure(dataset: xr.Dataset) -> Figure:
    """Figure of the wall times of both models: compliance of a new pair, and simulation."""
    figure, axes = new_figure(1, 1, (7.5, 2.6))
    axis = axes[0, 0]
    rows = []
    for model, label in (("fast", "fast model"), ("reference", "finite elements")):
        values = dataset.sel(model=model)
        rows.append((f"{label}: compliance", float(values["compliance_seconds"]), BLUE if model == "fast" else PURPLE))
        rows.append((f"{label}: simulation", float(values["simulation_seconds"]), GREEN if model == "fast" else GREY))
    axis.barh(range(4), [1e3 * row[1] for row in rows], color=[row[2] for row in rows])
    for i, (_, seconds, _) in enumerate(rows):
        axis.text(1e3 * seconds, i, f" {duration(seconds)}", va="center")
    axis.set_yticks(range(4), [row[0] for row in rows])
    axis.invert_yaxis()
    axis.set(xscale="log", xlabel="wall time [ms]")
    times = [1e3 * row[1] for row in rows]
    axis.set_xlim(10.0 ** np.floor(np.log10(min(times) / 2)), 8 * max(times))
    fast, slow = dataset["compliance_seconds"].values
    axis.set_title(f"compliance: {slow / fast:.0f} times faster than finite elements")
    return figure
