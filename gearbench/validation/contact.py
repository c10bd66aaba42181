"""Comparison of three models of a scene: fast model, finite elements on contact lines, contact finite elements.

Contact finite elements assume neither contact lines nor a fast compliance. The error of the fast model therefore has
two parts: the compliance of teeth and bodies (fast model minus finite elements on lines), and where and how the flanks
touch (finite elements on lines minus contact finite elements).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.coarse_solution import scene_lines
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.teeth import require_bores
from gearbench.errors import InputError, naming
from gearbench.geometry.pair import Pair
from gearbench.lazy import xr
from gearbench.plotting import BLUE, GREEN, GREY, ORANGE, new_figure, write_figure
from gearbench.results.cycle import MeshCycle
from gearbench.results.netcdf import save
from gearbench.results.provenance import provenance
from gearbench.results.responses import described
from gearbench.scene import Resolution, Scene
from gearbench.solution import solve_lines
from gearbench.validation.reference import reference_scene

#: Models with their labels; "off_line" only if the scene itself keeps contact on the line of action.
MODELS = {
    "fast": "fast model",
    "off_line": "fast model with off_line_contact",
    "lines": "finite elements on lines",
    "contact": "contact finite elements",
}
#: Relative accuracy of the finite elements on lines.
ACCURACY = 0.002
#: Minimum number of segments on a contact line.
_SEGMENTS = 60
#: Line style and colour of the curves.
_STYLES = {"fast": ("--", ORANGE), "off_line": ("-.", GREEN), "lines": ("-", BLUE), "contact": ("o", "black")}
#: Files of a report.
DATASET, PICTURE = "contact.nc", "contact.png"


def check(scene: Scene, source: str = "") -> None:
    """Refuse a scene that cannot be compared, before anything is computed.

    Raises
    ------
    InputError
        If the scene lacks bores, gear body or contact law, or already uses finite elements.
    """
    with naming(source):
        require_bores(scene.one_load.pair)
        for name in ("gear_body", "hertz"):
            if scene.effect(name) is None:
                raise InputError("effects", f"no {name}", "is part of contact finite elements: add it")
        reference_scene(scene, ACCURACY)


def compare_contact(scene: Scene, phases: int, report: Callable[[str], None] = lambda _: None) -> xr.Dataset:
    """Compute the mesh cycle of a scene with three models at the same phases.

    A scene with contact on the line of action gets a fourth model, with ``off_line_contact``. The contact finite
    elements have the finite face width, also for spur pairs (``fem_reference.contact.spatial``), and are solved at
    uniform phases of the wheel, ``mesh_phase``. Under load, the phases of pinion and wheel differ; the other models are
    computed half-way between them (``fem_reference.contact.cycle.halfway``).

    Returns
    -------
    Dataset with ``transmission_error`` [µm] and ``mesh_stiffness`` [N/µm] (model, position); the error bar
    ``transmission_error_uncertainty`` of the contact finite elements [µm]; ``share_outside_path`` (position), the share
    of the load that contact finite elements carry outside the path of contact; and ``residual`` (model), the RMS
    difference of a model's transmission error from that of contact finite elements, over their mean.
    """
    from fem_reference.contact.cycle import contact_cycle, halfway
    from fem_reference.contact.laying import Fineness
    from fem_reference.contact.spatial import SpatialSettings

    resolution = Resolution(positions=phases, segments=max(scene.resolution.segments, _SEGMENTS))
    alike = replace(scene, resolution=resolution)
    ways = {"fast": alike, "lines": reference_scene(alike, ACCURACY)}
    if scene.effect(OffLineContact.name) is None:
        ways["off_line"] = replace(alike, effects=(*alike.effects, OffLineContact()))
    start = time.perf_counter()
    settings = SpatialSettings(fineness=Fineness().coarser())
    exact = contact_cycle(alike, phases, settings=settings, report=lambda at: report(f"contact finite elements, {at}"))
    at, curves = halfway(exact, scene.pair), {}
    for name in (name for name in MODELS if name in ways):
        report(MODELS[name])
        cycle = model_cycle(ways[name], at)
        curves[name] = cycle.transmission_error, cycle.mesh_stiffness
    curves["contact"] = exact.transmission_error.values, exact.mesh_stiffness.values
    ste, k = (np.stack(each) for each in zip(*curves.values(), strict=True))
    grid = ("model", "position")
    variables = {
        "transmission_error": (grid, ste),
        "mesh_stiffness": (grid, k),
        "transmission_error_uncertainty": ((), float(exact.transmission_error_uncertainty)),
        "share_outside_path": (("position",), _outside_path(exact, scene.pair)),
        "residual": (("model",), np.sqrt(((ste - ste[-1]) ** 2).mean(axis=1)) / ste[-1].mean()),
    }
    coords = {"mesh_phase": ("position", exact.mesh_phase.values), "model": ("model", list(curves))}
    attrs = {
        **provenance(scene, wall_time=time.perf_counter() - start),
        "name": scene.name, "method": exact.attrs["method"],
    }  # fmt: skip
    return xr.Dataset(described(variables), coords=described(coords), attrs=attrs)


def model_cycle(scene: Scene, phases: NDArray) -> MeshCycle:
    """Solve a model with contact on lines at any mesh phases, (position,), with equal weights."""
    return solve_lines(scene, scene_lines(scene, phases), np.full(len(phases), 1 / len(phases))).cycle


def _outside_path(dataset: xr.Dataset, pair: Pair) -> NDArray:
    """Share of the load on tooth pairs whose whole face is outside the path of contact, (position,)."""
    turns, meshing = dataset.mesh_phase.values[:, None] + dataset.pair_index.values, pair.meshing
    rise = pair.meshing.face_width * math.tan(meshing.beta_b) / meshing.base_pitch
    outside = (turns + rise < 0) | (turns > meshing.transverse_contact_ratio)
    return (dataset.load_share.values * outside).sum(axis=-1)


def findings(dataset: xr.Dataset) -> list[str]:
    """Findings as text: differences between the models, where they are largest, and why."""
    ste = {str(model): dataset.transmission_error.values[i] for i, model in enumerate(dataset.model.values)}
    mean = float(ste["contact"].mean())
    bar = 100 * float(dataset.transmission_error_uncertainty) / mean
    fast, lines = (100 * float(dataset.residual.sel(model=name)) for name in ("fast", "lines"))
    off = ste["fast"] - ste["contact"]
    worst = int(np.argmax(np.abs(off)))
    compliance, touching = (float((ste[a] - ste[b])[worst]) for a, b in (("fast", "lines"), ("lines", "contact")))
    outside = 100 * float(dataset.share_outside_path[worst])
    texts = [
        f"RMS off contact finite elements, of the mean STE {mean:.4g} µm ± {bar:.2f} %: fast model {fast:.2f} %, "
        f"finite elements on lines {lines:.2f} %",
        f"most at τ = {float(dataset.mesh_phase[worst]):.3g}: fast model {off[worst]:+.3f} µm, "
        f"of which {compliance:+.3f} µm compliance of teeth and bodies, {touching:+.3f} µm where and how flanks touch; "
        f"{outside:.0f} % of the load lies outside the path of contact there",
    ]
    if "off_line" in ste:
        better = 100 * float(dataset.residual.sel(model="off_line"))
        texts.append(f"with [effects.off_line_contact] the fast model is {better:.2f} % off")
    return texts


def write(datasets: list[xr.Dataset], folder: Path) -> list[Path]:
    """Write contact.nc and contact.png for every scene; several scenes are numbered from 1."""
    written = []
    for i, dataset in enumerate(datasets, start=1):
        number = f"-{i}" if len(datasets) > 1 else ""
        data, picture = (folder / f"{Path(name).stem}{number}{Path(name).suffix}" for name in (DATASET, PICTURE))
        written += [save(dataset, data), _picture(dataset, picture)]
    return written


def _picture(dataset: xr.Dataset, path: Path) -> Path:
    """Draw the STE of all models, and their differences from contact finite elements with the error bar."""
    figure, axes = new_figure(2, 1, (7.0, 5.6), sharex=True)
    upper, lower = axes[:, 0]
    phase, ste = dataset.mesh_phase.values, dataset.transmission_error.values
    curves = dict(zip(dataset.model.values.tolist(), ste, strict=True))
    for name, curve in curves.items():
        style, color = _STYLES[name]
        upper.plot(phase, curve, style, color=color, label=MODELS[name], ms=3)
        if name != "contact":
            lower.plot(phase, curve - curves["contact"], style, color=color)
    bar = float(dataset.transmission_error_uncertainty)
    lower.axhspan(-bar, bar, color=GREY, alpha=0.3, lw=0)
    lower.set_xlabel("mesh phase")
    upper.set_ylabel("transmission error [µm]")
    lower.set_ylabel("off contact FE [µm]")
    upper.legend(frameon=False, fontsize=8)
    percent = 100 * float(dataset.residual[0])
    upper.set_title(
        f"{dataset.attrs['name']}: fast model within {percent:.2f} % of contact finite elements", fontsize=10
    )
    write_figure(figure, path)
    return path
