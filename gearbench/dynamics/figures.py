"""Pictures of a response: force over speed, orders over speed, Campbell diagram.

Every drawing function fills a figure and returns the main finding, which becomes the title.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.dynamics.drawing import hertz, legend, peak, rounded, speed_label, write, write_moving
from gearbench.dynamics.nonlinear import SWEEPS
from gearbench.dynamics.train_figures import draw_modes, draw_ring, draw_sharing
from gearbench.files import file_parts
from gearbench.lazy import xr

#: Modes with a smaller share in the compliance of a mesh are not drawn.
SHOWN = 0.01
#: Largest number of mode shapes in a figure.
PANELS = 6
#: Share of a mode's strain energy above which a part is named.
LEAST_SHARE = 0.05
#: Label of the lines of shafts at rest.
STILL = "at rest"
#: Number of frequency bins of a waterfall.
BINS = 500
#: Space for names in a Campbell diagram: width of the name of an order as a share of the speed range, height of the
#: name of a mode as a share of the axis.
ORDER_WIDTH, MODE_HEIGHT = 0.12, 0.03


def draw_response(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """Write plots of a response and return their files. The titles name the scene, the mesh and the main finding.

    One set for each mesh: ``force_…`` shows the dynamic factor and the RMS of mesh force and dynamic transmission error
    over speed; ``orders_…`` the amplitude of every order over speed; ``campbell_…`` orders and the modes they meet,
    coloured by the mesh force; ``waterfall_…`` the mesh force over frequency and speed; ``bearings_…`` the forces on
    the bearings and ``housing_…`` the motion of points of the housing over speed; ``bands_…`` mesh orders and their
    sidebands. One plot for all meshes: ``modes`` shows mode shapes of the shafts and energies of the parts, and as a
    GIF it moves; ``ripples`` the mesh forces that torque ripples cause, ``scatter`` the percentiles over error samples.
    For a train solved as one contact problem ``modes`` shows the bodies, ``sharing`` the load shares, ``ring`` the
    force waves round the ring; of the meshes only the one with the largest dynamic factor has figures.
    """
    if "percentile" in dataset.dims:
        write(_scatter, dataset, folder / "scatter.png")
        return [folder / "scatter.png"]
    per_mesh: tuple[tuple[str, Any], ...] = (("force", _force),)
    for_all: tuple[tuple[str, Any], ...] = ()
    if "order" in dataset.dims:
        per_mesh = (*per_mesh, ("bands", _bands))
    elif "sweep" not in dataset.dims and dataset.sizes["speed"] > 1:
        per_mesh = (*per_mesh, ("orders", _orders), ("campbell", _campbell), ("waterfall", _waterfall))
        per_mesh += (("bearings", _bearings),) if "bearing" in dataset.dims else ()
        per_mesh += (("housing", _housing),) if "point" in dataset.dims else ()
        for_all = (("modes", _modes),) if dataset.get("shaft_mode_shape", np.empty(0)).size else ()
        for_all += (("ripples", _ripples),) if "ripple" in dataset.dims else ()
    set_figures: list[tuple[str, Any, xr.Dataset]] = []
    if "mode_kind" in dataset:  # a train solved as one: figures of all meshes, then of the mesh with the largest factor
        for_set = [("modes", draw_modes)]
        if "sweep" not in dataset.dims:
            for_set += [("sharing", draw_sharing), ("bearings", _bearings)]
            for_set += [("ring", draw_ring)] if "lobes" in dataset.dims else []
        set_figures = [(name, draw, dataset) for name, draw in for_set]
        per_mesh = tuple((name, draw) for name, draw in per_mesh if name != "bearings")
        factor = dataset["dynamic_factor"].fillna(0.0)
        dataset = dataset.isel(mesh=[int(factor.max([dim for dim in factor.dims if dim != "mesh"]).argmax("mesh"))])
    meshes = file_parts([str(mesh) for mesh in dataset["mesh"].values])
    drawn = [(f"{name}_{mesh}", draw, dataset.isel(mesh=k)) for k, mesh in enumerate(meshes) for name, draw in per_mesh]
    written = []
    for name, draw, data in (*set_figures, *drawn, *((name, draw, dataset) for name, draw in for_all)):
        written.append(folder / f"{name}.png")
        write(draw, data, written[-1])
    if for_all and "shaft_mode_shape" in dataset:
        written.append(folder / "modes.gif")
        write_moving(_modes, dataset, written[-1], STILL)
    return written


def _force(figure: Any, data: xr.Dataset) -> str:
    """Dynamic factor, RMS of mesh force and RMS of transmission error over speed."""
    factors, forces = figure.subplots(2, sharex=True)
    speed, errors, finding = data["speed"].values, forces.twinx(), []
    for sweep in data["sweep"].values if "sweep" in data.dims else [None]:
        curve = data if sweep is None else data.sel(sweep=sweep)
        style, suffix = "--" if sweep == "down" else "-", "" if sweep is None else f", {SWEEPS[sweep]}"
        kept, factor = curve["contact_kept"].values, curve["dynamic_factor"].values
        factors.plot(speed, factor, style, color="C0", label=f"largest / mean mesh force{suffix}")
        if not kept.all():
            factors.plot(speed[~kept], factor[~kept], ".", color="C3", label=f"flanks separate{suffix}")
        forces.plot(speed, curve["mesh_force_rms"], style, color="C1", label=f"RMS of the mesh force{suffix}")
        rms = curve["dynamic_transmission_error_rms"]
        errors.plot(speed, rms, style, color="C2", linewidth=0.8, label=f"RMS of the transmission error{suffix}")
        largest_factor, speed_of_peak = peak(factor, speed)
        finding.append(f"dynamic factor up to {largest_factor:.3g} at {rounded(speed_of_peak, 5)} 1/min{suffix}")
    factors.set_ylabel("dynamic factor")
    forces.set(xlabel=speed_label(data), ylabel="mesh force [N]")
    errors.set_ylabel("transmission error [µm]")
    legend(figure, [*factors.get_lines(), *forces.get_lines(), *errors.get_lines()])
    return ";\n".join(finding)


def _orders(figure: Any, data: xr.Dataset) -> str:
    """Amplitude of the mesh force over speed, one curve for each of the eight largest orders."""
    axes = figure.subplots()
    largest_first = np.nan_to_num(data["mesh_force_amplitude"].values).max(axis=0).argsort(kind="stable")[::-1]
    for order in data["harmonic"].values[np.sort(largest_first[:8])]:
        axes.semilogy(data["speed"], data["mesh_force_amplitude"].sel(harmonic=order), label=f"order {order:.4g}")
    axes.set(xlabel=speed_label(data), ylabel="mesh force [N]")
    legend(figure, axes.get_lines())
    force = np.nan_to_num(data["mesh_force_amplitude"].values)
    order, (largest, speed) = (
        data["harmonic"].values[force.max(axis=0).argmax()],
        peak(force.max(axis=1), data["speed"].values),
    )
    return f"order {order:.4g} is the largest, {rounded(largest)} N at {rounded(speed, 5)} 1/min"


def _bearings(figure: Any, data: xr.Dataset) -> str:
    """RMS of the force on each bearing over speed, all orders and directions together."""
    squares = (data["bearing_force_amplitude"] ** 2).sum(["direction", "harmonic"], skipna=False)
    squares = squares.sum("mesh", skipna=False) if "mesh" in squares.dims else squares
    name, largest, speed = _rms_curves(figure, squares, "bearing", "RMS of the force on the bearing [N]")
    return f"largest on bearing {name}, {rounded(largest)} N at {rounded(speed, 5)} 1/min"


def _housing(figure: Any, data: xr.Dataset) -> str:
    """RMS at each point of the housing over speed, all orders together."""
    unit = data["housing_amplitude"].attrs["units"]
    squares = (data["housing_amplitude"] ** 2).sum("harmonic")
    name, largest, speed = _rms_curves(figure, squares, "point", f"RMS at the point [{unit}]")
    return f"largest at point {name}, {largest:.3g} {unit} at {rounded(speed, 5)} 1/min"


def _rms_curves(figure: Any, squares: xr.DataArray, dim: str, label: str) -> tuple[str, float, float]:
    """Draw one RMS curve over speed for each label along ``dim``; return the label of the highest, and its peak."""
    axes, peaks = figure.subplots(), {}
    for name in squares[dim].values:
        rms = np.sqrt(squares.sel({dim: name}).values / 2)
        axes.plot(squares["speed"], rms, label=str(name))
        peaks[str(name)] = peak(rms, squares["speed"].values)
    axes.set(xlabel=speed_label(squares), ylabel=label)
    legend(figure, axes.get_lines())
    name = max(peaks, key=lambda label: peaks[label])
    return name, *peaks[name]


def _ripples(figure: Any, data: xr.Dataset) -> str:
    """Mesh force that each torque ripple causes, over speed."""
    force = data["ripple_mesh_force_amplitude"]
    axes, meshes = figure.subplots(), data["mesh"].values
    for ripple in data["ripple"].values:
        for mesh in meshes:
            label = str(ripple) + (f", mesh {mesh}" if len(meshes) > 1 else "")
            axes.semilogy(data["speed"], force.sel(ripple=ripple, mesh=mesh), label=label)
    axes.set(xlabel=speed_label(data), ylabel="amplitude of the mesh force [N]")
    legend(figure, axes.get_lines())
    largest, speed = peak(force.max(["ripple", "mesh"]).values, data["speed"].values)
    return f"ripples cause mesh forces of up to {rounded(largest)} N, at {rounded(speed, 5)} 1/min"


def _modes(figure: Any, data: xr.Dataset) -> str:
    """Shapes of the shafts in the modes with the largest shares in the mesh compliance."""
    participation = data["mode_participation"].max("mesh").values
    chosen = np.sort(np.argsort(-participation)[:PANELS])
    figure.set_size_inches(11, 7)
    panels = figure.subplots(2, -(-len(chosen) // 2), squeeze=False, sharex=True).ravel()
    shafts = list(dict.fromkeys(data["shaft"].values))
    lines = []
    for axes, mode in zip(panels, chosen, strict=False):
        shape = data["shaft_mode_shape"].isel(mode=mode)
        for row, shaft in enumerate(shafts):
            stations = shape.isel(station=np.flatnonzero(data["shaft"].values == shaft))
            z, base = stations["shaft_position"].values, -2.2 * row
            axes.plot(z, np.full(len(z), base), color="0.6", linewidth=3, label=STILL)
            axes.annotate(str(shaft), (z[0], base + 1.02), fontsize="x-small", color="0.4")
            for number, component in enumerate(stations["component"].values):
                amplitude, colour = stations.sel(component=component).values, f"C{number}"
                lines += axes.plot(z, base + amplitude, color=colour, label=component)
                axes.fill_between(z, base - amplitude, base + amplitude, color=colour, alpha=0.12, linewidth=0)
        axes.set(yticks=[], ylim=(1.1 - 2.2 * len(shafts), 1.4))
        axes.set_title(_mode_name(data, int(mode)).replace(": ", "\n"), fontsize="small")
    for axes in panels[len(chosen) :]:
        axes.remove()
    for axes in panels[: len(chosen)][-(-len(panels) // 2) :]:
        axes.set_xlabel("position on the shaft [mm]")
    legend(figure, lines[: data.sizes["component"]], title="motion of the axis; twist as an arc on the base circle")
    return f"the {len(chosen)} modes with the largest share in mesh compliance, and their strain energy"


def _mode_name(data: xr.Dataset, mode: int) -> str:
    """Kind and frequency of a mode, and the parts with the most of its strain energy."""
    kind = data["mode_kind"].values[mode] if "mode_kind" in data else f"mode {mode + 1}"
    name = f"{kind}, {hertz(float(data['natural_frequency'][mode]))}"
    if "mode_energy" not in data:
        return name
    share, parts = data["mode_energy"].isel(mode=mode).values, data["part"].values
    most = [part for part in np.argsort(-share)[:2] if share[part] > LEAST_SHARE]
    return f"{name}: " + ", ".join(f"{100 * share[part]:.0f} % {parts[part]}" for part in most)


def _waterfall(figure: Any, data: xr.Dataset) -> str:
    """Mesh force over frequency and speed, with lines at the natural frequencies."""
    axes, force = figure.subplots(), np.nan_to_num(data["mesh_force_amplitude"].values)
    frequency = np.multiply.outer(data["mesh_frequency"].values, data["harmonic"].values)
    natural = data["natural_frequency"].values[data["mode_participation"].values > SHOWN]
    # the axis reaches the highest mode, and at least the first order
    edges = np.linspace(0.0, 1.1 * max(natural.max(initial=0.0), frequency[:, 0].max()), BINS + 1)
    level = np.zeros((len(force), BINS + 1))
    for row, order in np.ndindex(force.shape):
        # from the frequency at this speed to that at the next, so that lines have no gaps
        ends = np.searchsorted(edges, frequency[[row, min(row + 1, len(force) - 1)], order])
        bins = slice(min(ends) - 1, max(ends) + 1)
        level[row, bins] = np.maximum(level[row, bins], force[row, order])
    log_level = np.log10(np.maximum(level[:, :-1], max(force.max() * 1e-4, 1e-300)))  # colours span four decades
    image = axes.pcolormesh((edges[1:] + edges[:-1]) / 2, data["speed"], log_level, cmap="viridis", shading="nearest")
    figure.colorbar(image, ax=axes, label="log₁₀ of the mesh force [N]")
    for f in natural:
        axes.axvline(f, color="white", linewidth=0.6, linestyle=":")
    axes.set(xlabel="frequency [Hz]; dotted: natural frequencies", ylabel=speed_label(data))
    row, order = np.unravel_index(force.argmax(), force.shape)
    peak_position = f"{hertz(frequency[row, order])} and {rounded(float(data['speed'][row]), 5)} 1/min"
    return f"largest mesh force, {rounded(force.max())} N, at {peak_position}"


def _bands(figure: Any, data: xr.Dataset) -> str:
    """Mesh orders and their sidebands over speed, on a logarithmic scale."""
    axes = figure.subplots()
    force = data["mesh_force_amplitude"].values
    level = np.log10(np.maximum(force, max(force.max() * 1e-5, 1e-300)))  # colours span five decades
    image = axes.pcolormesh(data["order"], data["speed"], level, cmap="viridis", shading="nearest")
    figure.colorbar(image, ax=axes, label="log₁₀ of the mesh force [N]")
    axes.set(xlabel="order of the mesh frequency", ylabel=speed_label(data))
    order = float(data["order"].values[force.max(axis=0).argmax()])
    return f"orders and sidebands, the largest of order {order:.4g}"


def _scatter(figure: Any, data: xr.Dataset) -> str:
    """Percentiles of the mesh force over speed."""
    axes = figure.subplots()
    for k, percentile in enumerate(data["percentile"].values):
        values = data["mesh_force_percentile"].sel(percentile=percentile)
        axes.plot(data["speed"], values, color=f"C{k}", label=f"{percentile:g} %")
    axes.set(xlabel=speed_label(data), ylabel="RMS of the mesh force [N]")
    legend(figure, axes.get_lines(), title="share of the samples with a lower RMS")
    largest, speed = peak(data["mesh_force_percentile"].sel(percentile=95.0).values, data["speed"].values)
    return f"95th percentile of the RMS up to {rounded(largest)} N, at {rounded(speed, 5)} 1/min"


def _campbell(figure: Any, data: xr.Dataset) -> str:
    """Campbell diagram: frequencies of the orders over speed, coloured by the mesh force, and natural frequencies."""
    axes = figure.subplots()
    speed, frequency = data["speed"].values, data["mesh_frequency"].values
    force = data["mesh_force_amplitude"].values
    floor = max(np.nanmax(force, initial=0.0) * 1e-4, 1e-300)  # colours span four decades
    orders = data["harmonic"].values
    coupled = np.flatnonzero(data["mode_participation"].values > SHOWN)
    natural = data["natural_frequency"].values[coupled]
    # the axis reaches the highest mode, and at least the first order
    top = 1.1 * max(natural.max(initial=0.0), frequency.max())
    frequencies = np.multiply.outer(frequency, orders)
    inside = frequencies <= top
    dots = axes.scatter(
        np.broadcast_to(speed[:, None], frequencies.shape)[inside],
        frequencies[inside],
        c=np.log10(np.maximum(np.nan_to_num(force), floor))[inside],
        s=4,
        cmap="viridis",
    )
    figure.colorbar(dots, ax=axes, label="log₁₀ of the mesh force [N]")
    axes.hlines(natural, *speed[[0, -1]], color="C3", linewidth=0.8)
    names, free = [_mode_name(data, int(mode)) for mode in coupled], 0.0
    for name, count in Counter(names).items():
        position = max(natural[names.index(name)], free)  # a name that would overlap the one below moves up
        free = position + MODE_HEIGHT * top
        text = name if count == 1 else f"{count} × {name}"
        label = axes.annotate(text, (speed.min(), position), fontsize="x-small", color="C3", va="bottom")
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0})
    free = np.inf
    for n in orders:
        position = int(np.flatnonzero(n * frequency <= top)[-1]) if n * frequency.min() <= top else None
        # skip a name that would overlap the one before
        if position is not None and speed[position] < free:
            free = speed[position] - ORDER_WIDTH * np.ptp(speed) if n * frequency.max() > top else np.inf
            end = speed[position], n * frequency[position]
            axes.annotate(f"order {n:.4g}", end, fontsize="x-small", ha="right", va="bottom")
    axes.set(xlabel=speed_label(data), ylabel="frequency [Hz]", ylim=(0, top))
    return f"{len(natural)} modes that the mesh excites, and the orders that meet them"
