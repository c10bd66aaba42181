"""Figures of a train: gears with their load shares, curves over the mesh cycle, harmonics of the force on a member."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.train import Train
from gearbench.lazy import Axes, xr
from gearbench.plotting import BLUE, GREY, ORANGE, heading, legend_below, new_figure, plot_two_periods, write_figure
from gearbench.results.cycle import Phases
from gearbench.results.origin import scene_of

#: Number of points on each flank of a drawn tooth.
POINTS = 8


def outline(train: Train, gear: str, phases: dict[str, float], *, coast: bool) -> NDArray:
    """Outline of a gear in its position at phase 0 of the first mesh, (point, 2) [mm]."""
    mesh = next(mesh for mesh in train.meshes if gear in mesh.gears)
    body = mesh.pair.gears[mesh.gears.index(gear)]
    sense = train.turn(mesh.name) * (-1 if coast else 1)
    if gear == mesh.driven and mesh.pair.gears[0].teeth * body.teeth > 0:
        sense = -sense
    z = abs(body.teeth)
    centre = train.middle(mesh.name, gear, phases[mesh.name], coast=coast)
    R = np.linspace(body.root_radius, body.tip_radius, POINTS)
    psi = np.abs(body.half_angle(R))
    tooth = np.concatenate([-psi, psi[::-1]])
    angle = sense * 2 * math.pi * (centre + np.arange(z)) / z
    angle, R = (angle[:, None] + np.sign(sense) * tooth).ravel(), np.abs(np.tile(np.concatenate([R, R[::-1]]), z))
    return train.places[train.shaft(gear)] + R[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def load_shares(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Draw the gears of a train at mesh phase 0, with the largest load share of each mesh."""
    scene = scene_of(dataset)
    train, coast = scene.geometry, scene.load.coast
    phases = train.phases(coast=coast)
    for gear in train.gears:
        points = outline(train, gear, phases, coast=coast)
        axes.fill(*points.T, facecolor="none" if is_internal(train, gear) else "0.93", edgecolor=GREY, lw=0.7)
        inside = is_internal(train, gear)
        x, y = train.places[train.shaft(gear)] + np.array([0.0, points[:, 1].max() if inside else 0.0])
        if gear not in train.timed:  # the second gear of a stepped planet
            axes.annotate(gear, (x, y), ha="center", va="top" if inside else "center", fontsize=8)
    over = "load_sharing_over_revolution"
    most = dataset[over].max("revolution") if over in dataset else dataset["load_sharing"].max("position")
    for mesh in train.meshes:
        share = float(most.sel(mesh=mesh.name))
        x, y = train.pitch_point(mesh.name)
        axes.scatter(x, y, s=90 * share**2, color=ORANGE, alpha=0.7, zorder=3)
        axes.annotate(f"{share:.2f}", (x, y), xytext=(6, 6), textcoords="offset points", fontsize=8, color=ORANGE)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.invert_yaxis()  # viewed along the shafts: y points down
    return axes


def is_internal(train: Train, gear: str) -> bool:
    """Whether a gear of a train is internal."""
    mesh = next(mesh for mesh in train.meshes if gear in mesh.gears)
    return mesh.pair.gears[mesh.gears.index(gear)].teeth < 0


def draw_train(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """Write the figures of a train: gears with their load shares, and curves and harmonics of the mesh cycle."""
    figure, ((axes,),) = new_figure(1, 1, (7.0, 7.0))
    load_shares(dataset, axes)
    factor = float(dataset["mesh_load_factor"])
    axes.set_title(f"{heading(dataset)}\ngreatest load share of each mesh; K_γ {factor:.3f}")
    written = [write_figure(figure, folder / "load_shares.png")]

    figure, rows = new_figure(2, 2, (11.0, 7.5))
    (shares, error), (forces, orders) = rows
    phase = {
        "xlabel": "phase of the first mesh τ [mesh periods]",
        "xlim": (0, max(2, Phases.of_dataset(dataset).length)),
    }
    for number, name in enumerate(dataset["mesh"].values.tolist()):
        of_mesh = dataset.sel(mesh=name)
        # equal curves cover each other: later ones are dashed
        style = "-" if 2 * number < dataset.sizes["mesh"] else (0, (3, 3))
        plot_two_periods(shares, of_mesh, "load_sharing", label=name, color=f"C{number % 10}", lw=1.6, ls=style)
    shares.set(ylabel="load share L [–]", **phase)
    least, most = min(1.0, float(dataset["load_sharing"].min())), max(1.0, float(dataset["load_sharing"].max()))
    margin = max(0.02, 0.15 * (most - least))
    shares.set_ylim(least - margin, most + margin)
    plot_two_periods(error, dataset, "train_transmission_error", color=BLUE, lw=1.6)
    error.set(ylabel="Δ [µm]", **phase)
    error.set_title(
        f"transmission error of the train: {float(dataset['train_transmission_error_mean']):.3g} µm, "
        f"peak-to-peak {float(dataset['train_transmission_error_peak_to_peak']):.3g} µm",
        fontsize=9,
    )
    if "revolution" in dataset.dims:
        shares.clear()
        for name in dataset["mesh"].values.tolist():
            shares.plot(
                dataset["revolution"], dataset["load_sharing_over_revolution"].sel(mesh=name), lw=1.3, label=name
            )
        shares.set(xlabel="carrier relative to the ring [revolutions]", ylabel="greatest load share L [–]", xlim=(0, 1))
        shares.set_ylim(0.0, 1.1 * float(dataset["mesh_load_factor"]))
    n, first = dataset["harmonic"].values, dataset["member"].values[0]
    order = "mesh order" if n.dtype.kind == "i" else "order of the first mesh"
    amplitude = dataset["member_force_amplitude"].sel(member=first)
    width = 0.4 * max(0.1, np.diff(n).min())
    for axis, shift, colour in (("x", -0.5, BLUE), ("y", 0.5, ORANGE)):
        forces.bar(n + shift * width, amplitude.sel(axis=axis), width=width, color=colour, label=axis)
    forces.set(xlabel=order, ylabel=f"force on {first}, F_n [N]")
    if float(amplitude.max()) < 1e-6 * float(dataset["mesh_load"].max()):  # only rounding errors remain
        forces.clear()
        plot_two_periods(forces, dataset, "train_stiffness", color=BLUE, lw=1.6)
        forces.set(ylabel="k [N/µm]", **phase)
        forces.set_title(f"stiffness of the train; forces on {first} cancel at all mesh orders", fontsize=9)
    else:
        forces.set_ylim(0.0, 1.1 * float(amplitude.max()))
        forces.legend(frameon=False, fontsize=8)
    orders.bar(n, dataset["train_transmission_error_amplitude"], width=2 * width, color=BLUE)
    orders.set(xlabel=order, ylabel="|Δ_n| [µm]")
    figure.suptitle(f"{heading(dataset)}; K_γ {factor:.3f}", fontsize=10)
    legend_below(figure, shares, 4)
    return [*written, write_figure(figure, folder / "train.png")]
