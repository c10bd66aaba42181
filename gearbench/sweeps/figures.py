"""Figures of a load range: Harris map, mesh orders and peak-to-peak transmission error over the torque."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.lazy import xr
from gearbench.plotting import BLUE, GREY, ORANGE, as_label, legend_below, new_figure, write_figure
from gearbench.results.cycle import panels
from gearbench.results.origin import scene_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gearbench.scene import Scene

#: Largest number of curves of a Harris map, and of orders shown over the torque.
CURVES, ORDERS = 8, 5


def harris_map(dataset: xr.Dataset, axes: Axes, *, about_mean: bool = False) -> Axes:
    """STE over the roll angle of the pinion at several torques, as in Harris 1958, over two cycles.

    That of a train is drawn over the phase of its first mesh. ``about_mean``: subtract the mean at each torque.
    """
    from matplotlib import colormaps

    scene, length = scene_of(dataset), max(1, round(float(dataset["mesh_phase"].max())))
    gear, meshing = scene.pair.gears[0], scene.pair.meshing
    period, first = 360.0 / gear.teeth, math.degrees(meshing.path_start / gear.base_radius)
    if scene.coupled:
        period, first = 1.0, 0.0
    loads = dataset["torque"].values
    for i in np.unique(np.linspace(0, len(loads) - 1, min(CURVES, len(loads))).round().astype(int)):
        one = dataset.isel(torque=i)
        curves = panels(one, "transmission_error")
        x = np.concatenate([phase + turn for turn in (0, length) for phase, _ in curves])
        y = np.concatenate([values for _, values in curves] * 2)
        y = y - float(one["transmission_error_mean"]) if about_mean else y
        colour = colormaps["viridis"](0.9 * i / max(len(loads) - 1, 1))
        axes.plot(first + period * x, y, color=colour, lw=1.4, label=f"{loads[i]:g} N·m")
    roll = math.degrees(meshing.pitch_point / gear.base_radius)
    if not scene.coupled and first <= roll <= first + 2 * period:
        axes.axvline(roll, color=GREY, lw=0.8, ls=":")
        axes.annotate("C", (roll, 1.01), xycoords=("data", "axes fraction"), ha="center", color=GREY, fontsize=8)
    label = f"{_symbol(scene)} minus its mean [µm]" if about_mean else f"{_symbol(scene)} [µm]"
    along = "phase of the first mesh τ [mesh periods]" if scene.coupled else "roll angle of the pinion [°]"
    axes.set(xlabel=along, ylabel=label, xlim=(first, first + 2 * length * period))
    return axes


def orders_over_torque(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Amplitudes of the first mesh orders of STE over the torque."""
    amplitude = dataset["transmission_error_amplitude"].transpose("harmonic", "torque").values
    for n, (order, values) in enumerate(zip(dataset["harmonic"].values, amplitude[:ORDERS], strict=False)):
        axes.plot(dataset["torque"], values, marker=".", lw=1.4, color=f"C{n}", label=f"order {order:.4g}")
    scene = scene_of(dataset)
    axes.set(xlabel=_torque(scene), ylabel=f"amplitude of {_symbol(scene)} [µm]", yscale="log")
    top = np.nanmax(amplitude)
    axes.set_ylim(max(np.nanmin(amplitude[:ORDERS]) / 1.5, 1e-4 * top), 1.5 * top)
    return axes


