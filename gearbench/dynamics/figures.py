"""Pictures of a response: force over speed, orders over speed, Campbell diagram."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.files import file_parts, replacing

if TYPE_CHECKING:
    import xarray as xr

#: Modes with a smaller share in the compliance of a mesh are not drawn.
SHOWN = 0.01


def draw_response(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """PNG plots of a response, one set for each mesh.

    ``force_…`` the dynamic factor and the RMS of the mesh force over speed, ``orders_…`` the amplitude of every order
    over speed, ``campbell_…`` orders and natural frequencies over speed, coloured by the mesh force; ``bands_…`` the
    orders of a revolution; ``scatter`` the percentiles over error samples.
    """
    if "percentile" in dataset.dims:
        _figure(_scatter, dataset, folder / "scatter.png")
        return [folder / "scatter.png"]
    kinds: tuple[tuple[str, Any], ...] = (("force", _force),)
    if "order" in dataset.dims:
        kinds = (*kinds, ("bands", _bands))
    elif "sweep" not in dataset.dims and dataset.sizes["speed"] > 1:
        kinds = (*kinds, ("orders", _orders), ("campbell", _campbell))
    written = []
    meshes = file_parts([str(mesh) for mesh in dataset["mesh"].values])
    for number, mesh in enumerate(meshes):
        one = dataset.isel(mesh=number)
        for name, draw in kinds:
            path = folder / f"{name}_{mesh}.png"
            _figure(draw, one, path)
            written.append(path)
    return written


def _figure(draw: Any, one: xr.Dataset, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.8), layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure, one)
    with replacing(path) as part:
        figure.savefig(part, dpi=120, format="png")


def _force(figure: Any, one: xr.Dataset) -> None:
    axes = figure.subplots()
    speed, other = one["speed"], axes.twinx()
    for sweep in one["sweep"].values if "sweep" in one.dims else [None]:
        here = one if sweep is None else one.sel(sweep=sweep)
        style, of = ("--", ", speed falling") if sweep == "down" else ("-", "" if sweep is None else ", speed rising")
        kept = here["contact_kept"].values
        axes.plot(speed, here["dynamic_factor"], style, color="C0", label=f"largest mesh force over mean{of}")
        if not kept.all():
            axes.plot(speed[~kept], here["dynamic_factor"].values[~kept], ".", color="C3", label=f"flanks part{of}")
        other.plot(speed, here["mesh_force_rms"], style, color="C1", linewidth=0.8, label=f"RMS of the mesh force{of}")
    axes.set(xlabel="speed of the pinion [1/min]", ylabel="dynamic factor", title="Mesh force over speed")
    other.set_ylabel("RMS of the mesh force [N]")
    lines = [*axes.get_lines(), *other.get_lines()]
    axes.legend(lines, [str(line.get_label()) for line in lines])


def _orders(figure: Any, one: xr.Dataset) -> None:
    """Waterfall: one curve for each order, the RMS of all of them above."""
    axes = figure.subplots()
    for order in one["harmonic"].values[:8]:
        axes.semilogy(one["speed"], one["mesh_force_amplitude"].sel(harmonic=order), label=f"order {order}")
    axes.set(xlabel="speed of the pinion [1/min]", ylabel="mesh force [N]", title="Orders of the mesh frequency")
    axes.legend(ncols=4, fontsize="small")


def _bands(figure: Any, one: xr.Dataset) -> None:
    """Mesh orders and their side bands over speed, in decades below the largest."""
    axes = figure.subplots()
    force = one["mesh_force_amplitude"].values
    level = np.log10(np.maximum(force, max(force.max() * 1e-5, 1e-300)))
    shown = axes.pcolormesh(one["order"], one["speed"], level, cmap="viridis", shading="nearest")
    figure.colorbar(shown, ax=axes, label="log₁₀ of the mesh force [N]")
    axes.set(xlabel="order of the mesh frequency", ylabel="speed of the pinion [1/min]", title="Orders and side bands")


def _scatter(figure: Any, one: xr.Dataset) -> None:
    axes = figure.subplots()
    for k, percentile in enumerate(one["percentile"].values):
        values = one["mesh_force_percentile"].sel(percentile=percentile)
        axes.plot(one["speed"], values, color=f"C{k}", label=f"{percentile:g} %")
    axes.set(
        xlabel="speed of the pinion [1/min]", ylabel="RMS of the mesh force [N]", title="Scatter of the mesh force"
    )
    axes.legend(title="of the samples below")


def _campbell(figure: Any, one: xr.Dataset) -> None:
    axes = figure.subplots()
    speed, frequency = one["speed"].values, one["mesh_frequency"].values
    force = one["mesh_force_amplitude"].values
    floor = max(np.nanmax(force, initial=0.0) * 1e-4, 1e-300)
    orders = one["harmonic"].values
    dots = axes.scatter(
        np.repeat(speed, len(orders)),
        np.multiply.outer(frequency, orders),
        c=np.log10(np.maximum(np.nan_to_num(force), floor)),
        s=4,
        cmap="viridis",
    )
    figure.colorbar(dots, ax=axes, label="log₁₀ of the mesh force [N]")
    natural = one["natural_frequency"].values[one["mode_participation"].values > SHOWN]
    for f in natural:
        axes.axhline(f, color="C3", linewidth=0.8)
    axes.set(xlabel="speed of the pinion [1/min]", ylabel="frequency [Hz]", title="Campbell diagram")
