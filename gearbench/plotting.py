"""Plots of results. Every function draws on matplotlib axes and returns them; ``draw_…`` write PNG files."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.effects.base import GapEffect
from gearbench.effects.profile_relief import ProfileRelief
from gearbench.errors import plain
from gearbench.files import replacing
from gearbench.geometry.role import Role
from gearbench.results.cycle import fourier, panels
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Okabe–Ito colours, safe for colour-blind readers.
BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "0.45"
DPI = 150


def new_figure(rows: int, columns: int, size: tuple[float, float], **more: Any) -> tuple[Figure, Any]:
    """Figure outside pyplot, which needs no display and is nobody's current figure; axes (rows, columns)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **more)


def legend_below(figure: Figure, axis: Axes, columns: int) -> None:
    """One legend for all axes, that of ``axis``, below them."""
    figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=columns, frameon=False)


def _axes(axes: Axes | None, size: tuple[float, float] = (7.0, 4.0)) -> Axes:
    """The axes given, or those of a new figure."""
    if axes is not None:
        return axes
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=size, layout="constrained")[1]


def plot_two_periods(axes: Axes, dataset: xr.Dataset, name: str, **style: Any) -> None:
    """Plot a variable of the mesh cycle over two mesh periods, interrupted where it jumps."""
    curves = panels(dataset, name)
    x = np.concatenate([phase + period for period in (0, 1) for phase, _ in curves])
    axes.plot(x, np.concatenate([values for _, values in curves] * 2), **style)


def over_two_periods(dataset: xr.Dataset, name: str, axes: Axes | None = None, colour: str = BLUE) -> Axes:
    """A variable of the mesh cycle, "transmission_error" or "mesh_stiffness", over two mesh periods."""
    axes = _axes(axes)
    plot_two_periods(axes, dataset, name, color=colour, lw=1.6)
    axes.axvline(1.0, color=GREY, lw=0.8, ls=":")
    axes.set(xlim=(0, 2), xlabel="mesh phase τ [mesh periods]")
    axes.set_ylabel(f"{dataset[name].attrs['symbol']} [{dataset[name].attrs['units']}]")
    return axes


def order_spectrum(dataset: xr.Dataset, name: str = "transmission_error", axes: Axes | None = None) -> Axes:
    """Amplitudes of the mesh orders of STE or mesh stiffness."""
    axes = _axes(axes)
    amplitude = fourier(dataset, name)
    order = np.arange(1, len(amplitude) + 1)
    colour = BLUE if name == "transmission_error" else ORANGE
    amplitude = amplitude[np.isfinite(amplitude)]
    order = order[: len(amplitude)]
    axes.bar(order, amplitude, color=colour, width=0.6)
    if f"{name}_amplitude_noise_floor" in dataset:
        floor = dataset[f"{name}_amplitude_noise_floor"].values[: len(order)]
        axes.plot(order, floor, "_", color=GREY, ms=16, mew=1.5, label="numerical noise floor")
        axes.legend(frameon=False)
    axes.set_xticks(order)
    axes.set(xlabel="mesh order [–]", yscale="log")
    axes.set_ylim(top=2 * amplitude.max(), bottom=max(amplitude.min() / 2, 1e-4 * amplitude.max()))
    axes.set_ylabel(f"amplitude of {dataset[name].attrs['symbol']} [{dataset[name].attrs['units']}]")
    return axes


def load_distribution(dataset: xr.Dataset, axes: Axes | None = None) -> Axes:
    """Line load on the flank over the mesh cycle: path of contact across, face width up."""
    axes = _axes(axes, (7.0, 4.5))
    present = (dataset["segment_length"] > 0).all("segment").values
    # the lines of all pairs are one family, ordered by τ + k
    order = np.argsort((dataset["mesh_phase"].values[:, None] + dataset["pair_index"].values)[present])
    u, y, load = (dataset[name].values[present][order] for name in ("path_position", "face_position", "line_load"))
    # a line that just enters at a corner is short and heavily loaded: it must not hide the rest
    weight = dataset["segment_length"].values[present][order]
    top = float(np.quantile(load, 0.99, weights=weight, method="inverted_cdf"))
    drawn = axes.pcolormesh(u, y, load, shading="gouraud", cmap="viridis", vmin=0, vmax=top)
    axes.plot(u.T, y.T, color="white", lw=0.4, alpha=0.4)
    figure = axes.get_figure()
    assert figure is not None
    extend = "max" if load.max() > 1.01 * top else "neither"
    figure.colorbar(drawn, ax=axes, label="line load q [N/mm]", extend=extend)
    axes.set(xlabel="position on the path of contact u [mm]", ylabel="position along the face width y [mm]")
    return axes


