"""Plots of results. A plot function draws on matplotlib axes and returns them; ``draw_…`` write PNG files."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.base import GapEffect
from gearbench.effects.profile_relief import ProfileRelief
from gearbench.errors import InputError, plain
from gearbench.files import replacing
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.lazy import Axes, Figure, xr
from gearbench.results.cycle import fourier, panels
from gearbench.results.flank_map import over_flank
from gearbench.results.origin import scene_of
from gearbench.scene import Scene

#: Okabe–Ito colours, safe for colour-blind readers.
BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "0.45"
DPI = 150
#: Maximum number of points of a sweep in a figure, chosen evenly over its range.
POINTS = 8
#: Number of points of a load map in both directions.
MAP = 300


def new_figure(rows: int, columns: int, size: tuple[float, float], **more: Any) -> tuple[Figure, Any]:
    """Make a figure outside pyplot, without display and current-figure state; axes (rows, columns)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **more)


def legend_below(figure: Figure, axis: Axes, columns: int, *others: Axes) -> None:
    """Put one legend below all axes, with the labels of ``axis`` and those that only ``others`` have."""
    handles: dict[str, Any] = {}
    for each in (axis, *others):
        for handle, label in zip(*each.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns, frameon=False)


def _axes(axes: Axes | None, size: tuple[float, float] = (7.0, 4.0)) -> Axes:
    """Return the given axes, or those of a new figure."""
    if axes is not None:
        return axes
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=size, layout="constrained")[1]


def plot_two_periods(axes: Axes, dataset: xr.Dataset, name: str, **style: Any) -> None:
    """Plot a curve over two mesh cycles, of one mesh period as a rule, with gaps where it jumps."""
    curves = panels(dataset, name)
    length = math.ceil(curves[-1][0][-1] - 1e-9)
    x = np.concatenate([phase + start for start in (0, length) for phase, _ in curves])
    axes.plot(x, np.concatenate([values for _, values in curves] * 2), **style)
    axes.set_xlim(0, 2 * length)


def over_two_periods(dataset: xr.Dataset, name: str, axes: Axes | None = None, colour: str = BLUE) -> Axes:
    """Plot "transmission_error" or "mesh_stiffness" over two mesh periods.

    A sweep gets one curve in its colour per point, at most ``POINTS``.
    """
    axes = _axes(axes)
    for one, label, colour_of_point in _points(dataset, name, "position"):
        plot_two_periods(axes, one, name, color=colour_of_point or colour, lw=1.6, label=label)
    axes.axvline(sum(axes.get_xlim()) / 2, color=GREY, lw=0.8, ls=":")
    axes.set_xlabel("mesh phase τ [mesh periods]")
    axes.set_ylabel(f"{dataset[name].attrs['symbol']} [{dataset[name].attrs['units']}]")
    return _legend(axes)


def _points(dataset: xr.Dataset, name: str, along: str) -> list[tuple[xr.Dataset, str | None, Any]]:
    """Choose points of a sweep: Dataset, label and colour; a single scene has no label and colour.

    ``along`` is the dimension of the variable that is not swept.
    """
    from matplotlib import colormaps

    outer = {str(dim): size for dim, size in dataset[name].sizes.items() if dim != along}
    if not outer:
        return [(dataset, None, None)]
    every = list(np.ndindex(*outer.values()))
    chosen = np.unique(np.linspace(0, len(every) - 1, min(POINTS, len(every))).round().astype(int))
    points = []
    for i in chosen:
        one = dataset.isel(dict(zip(outer, every[i], strict=True)))
        label = ", ".join(_value(one, dim) for dim in outer)
        points.append((one, label, colormaps["viridis"](0.9 * i / max(len(every) - 1, 1))))
    return points


def _value(dataset: xr.Dataset, dim: str) -> str:
    """Text with a swept key and its value at a point."""
    coordinate = dataset[dim] if dim in dataset.coords else None
    units = "" if coordinate is None or coordinate.attrs.get("units", "1") == "1" else f" {coordinate.attrs['units']}"
    return dim if coordinate is None else f"{dim.split('.')[-1].replace('_', ' ')} {coordinate.item():g}{units}"


def _legend(axes: Axes) -> Axes:
    """Add a legend if curves have labels."""
    if axes.get_legend_handles_labels()[1]:
        axes.legend(frameon=False, fontsize=8)
    return axes