def peak_to_peak_over_torque(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Peak-to-peak STE over the torque with its minimum marked; one curve per point of the other swept keys."""
    points, load = _points(dataset), dataset["torque"].values
    points = [
        points[i] for i in np.unique(np.linspace(0, len(points) - 1, min(CURVES, len(points))).round().astype(int))
    ]
    for n, (label, one) in enumerate(points):
        values = one["transmission_error_peak_to_peak"].values
        axes.plot(load, values, color=BLUE if len(points) == 1 else f"C{n}", marker=".", lw=1.6, label=label)
        least = int(np.nanargmin(values))
        axes.plot(load[least], values[least], "o", color=ORANGE, ms=8, mfc="none", mew=2)
        if len(points) == 1:
            text = f"{values[least]:.3g} µm at {load[least]:g} N·m"
            side, shift = ("left", 10) if least < len(load) / 2 else ("right", -10)
            point = (load[least], values[least])
            axes.annotate(text, point, (shift, -5), textcoords="offset points", ha=side, color=ORANGE)
    highest = max(np.nanmax(one["transmission_error_peak_to_peak"]) for _, one in points)
    scene = scene_of(dataset)
    axes.set(xlabel=_torque(scene), ylabel=f"peak-to-peak {_symbol(scene)} [µm]", ylim=(0, 1.08 * highest))
    return axes


def _symbol(scene: Scene) -> str:
    """Symbol of the transmission error."""
    return "Δ" if scene.coupled else "δ"


def _torque(scene: Scene) -> str:
    """Label of the torque."""
    return f"torque on {scene.geometry.meshes[0].driver if scene.coupled else 'the pinion'} [N·m]"


def draw_sweep(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """Write the figures of a load range, for a train those of its own transmission error.

    If other keys are swept too, Harris map and orders show the first of their values, as the titles say.
    """
    names = {name: name.removeprefix("train_") for name in map(str, dataset) if name.startswith("train_transmission")}
    dataset = dataset.drop_vars(names.values(), errors="ignore").rename(names)
    if not (points := _points(dataset)):  # interrupted before the torques of one point were done
        return []
    label, curves = points[0]
    name, label = as_label(scene_of(dataset).name or "scene"), f"\n{label}" if label else ""
    load, ptp = dataset["torque"].values, curves["transmission_error_peak_to_peak"].values
    least = int(np.nanargmin(ptp))
    where = "at the lower end of" if least == 0 else "at the upper end of" if least == len(load) - 1 else "within"
    figure, ((axes, beside),) = new_figure(1, 2, (11.0, 5.0))
    harris_map(curves, axes)
    harris_map(curves, beside, about_mean=True)
    figure.suptitle(f"{name}: STE under {load[0]:g} to {load[-1]:g} N·m{label}")
    legend_below(figure, axes, CURVES)
    written = [write_figure(figure, folder / "harris_map.png")]
    figure, ((axes,),) = new_figure(1, 1, (7.5, 4.2))
    peak_to_peak_over_torque(dataset, axes)
    title = (
        "peak-to-peak STE, least values marked" if label else f"peak-to-peak STE is least {where} the range of torques"
    )
    axes.set_title(f"{name}\n{title}", fontsize=11)
    if label:
        legend_below(figure, axes, 2)
    written.append(write_figure(figure, folder / "peak_to_peak_over_torque.png"))
    figure, ((axes,),) = new_figure(1, 1, (7.5, 4.6))
    orders_over_torque(curves, axes)
    axes.set_title(f"{name}: mesh orders of STE over the torque{label}")
    legend_below(figure, axes, ORDERS)
    return [*written, write_figure(figure, folder / "orders_over_torque.png")]


def _points(dataset: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Points of the other swept keys that have results: their values as text, and the load range there."""
    others = [str(dim) for dim in dataset["transmission_error_peak_to_peak"].dims if dim != "torque"]
    labelled = []
    for place in np.ndindex(*(dataset.sizes[dim] for dim in others)):
        one = dataset.isel(dict(zip(others, place, strict=True)))
        units = {dim: dataset[dim].attrs["units"].replace("1", "") for dim in others}
        values = {dim: one[dim].item() for dim in others}
        texts = {dim: value if isinstance(value, str) else f"{value:g}" for dim, value in values.items()}
        label = ", ".join(f"{dim.removeprefix('effects.')} = {texts[dim]} {units[dim]}".strip() for dim in others)
        if one["transmission_error_peak_to_peak"].notnull().any():
            labelled.append((label, one))
    return labelled