def load_map(dataset: xr.Dataset, role: Role, axes: Axes | None = None, *, scale: float | None = None) -> Axes:
    """Contact pressure on the flank of one gear over the mesh cycle: face width across, roll angle up.

    With the lines of tip, pitch circle and start of the active profile, and of every begin of a relief; diameters on
    the right. ``scale`` [MPa] is the end of the colours, by default the largest pressure but for lines that just enter:
    maps of several designs can be compared where it is the same.
    """
    axes = _axes(axes, (6.0, 5.0))
    scene = parse_scene(tomllib.loads(dataset.attrs["scene"]))
    pair, gear = scene.pair, scene.pair.gears[role]
    present = (dataset["segment_length"] > 0).all("segment").values
    order = np.argsort((dataset["mesh_phase"].values[:, None] + dataset["pair_index"].values)[present])
    u, y, load, weight = (
        dataset[name].values[present][order]
        for name in ("path_position", "face_position", "line_load", "segment_length")
    )
    rho = pair.meshing.curvature_radius(np.clip(u, 1e-6 * pair.meshing.tangent_length, None))
    pressure = np.sqrt(load * pair.material.plane_strain_modulus / (2 * np.pi * np.maximum(rho, 1e-9)))
    roll = u if role == Role.PINION else pair.meshing.tangent_length - u
    top = scale or float(np.quantile(pressure, 0.995, weights=weight, method="inverted_cdf"))
    angle = np.degrees(roll / gear.base_radius)
    drawn = axes.pcolormesh(y, angle, pressure, shading="gouraud", cmap="viridis", vmin=0, vmax=top)
    figure = axes.get_figure()
    assert figure is not None
    extend = "max" if pressure.max() > 1.005 * top else "neither"
    figure.colorbar(drawn, ax=axes, label="contact pressure p [MPa]", extend=extend, pad=0.16)
    for radius, name, style in _circles(scene, role):
        at = float(np.degrees(np.sqrt(max(radius**2 - gear.base_radius**2, 0.0)) / gear.base_radius))
        axes.axhline(at, color="black" if style == "-" else "0.25", lw=1.0, ls=style)
        axes.annotate(
            f"{name} ⌀{2 * radius:.2f}", (1.01, at), xycoords=("axes fraction", "data"), va="center", fontsize=7
        )
    for kink in sorted({y for effect in scene.flank_effects if isinstance(effect, GapEffect)
                         for y in effect.face_kinks(pair)}):  # fmt: skip
        axes.axvline(kink, color="0.25", lw=1.0, ls=":")
    axes.set(xlim=(0, pair.face_width), xlabel="position along the face width y [mm]", ylabel="roll angle [°]")
    return axes


def _circles(scene: Scene, role: Role) -> list[tuple[float, str, str]]:
    """Radii on a flank that are marked, with their names and line styles."""
    pair, gear = scene.pair, scene.pair.gears[role]
    working = gear.base_radius / np.cos(pair.meshing.alpha_wt)
    found = [(gear.tip_radius, "tip", "-"), (working, "pitch", "--"), (pair.meshing.active_radii[role][0], "SAP", "-")]
    reliefs = [effect for effect in scene.flank_effects if isinstance(effect, ProfileRelief)]
    for slope in (slope for effect in reliefs for slope in effect.slopes(pair) if slope.role == role):
        radius = slope.start if slope.along == "radius" else float(np.hypot(slope.start, gear.base_radius))
        found.append((radius, "relief", ":"))
    return found


