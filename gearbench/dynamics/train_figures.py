"""Pictures of the response of a planetary set: mode shapes, load sharing over speed, sidebands at the ring."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gearbench.dynamics.drawing import hertz, legend, peak, rounded, speed_label
from gearbench.lazy import xr
from gearbench.results.origin import scene_of

#: Maximum number of modes drawn, and modes in a row.
DRAWN, ROW = 8, 4
#: Modes of one kind whose frequencies differ by less than this share are one shape in two directions; one is drawn.
TWIN = 0.02
#: Largest drawn motion as a share of the radius of the smallest gear.
DRAWN_MOTION = 0.45
#: Number of mesh orders whose sidebands are drawn.
PANELS = 3
#: Lower end of the axis of amplitudes as a share of its upper end.
FAINT = 1e-4


def draw_modes(figure: Any, dataset: xr.Dataset) -> str:
    """Draw the members in place (dashed) and as each mode moves them; a spoke shows their rotation.

    Return the frequency up to which there are modes, for the title.
    """
    scene, kinds = scene_of(dataset), dataset["mode_kind"].values
    assert scene.train is not None
    linkage, f = scene.train.linkage(scene.geometry), dataset["natural_frequency"].values
    train = linkage.train
    radius = linkage.radii
    size = DRAWN_MOTION * min(radius.values())
    is_twin = [any(kinds[i] == kinds[k] and f[k] - f[i] < TWIN * f[k] for i in range(k)) for k in range(len(f))]
    shown = np.flatnonzero(~np.array(is_twin, dtype=bool))[:DRAWN]
    count = max(len(shown), 1)
    figure.set_size_inches(2.9 * min(count, ROW), 3.2 * math.ceil(count / ROW) + 0.4)
    grid = figure.subplots(math.ceil(count / ROW), min(count, ROW), squeeze=False, sharex=True, sharey=True)
    grid[0, 0].invert_yaxis()  # y points down, see geometry/train.py
    for axes in grid.flat:
        axes.set_axis_off()
    around = np.linspace(0, 2 * np.pi, 121)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    for axes, k in zip(grid.flat, shown, strict=False):
        for name in linkage.bodies:
            # the dimension ``bearing`` holds the members
            x, y, arc = size * dataset["mode_shape"].isel(mode=k).sel(bearing=name).values
            r = radius[name]
            if name == linkage.carrier:
                pins = np.array([train.places[pin] for pin in linkage.carried])
                curve, centre = np.vstack([pins, pins[:1]]), np.zeros(2)
            else:
                centre = train.places[train.shaft(name)]
                curve = centre + r * circle
            turn = arc / r
            rotation = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
            axes.plot(*curve.T, color="0.75", linewidth=0.7, linestyle="--")
            colour = {"carrier": "C2", "ring": "0.3", "sun": "C1"}.get(name, "C0")
            axes.plot(*((curve - centre) @ rotation + centre + (x, y)).T, color=colour, linewidth=1.3)
            spoke = np.array([[0.0, 0.0], [0.0, -r]]) @ rotation + centre + (x, y)
            axes.plot(*spoke.T, color=colour, linewidth=0.9)
        axes.set_aspect("equal")
        axes.set_title(f"{hertz(float(f[k]))}, {kinds[k]}", fontsize="small")
    return f"modes up to {hertz(float(f.max()))}" if len(f) else "no mode is excited"


def draw_sharing(figure: Any, dataset: xr.Dataset) -> str:
    """Draw over speed: largest mesh force relative to its even share, all mesh forces, transmission error.

    Return the largest share and its speed, for the title.
    """
    top, middle, bottom = figure.subplots(3, sharex=True)
    speed, factor = dataset["speed"].values, dataset["mesh_load_factor"].values
    top.plot(speed, factor, color="0.2")
    separated = ~dataset["contact_kept"].values.all(axis=1)
    if separated.any():
        top.plot(speed[separated], factor[separated], ".", color="C3", label="flanks separate")
        top.legend(fontsize="small", frameon=False)
    for number, name in enumerate(dataset["mesh"].values):
        style = "-" if 2 * number < dataset.sizes["mesh"] else "--"  # meshes at sun, then at ring
        middle.plot(speed, dataset["mesh_force_rms"].sel(mesh=name), style, linewidth=1.0, label=str(name))
    bottom.plot(speed, dataset["train_dynamic_transmission_error_rms"], color="0.2")
    top.set_ylabel("K_γ K_v")
    middle.set_ylabel("RMS F_bt [N]")
    bottom.set(xlabel=speed_label(dataset), ylabel="RMS Δ [µm]")
    legend(figure, middle.get_lines())
    most, at_speed = peak(factor, speed)
    return f"the most loaded mesh carries {most:.3g} times its even share at {rounded(at_speed, 5)} 1/min"


def draw_ring(figure: Any, dataset: xr.Dataset) -> str:
    """Draw the sidebands of the first mesh orders at a point of the ring, at the speed where they are largest.

    Return this speed, for the title.
    """
    train, wave = scene_of(dataset).geometry, dataset["ring_wave_amplitude"]
    # orders count periods of the first mesh; with stepped planets the meshes at the ring have another frequency
    ratio = train.periods[train.meshes[-1].name] / train.periods[train.meshes[0].name]
    first = ratio * np.arange(1, 1 + min(PANELS, int(wave["harmonic"].max() / ratio)))
    wave = wave.sel(harmonic=first, method="nearest")
    index = int(np.argmax(wave.max(["harmonic", "lobes"]).fillna(0.0).values))
    amplitude, f = wave.isel(speed=index), dataset["ring_wave_frequency"].isel(speed=index)
    lobes, top = dataset["lobes"].values, 2.0 * float(amplitude.max())
    grid = figure.subplots(amplitude.sizes["harmonic"], sharex=True, squeeze=False)[:, 0]
    for axes, order in zip(grid, amplitude["harmonic"], strict=True):
        for words, which, colour in (
            ("torsion", lobes == 0, "C0"),
            ("radial force", np.abs(lobes) == 1, "C1"),
            ("bends the ring", np.abs(lobes) > 1, "0.6"),
        ):
            axes.bar(lobes[which], amplitude.sel(harmonic=order).values[which], color=colour, label=words)
        axes.set(yscale="log", ylim=(FAINT * top, top), ylabel="force [N]")
        title = f"order {float(order):.4g}, {hertz(float(f.sel(harmonic=order, lobes=0)))}"
        axes.set_title(title, loc="left", fontsize="small")
    last = grid[-1]
    last.set(
        xlabel="sideband k at n f_z + k f_c: |k| lobes that overtake the planets (k > 0) or fall behind them (k < 0)"
    )
    last.set_xticks(lobes)
    legend(figure, last.get_legend_handles_labels()[0])
    return f"force waves at the ring at {rounded(float(dataset['speed'][index]), 5)} 1/min"