def _one_point(dataset: xr.Dataset, name: str, *allowed: str) -> None:
    """Refuse a sweep for a figure of a single scene; ``allowed`` are the dimensions that a scene has."""
    for dim in dataset[name].dims:
        if dim not in allowed:
            raise InputError(
                "dataset", f"swept over {dim}", f"must be one point, e.g. dataset.isel({{{str(dim)!r}: 0}})"
            )


def order_spectrum(dataset: xr.Dataset, name: str = "transmission_error", axes: Axes | None = None) -> Axes:
    """Plot amplitudes of the mesh orders of STE or mesh stiffness; a sweep gets at most ``POINTS`` lines."""
    axes = _axes(axes)
    points = _points(dataset, name, "position")
    drawn = np.array([fourier(one, name) for one, _, _ in points])
    order = 1 + np.flatnonzero(np.isfinite(drawn).any(axis=0))
    drawn = drawn[:, order - 1]
    least, most = np.nanmin(drawn), np.nanmax(drawn)
    floor = points[0][0][f"{name}_amplitude_noise_floor"].values[: len(order)] if len(points) == 1 else None
    if floor is not None and np.any(floor > 0):
        least = min(least, floor[floor > 0].min())
    bottom = max(least / 2, 1e-6 * most)
    if len(points) > 1:
        for amplitude, (_, label, colour) in zip(drawn, points, strict=True):
            axes.plot(order, amplitude, "o-", color=colour, lw=1.2, ms=4, label=label)
    else:
        axes.bar(order, drawn[0], color=BLUE if name == "transmission_error" else ORANGE, width=0.6)
        if floor is not None and np.any(floor >= bottom):
            axes.plot(order, floor, "_", color="black", ms=16, mew=1.5, label="numerical noise floor")
    axes.set_xticks(order)
    axes.set(xlabel="mesh order [–]", yscale="log")
    axes.set_ylim(top=2 * most, bottom=bottom)
    axes.set_ylabel(f"amplitude of {dataset[name].attrs['symbol']} [{dataset[name].attrs['units']}]")
    return _legend(axes)


def load_distribution(dataset: xr.Dataset, axes: Axes | None = None) -> Axes:
    """Plot the line load on the flank over the mesh cycle: path of contact over face width."""
    _one_point(dataset, "line_load", "position", "pair", "segment")
    axes = _axes(axes, (7.0, 4.5))
    pair = scene_of(dataset).pair
    u, y, load, weight = _family(dataset)
    _coloured(axes, _on_grid(pair, u, y, weight, load), "line load q [N/mm]", _top_of_colours(load, weight), load.max())
    axes.set(xlabel="position along the face width y [mm]", ylabel="position on the path of contact u [mm]")
    return axes


def load_map(dataset: xr.Dataset, gear: int, axes: Axes | None = None, *, scale: float | None = None) -> Axes:
    """Plot the contact pressure on the flank of one gear over the mesh cycle: roll angle over face width.

    Lines mark tip, pitch circle, start of active profile and starts of reliefs, with their diameters on the right.
    ``scale`` [MPa] is the upper end of the colours; maps with the same scale can be compared. By default it is the
    largest pressure, without isolated peaks where contact lines just enter.
    """
    _one_point(dataset, "line_load", "position", "pair", "segment")
    axes = _axes(axes, (6.0, 5.0))
    scene = scene_of(dataset)
    pair, body = scene.pair, scene.pair.gears[gear]
    u, y, load, weight = _family(dataset)
    pressure = _pressure(pair, u, load)
    top = scale or _top_of_colours(pressure, weight)
    across, path, shown = _on_grid(pair, u, y, weight, pressure)
    roll = pair.meshing.along_path(gear, path)
    flank = roll <= body.roll_length(body.tip_radius)
    angle, shown = np.degrees(roll[flank] / body.base_radius), shown[flank]
    _coloured(axes, (across, angle, shown), "contact pressure p [MPa]", top, pressure.max(), pad=0.02)
    for radius, name, style in _circles(scene, gear):
        angle_of_circle = float(np.degrees(body.roll_length(radius) / body.base_radius))
        axes.axhline(angle_of_circle, color="black" if style == "-" else "0.25", lw=1.0, ls=style)
        axes.annotate(
            f"{name} ⌀{2 * abs(radius):.2f}",
            (1.01, angle_of_circle),
            xycoords=("axes fraction", "data"),
            va="center",
            fontsize=7,
        )
    for kink in sorted({y for effect in scene.flank_effects if isinstance(effect, GapEffect)
                         for y in effect.face_kinks(pair)}):  # fmt: skip
        axes.axvline(kink, color="0.25", lw=1.0, ls=":")
    axes.set(xlim=(0, pair.meshing.face_width), xlabel="position along the face width y [mm]", ylabel="roll angle [°]")
    margin = 0.02 * np.ptp(angle)  # keep the lines of tip and start of active profile clear of the frame
    low, high = angle.min() - margin, angle.max() + margin
    axes.set_ylim((low, high) if body.teeth > 0 else (high, low))  # with the tip at the top
    return axes