def density(dataset: xr.Dataset, name: str, axes: Axes | None = None, colour: str = BLUE) -> Axes:
    """Density of a response over the error samples, with its mean and maximum (Figure 5 of the paper)."""
    from scipy.stats import gaussian_kde

    axes = _axes(axes)
    values, attrs = dataset[name].values, dataset[name].attrs
    axes.hist(values, bins=min(40, 5 + len(values) // 10), density=True, color=colour, alpha=0.3)
    if np.ptp(values) > 0 and len(values) > 2:
        x = np.linspace(values.min() - 0.1 * np.ptp(values), values.max() + 0.1 * np.ptp(values), 300)
        axes.plot(x, gaussian_kde(values)(x), color=colour, lw=1.8)
    axes.axvline(values.mean(), color="black", lw=1, label=f"mean {values.mean():.3g} {attrs['units']}")
    axes.axvline(values.max(), color=GREY, lw=1, ls="--", label=f"maximum {values.max():.3g} {attrs['units']}")
    axes.set_xlabel(f"{attrs['symbol']} [{attrs['units']}]")
    axes.set_ylabel(f"density [1/{attrs['units']}]")
    # above the axes, where no line runs through it
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return axes


def contributions(dataset: xr.Dataset, axes: Axes | None = None) -> Axes:
    """Share of each error in the variance of STE and stiffness, with one standard error; the remainder interacts."""
    axes = _axes(axes, (7.0, 4.5))
    names = [str(name).replace("_", " ") for name in dataset["error_name"].values] + ["interactions"]
    position = np.arange(len(names))
    for shift, (name, colour) in enumerate((("transmission_error_rms", BLUE), ("mesh_stiffness_rms", ORANGE))):
        alone = 100 * dataset[f"{name}_first_order"].values
        share = np.append(alone, max(0.0, 100 - alone.sum()))
        error = np.append(100 * dataset[f"{name}_first_order_standard_error"].values, np.nan)
        label = dataset[name].attrs["symbol"]
        axes.barh(position + 0.4 * shift - 0.2, share, 0.38, xerr=error, color=colour, ecolor=GREY, label=label)
    axes.set_yticks(position, names)
    axes.invert_yaxis()
    axes.set_xlabel("share of the variance, first order [%]")
    axes.legend(frameon=False)
    return axes


def draw_simulation(dataset: xr.Dataset, folder: Path, *, scale: float | None = None) -> list[Path]:
    """Write the plots of a simulation: STE and stiffness, load distribution, load maps, order spectra.

    ``scale``: end of the colours of the load maps [MPa].
    """
    import matplotlib.pyplot as plt

    name = heading(dataset)
    figure, axes = plt.subplots(2, 1, figsize=(7.5, 6.5), sharex=True, layout="constrained")
    over_two_periods(dataset, "transmission_error", axes[0])
    over_two_periods(dataset, "mesh_stiffness", axes[1], ORANGE)
    axes[0].set_xlabel("")
    axes[0].set_title(
        f"{name}\nSTE {float(dataset['transmission_error_mean']):.3g} µm in the mean, "
        f"{float(dataset['transmission_error_rms']):.3g} µm RMS"
    )
    axes[1].set_title(
        f"mesh stiffness {float(dataset['mesh_stiffness_mean']):.4g} N/µm in the mean, "
        f"{float(dataset['mesh_stiffness_rms']):.3g} % RMS"
    )
    written = [write_figure(figure, folder / "ste_and_stiffness.png")]

    axes = load_distribution(dataset)
    axes.set_title(f"{name}\nline load up to {float(dataset['line_load'].max()):.4g} N/mm")
    written.append(write_figure(axes.get_figure(), folder / "load_distribution.png"))

    figure, both = plt.subplots(1, 2, figsize=(12.5, 5.0), layout="constrained")
    for role, axis in zip(Role, both, strict=True):
        load_map(dataset, role, axis, scale=scale).set_title(f"flank of the {role.label}")
    figure.suptitle(f"{name}\ncontact pressure over the mesh cycle")
    written.append(write_figure(figure, folder / "load_maps.png"))

    figure, both = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
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
    """Write the plots of a robustness run: densities of the RMS values, and which error contributes how much."""
    import matplotlib.pyplot as plt

    name = heading(dataset)
    figure, axes = plt.subplots(1, 2, figsize=(10.5, 4.2), layout="constrained")
    density(dataset, "transmission_error_rms", axes[0])
    density(dataset, "mesh_stiffness_rms", axes[1], ORANGE)
    ste, k = (
        float(dataset[f"{v}_std"] / dataset[f"{v}_mean"]) for v in ("transmission_error_rms", "mesh_stiffness_rms")
    )
    figure.suptitle(
        f"{name}\n{dataset.sizes['sample']} error samples scatter RMS STE by {100 * ste:.0f} %, "
        f"RMS stiffness by {100 * k:.0f} %"
    )
    written = [write_figure(figure, folder / "density.png")]
    axes = contributions(dataset)
    leading = dataset["error_name"].values[int(np.argmax(dataset["transmission_error_rms_first_order"].values))]
    axes.set_title(f"{name}\n{str(leading).replace('_', ' ')} contributes most to the scatter of STE")
    return [*written, write_figure(axes.get_figure(), folder / "contributions.png")]


def heading(dataset: xr.Dataset) -> str:
    """Name of the scene and support of its teeth, which titles begin with."""
    return (
        f"{as_label(tomllib.loads(dataset.attrs['scene']).get('name') or 'scene')}, support: {dataset.attrs['support']}"
    )


def as_label(name: str) -> str:
    """A name as text of a figure: $ begins no formula, and what the font lacks is a question mark."""
    from matplotlib.font_manager import FontProperties, findfont, get_font

    known = get_font(findfont(FontProperties())).get_charmap()
    return "".join("\\$" if c == "$" else c if ord(c) in known else "?" for c in plain(name))


def write_figure(figure: Any, path: Path) -> Path:
    """Write a figure, whole or not at all, in the format of the file's ending, and close it."""
    import matplotlib.pyplot as plt

    with replacing(path) as part:
        figure.savefig(part, dpi=DPI, format=path.suffix.removeprefix("."))
    plt.close(figure)
    return path
