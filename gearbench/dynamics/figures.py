"""Pictures of a response: force over speed, orders over speed, Campbell diagram."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.dynamics.drawing import legend, peak, write
from gearbench.dynamics.train_figures import draw_modes, draw_ring, draw_sharing
from gearbench.files import file_parts

if TYPE_CHECKING:
    import xarray as xr

#: Modes with a smaller share in the compliance of a mesh are not drawn.
SHOWN = 0.01


def draw_response(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """PNG plots of a response, one set for each mesh; their titles name the scene, the mesh and what is found.

    ``force_…`` the dynamic factor, the RMS of the mesh force and of the dynamic transmission error over speed,
    ``orders_…`` the amplitude of every order over speed, ``campbell_…`` orders and the modes they meet over speed,
    coloured by the mesh force, ``bearings_…`` the forces on the bearings over speed; ``bands_…`` the orders of a
    revolution; ``scatter`` the percentiles over error samples.
    """
    if "percentile" in dataset.dims:
        write(_scatter, dataset, folder / "scatter.png")
        return [folder / "scatter.png"]
    kinds: tuple[tuple[str, Any], ...] = (("force", _force),)
    if "order" in dataset.dims:
        kinds = (*kinds, ("bands", _bands))
    elif "sweep" not in dataset.dims and dataset.sizes["speed"] > 1:
        kinds = (*kinds, ("orders", _orders), ("campbell", _campbell))
        if "bearing" in dataset.dims:
            kinds = (*kinds, ("bearings", _bearings))
    written = []
    if "mode_kind" in dataset:  # one set for all meshes, and the mesh that carries most
        of_set = [("modes", draw_modes), ("sharing", draw_sharing), ("bearings", _bearings)]
        of_set += [("ring", draw_ring)] if "lobes" in dataset.dims else []
        for name, draw in of_set:
            written.append(folder / f"{name}.png")
            write(draw, dataset, written[-1])
        kinds = tuple(each for each in kinds if each[0] != "bearings")
        dataset = dataset.isel(mesh=[int(np.argmax(dataset["dynamic_factor"].max("speed").fillna(0.0).values))])
    meshes = file_parts([str(mesh) for mesh in dataset["mesh"].values])
    for number, mesh in enumerate(meshes):
        one = dataset.isel(mesh=number)
        for name, draw in kinds:
            path = folder / f"{name}_{mesh}.png"
            write(draw, one, path)
            written.append(path)
    return written


def _force(figure: Any, one: xr.Dataset) -> str:
    factors, others = figure.subplots(2, sharex=True)
    speed, errors, finding = one["speed"].values, others.twinx(), []
    for sweep in one["sweep"].values if "sweep" in one.dims else [None]:
        here = one if sweep is None else one.sel(sweep=sweep)
        style, of = ("--", ", falling") if sweep == "down" else ("-", "" if sweep is None else ", rising")
        kept, factor = here["contact_kept"].values, here["dynamic_factor"].values
        factors.plot(speed, factor, style, color="C0", label=f"largest mesh force over mean{of}")
        if not kept.all():
            factors.plot(speed[~kept], factor[~kept], ".", color="C3", label=f"flanks part{of}")
        others.plot(speed, here["mesh_force_rms"], style, color="C1", label=f"RMS of the mesh force{of}")
        rms = here["dynamic_transmission_error_rms"]
        errors.plot(speed, rms, style, color="C2", linewidth=0.8, label=f"RMS of the transmission error{of}")
        largest, at = peak(factor, speed)
        finding.append(f"dynamic factor up to {largest:.3g} at {at:.4g} 1/min{of}")
    factors.set_ylabel("dynamic factor")
    others.set(xlabel="speed of the pinion [1/min]", ylabel="mesh force [N]")
    errors.set_ylabel("transmission error [µm]")
    legend(figure, [*factors.get_lines(), *others.get_lines(), *errors.get_lines()])
    return ";\n".join(finding)


def _orders(figure: Any, one: xr.Dataset) -> str:
    """One curve for each order."""
    axes = figure.subplots()
    for order in one["harmonic"].values[:8]:
        axes.semilogy(one["speed"], one["mesh_force_amplitude"].sel(harmonic=order), label=f"order {order}")
    axes.set(xlabel="speed of the pinion [1/min]", ylabel="mesh force [N]")
    legend(figure, axes.get_lines())
    force = np.nan_to_num(one["mesh_force_amplitude"].values)
    order, (largest, at) = (
        one["harmonic"].values[force.max(axis=0).argmax()],
        peak(force.max(axis=1), one["speed"].values),
    )
    return f"order {order} is the largest, {largest:.3g} N at {at:.4g} 1/min"


def _bearings(figure: Any, one: xr.Dataset) -> str:
    """RMS of all orders and directions of each bearing."""
    axes, found = figure.subplots(), {}
    for name in one["bearing"].values:
        squares = (one["bearing_force_amplitude"].sel(bearing=name) ** 2).sum(["direction", "harmonic"], skipna=False)
        squares = squares.sum("mesh", skipna=False) if "mesh" in squares.dims else squares
        rms = np.sqrt(squares.values / 2)
        axes.plot(one["speed"], rms, label=str(name))
        found[name] = peak(rms, one["speed"].values)
    axes.set(xlabel="speed of the pinion [1/min]", ylabel="RMS of the force on the bearing [N]")
    legend(figure, axes.get_lines())
    name = max(found, key=lambda each: found[each])
    return f"bearing {name} feels the most, {found[name][0]:.3g} N at {found[name][1]:.4g} 1/min"


def _bands(figure: Any, one: xr.Dataset) -> str:
    """Mesh orders and their side bands over speed, in decades below the largest."""
    axes = figure.subplots()
    force = one["mesh_force_amplitude"].values
    level = np.log10(np.maximum(force, max(force.max() * 1e-5, 1e-300)))
    shown = axes.pcolormesh(one["order"], one["speed"], level, cmap="viridis", shading="nearest")
    figure.colorbar(shown, ax=axes, label="log₁₀ of the mesh force [N]")
    axes.set(xlabel="order of the mesh frequency", ylabel="speed of the pinion [1/min]")
    order = float(one["order"].values[force.max(axis=0).argmax()])
    return f"orders and side bands, the largest of order {order:.4g}"


def _scatter(figure: Any, one: xr.Dataset) -> str:
    axes = figure.subplots()
    for k, percentile in enumerate(one["percentile"].values):
        values = one["mesh_force_percentile"].sel(percentile=percentile)
        axes.plot(one["speed"], values, color=f"C{k}", label=f"{percentile:g} %")
    axes.set(xlabel="speed of the pinion [1/min]", ylabel="RMS of the mesh force [N]")
    legend(figure, axes.get_lines(), title="of the samples below")
    largest, at = peak(one["mesh_force_percentile"].sel(percentile=95.0).values, one["speed"].values)
    return f"95 % of the samples stay below {largest:.3g} N, reached at {at:.4g} 1/min"


def _campbell(figure: Any, one: xr.Dataset) -> str:
    axes = figure.subplots()
    speed, frequency = one["speed"].values, one["mesh_frequency"].values
    force = one["mesh_force_amplitude"].values
    floor = max(np.nanmax(force, initial=0.0) * 1e-4, 1e-300)
    orders = one["harmonic"].values
    felt = one["mode_participation"].values > SHOWN
    natural = one["natural_frequency"].values[felt]
    names = one["mode_kind"].values[felt] if "mode_kind" in one else [f"mode {k + 1}" for k in range(len(natural))]
    # to what has modes, and the first order
    top = 1.1 * max(natural.max(initial=0.0), frequency.max())
    rows = np.multiply.outer(frequency, orders)
    inside = rows <= top
    dots = axes.scatter(
        np.broadcast_to(speed[:, None], rows.shape)[inside],
        rows[inside],
        c=np.log10(np.maximum(np.nan_to_num(force), floor))[inside],
        s=4,
        cmap="viridis",
    )
    figure.colorbar(dots, ax=axes, label="log₁₀ of the mesh force [N]")
    for k, f in enumerate(natural):
        axes.axhline(f, color="C3", linewidth=0.8)
        axes.annotate(
            f"{names[k]}, {f:.4g} Hz", (speed.max(), f), fontsize="x-small", color="C3", ha="right", va="bottom"
        )
    for n in orders:
        at = int(np.flatnonzero(n * frequency <= top)[-1]) if n * frequency.min() <= top else None
        if at is not None:
            axes.annotate(f"{n}", (speed[at], n * frequency[at]), fontsize="x-small", ha="right", va="bottom")
    axes.set(xlabel="speed of the pinion [1/min]", ylabel="frequency [Hz]", ylim=(0, top))
    return f"{len(natural)} modes that the mesh feels, and the orders that meet them"