def _pressure(pair: Pair, u: NDArray, load: NDArray) -> NDArray:
    """Hertz pressure [MPa] under line loads [N/mm] at positions u [mm] on the path of contact."""
    rho = pair.meshing.curvature_radius(np.clip(u, 1e-6 * abs(pair.meshing.tangent_length), None))
    return np.sqrt(load * pair.contact_modulus / (np.pi * np.maximum(rho, 1e-9)))


def _top_of_colours(values: NDArray, weight: NDArray) -> float:
    """Upper end of a colour scale: the largest value, unless a short line at a corner far exceeds all others."""
    most = float(values.max())
    usual = float(np.quantile(values, 0.99, weights=weight, method="inverted_cdf"))
    return most if most < 1.5 * usual else usual


def _coloured(
    axes: Axes, image: tuple[NDArray, NDArray, NDArray], label: str, top: float, most: float, **bar: Any
) -> None:
    """Draw an image (x, y, values) with its colour bar; its label gives the largest value if it exceeds ``top``."""
    drawn = axes.pcolormesh(*image, shading="nearest", cmap="viridis", vmin=0, vmax=top)
    beyond = most > 1.005 * top
    figure = axes.get_figure()
    assert figure is not None
    text = f"{label}, largest {most:.4g}" if beyond else label
    figure.colorbar(drawn, ax=axes, label=text, extend="max" if beyond else "neither", **bar)


def _family(dataset: xr.Dataset) -> tuple[np.ndarray, ...]:
    """u, y, line load and length on the contact lines of all tooth pairs k, (line, segment), ordered by τ + k."""
    present = (dataset["segment_length"] > 0).all("segment").values
    order = np.argsort((dataset["mesh_phase"].values[:, None] + dataset["pair_index"].values)[present])
    names = ("path_position", "face_position", "line_load", "segment_length")
    u, y, load, length = (dataset[name].values[present][order] for name in names)
    return u, y, load, length


def _on_grid(pair: Pair, u: NDArray, y: NDArray, length: NDArray, values: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Interpolate values on a grid: face positions y and path positions u [mm], and values (path, across)."""
    meshing = pair.meshing
    across = np.linspace(0.0, meshing.face_width, MAP)
    path = np.linspace(min(meshing.path_start, u.min()), max(meshing.path_end, u.max()), MAP)
    return across, path, over_flank(u, y, length * np.cos(meshing.beta_b), values, path, across)


def _circles(scene: Scene, index: int) -> list[tuple[float, str, str]]:
    """Marked radii of a flank, with names and line styles."""
    pair, gear = scene.pair, scene.pair.gears[index]
    working = gear.base_radius / np.cos(pair.meshing.alpha_wt)
    circles = [
        (gear.tip_radius, "tip", "-"),
        (working, "pitch", "--"),
        (pair.meshing.active_radii[index][0], "SAP", "-"),
    ]
    reliefs = [effect for effect in scene.flank_effects if isinstance(effect, ProfileRelief)]
    for begin in (m for effect in reliefs for m in effect.modifications(pair) if m.gear == index):
        radius = begin.start if begin.along == "radius" else float(gear.radius_at(begin.start))
        circles.append((radius, "relief", ":"))
    return circles


def _studied(dataset: xr.Dataset) -> tuple[tuple[str, str], tuple[str, str]]:
    """Choose the two responses of ``robust`` that figures show, with their names, for a pair or a train."""
    if "mesh_load_factor" in dataset:
        return ("mesh_load_factor", "K_γ"), ("train_transmission_error_rms", "RMS of Δ")
    return ("transmission_error_rms", "RMS STE"), ("mesh_stiffness_rms", "RMS stiffness")


def density(dataset: xr.Dataset, name: str, axes: Axes | None = None, colour: str = BLUE) -> Axes:
    """Plot the density of a response over the error samples, with mean and maximum (Figure 5 of the paper).

    A sweep gets the densities of at most ``POINTS`` points.
    """
    axes, attrs = _axes(axes), dataset[name].attrs
    unit = "" if attrs["units"] == "1" else f" {attrs['units']}"
    points = _points(dataset, name, "sample")
    for one, label, colour_of_point in points:
        values = one[name].values
        if len(points) == 1:
            axes.hist(values, bins=min(40, 5 + len(values) // 10), density=True, color=colour, alpha=0.3)
            axes.axvline(values.mean(), color="black", lw=1, label=f"mean {values.mean():.3g}{unit}")
            axes.axvline(values.max(), color=GREY, lw=1, ls="--", label=f"maximum {values.max():.3g}{unit}")
        if np.ptp(values) > 0 and len(values) > 2:
            axes.plot(*_smooth(values), color=colour_of_point or colour, lw=1.8, label=label)
    axes.set_xlabel(f"{attrs['symbol']} [{unit.strip() or '–'}]")
    axes.set_ylabel(f"density [{f'1/{unit.strip()}' if unit else '–'}]")
    # above the axes, so that no curve crosses it
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return axes


def _smooth(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Kernel density of samples (sample,) on a grid; reflected at zero if no sample is negative."""
    from scipy.stats import gaussian_kde

    low, high = values.min() - 0.1 * np.ptp(values), values.max() + 0.1 * np.ptp(values)
    density = gaussian_kde(values)
    if values.min() < 0:
        x = np.linspace(low, high, 300)
        return x, density(x)
    x = np.linspace(max(low, 0.0), high, 300)
    return x, density(x) + density(-x)


def contributions(dataset: xr.Dataset, axes: Axes | None = None) -> Axes:
    """Plot the share of each error in the variance of STE and stiffness, alone (with one standard error) and in total.

    The pale part of a bar comes from interactions with other errors and is counted for both errors. The last bar is the
    variance that is not attributed.
    """
    studied = _studied(dataset)
    _one_point(dataset, f"{studied[0][0]}_first_order", "error_name")
    axes = _axes(axes, (7.0, 4.5))
    names = [str(name).replace("_", " ") for name in dataset["error_name"].values] + ["not attributed"]
    position = np.arange(len(names))
    for shift, ((name, _), colour) in enumerate(zip(studied, (BLUE, ORANGE), strict=True)):
        alone, total = (100 * dataset[f"{name}_{part}"].values for part in ("first_order", "total"))
        share = np.append(alone, max(0.0, 100 - alone.sum() - (total - alone).sum() / 2))
        error = np.append(100 * dataset[f"{name}_first_order_standard_error"].values, np.nan)
        label = dataset[name].attrs["symbol"]
        bars = position + 0.4 * shift - 0.2
        axes.barh(bars[:-1], np.maximum(total, alone), 0.38, color=colour, alpha=0.35)
        axes.barh(bars, share, 0.38, xerr=error, color=colour, ecolor=GREY, label=label)
    axes.set_yticks(position, names)
    axes.invert_yaxis()
    axes.set_xlabel("share of the variance: alone, and pale with others [%]")
    axes.legend(frameon=False)
    return axes


def draw_simulation(dataset: xr.Dataset, folder: Path, *, scale: float | None = None) -> list[Path]:
    """Write the plots of a simulation: STE and stiffness, load distribution, load maps, order spectra.

    ``scale`` is the upper end of the colours of the load maps [MPa].
    """
    _one_point(dataset, "transmission_error", "position")
    name = heading(dataset)
    figure, ((upper,), (lower,)) = new_figure(2, 1, (7.5, 6.5), sharex=True)
    over_two_periods(dataset, "transmission_error", upper).set_xlabel("")
    over_two_periods(dataset, "mesh_stiffness", lower, ORANGE)
    upper.set_title(
        f"{name}\nSTE {float(dataset['transmission_error_mean']):.3g} µm on average, "
        f"{float(dataset['transmission_error_rms']):.3g} µm RMS"
    )
    lower.set_title(
        f"mesh stiffness {float(dataset['mesh_stiffness_mean']):.4g} N/µm on average, "
        f"{float(dataset['mesh_stiffness_rms']):.3g} % RMS"
    )
    written = [write_figure(figure, folder / "ste_and_stiffness.png")]

    axes = load_distribution(dataset)
    axes.set_title(f"{name}\nline load up to {float(dataset['line_load'].max()):.4g} N/mm")
    written.append(write_figure(axes.get_figure(), folder / "load_distribution.png"))

    figure, (both,) = new_figure(1, 2, (12.5, 5.0))
    for index, axis in enumerate(both):
        load_map(dataset, index, axis, scale=scale).set_title(f"flank of the {GEARS[index]}")
    u, _, load, _ = _family(dataset)
    most = _pressure(scene_of(dataset).pair, u, load).max()
    figure.suptitle(f"{name}\ncontact pressure over the mesh cycle, up to {most:.4g} MPa")
    written.append(write_figure(figure, folder / "load_maps.png"))

    figure, (both,) = new_figure(1, 2, (10, 4))
    for axis, variable in zip(both, ("transmission_error", "mesh_stiffness"), strict=True):
        order_spectrum(dataset, variable, axis)
        amplitude = fourier(dataset, variable)
        strongest = int(np.nanargmax(amplitude)) + 1
        units = dataset[variable].attrs["units"]
        axis.set_title(
            f"{dataset[variable].attrs['symbol']}: order {strongest} leads, {np.nanmax(amplitude):.3g} {units}"
        )
    figure.suptitle(f"{name}\nmesh orders")
    return [*written, write_figure(figure, folder / "order_spectrum.png")]


def draw_robust(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """Write the plots of a robustness run: densities of the RMS values, and contributions of the errors."""
    name = heading(dataset)
    figure, (axes,) = new_figure(1, 2, (10.5, 4.2))
    by = []
    for (response, words), ax, colour in zip(_studied(dataset), axes, (BLUE, ORANGE), strict=True):
        density(dataset, response, ax, colour)
        scatter = float(dataset[f"{response}_std"] / dataset[f"{response}_mean"])
        by.append(f"{words} by {100 * scatter:.0f} %")
    figure.suptitle(f"{name}\n{dataset.sizes['sample']} error samples scatter {', '.join(by)}")
    written = [write_figure(figure, folder / "density.png")]
    axes = contributions(dataset)
    axes.set_title(f"{name}\n{_leading(dataset)}", fontsize=9, wrap=True)
    return [*written, write_figure(axes.get_figure(), folder / "contributions.png")]


def _leading(dataset: xr.Dataset) -> str:
    """Text on the error that contributes most to the scatter of STE, and on others within two standard errors.

    For a train, K_γ replaces STE.
    """
    response, words = _studied(dataset)[0]
    share, error = (dataset[f"{response}_first_order{part}"].values for part in ("", "_standard_error"))
    if not np.isfinite(share).all():
        return "too few error samples to tell the errors' shares"
    names = [str(name).replace("_", " ") for name in dataset["error_name"].values]
    first = int(np.argmax(share))
    leader = f"{names[first]} alone causes {100 * share[first]:.0f} % of the variance of {words}"
    # two shares differ if their difference exceeds twice its standard error
    close = [
        names[i]
        for i in np.argsort(-share)
        if i != first and share[first] - share[i] <= 2 * np.hypot(error[first], error[i])
    ]
    if close:
        return (
            f"{leader}\n{', '.join(close[:2])}{' and others' * (len(close) > 2)}: equal within twice the standard error"
        )
    with_others = int(np.argmax(dataset[f"{response}_total"].values))
    if with_others != first:
        total = 100 * float(dataset[f"{response}_total"][with_others])
        return f"{leader}\n{names[with_others]} together with other errors {total:.0f} %"
    return leader


def heading(dataset: xr.Dataset) -> str:
    """First line of a title: name of the scene and support of its teeth."""
    return (
        f"{as_label(tomllib.loads(dataset.attrs['scene']).get('name') or 'scene')}, support: {dataset.attrs['support']}"
    )


def as_label(name: str) -> str:
    """Make a name literal text for a figure: escape $, and replace characters missing in the font by "?"."""
    from matplotlib.font_manager import FontProperties, findfont, get_font

    known = get_font(findfont(FontProperties())).get_charmap()
    return "".join("\\$" if c == "$" else c if ord(c) in known else "?" for c in plain(name))


def write_figure(figure: Any, path: Path) -> Path:
    """Write a figure, whole or not at all, in the format of the file name's ending, and close it."""
    import matplotlib.pyplot as plt

    with replacing(path) as part:
        figure.savefig(part, dpi=DPI, format=path.suffix.removeprefix("."))
    plt.close(figure)
    return path
