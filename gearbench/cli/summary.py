"""Tables and machine-readable summaries of results."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.cli.table import print_columns
from gearbench.lazy import xr
from gearbench.results.provenance import support
from gearbench.scene import Scene

if TYPE_CHECKING:
    from gearbench.geometry.pair import Pair

#: Number of mesh orders in a summary.
ORDERS = 3


def scalars(dataset: xr.Dataset) -> dict[str, float]:
    """All scalar variables of a Dataset by name."""
    return {str(name): float(values) for name, values in dataset.data_vars.items() if values.ndim == 0}


def as_json(scene: Scene, dataset: xr.Dataset, **more: object) -> dict[str, Any]:
    """Scene name, hash, support and all scalars of the Dataset for a JSON object, with their units.

    Beside them the largest residuals of the contact solution and the accuracy, where the Dataset holds them.
    """
    head: dict[str, Any] = {"name": scene.name, "scene_sha256": scene.digest, "support": support(scene)}
    head["wall_time_s"] = dataset.attrs["wall_time_s"]
    head |= {key: value for key, value in dataset.attrs.items() if key.startswith("accuracy_") or key == "warning"}
    values = scalars(dataset)
    head["units"] = {name: dataset[name].attrs.get("units", "1") for name in values}
    residuals = [str(name) for name in dataset.data_vars if str(name).endswith("_residual")]
    head |= {f"{name}_max": float(dataset[name].max()) for name in residuals}
    return {**head, **more, **values}


def pair_line(scene: Scene) -> str:
    """One line with name, pair or train, torque, and model of the gear bodies."""
    pair = scene.pair
    kind = "spur" if pair.helix_angle == 0 else f"helical {pair.helix_angle:g}°"
    loads = ", ".join(f"{each.load.torque:g}" for each in scene.each_load)
    if scene.train is not None:
        meshes = scene.geometry.meshes
        teeth = {gear: z.teeth for mesh in meshes for gear, z in zip(mesh.gears, mesh.pair.gears, strict=True)}
        gears = ", ".join(f"{gear} (z {z})" for gear, z in teeth.items())
        return f"{scene.name or 'scene'}: {gears}, {loads} N·m on {meshes[0].driver}, support: {support(scene)}"
    return (
        f"{scene.name or 'scene'}: {kind}, z {pair.pinion.teeth}/{pair.wheel.teeth}, m_n {pair.normal_module:g} mm, "
        f"ε_α {pair.meshing.transverse_contact_ratio:.3f}, ε_β {pair.meshing.overlap_ratio:.3f}, "
        f"{loads} N·m, support: {support(scene)}"
    )


def geometry_rows(scene: Scene) -> list[tuple[str, str, str, str]]:
    """Rows of the derived geometry: quantity, pinion, wheel, unit; quantities of the pair have one value."""
    pair, m = scene.pair, scene.pair.meshing
    body = [member.bore_diameter if member.teeth > 0 else member.outer_diameter for member in pair.members]
    both = (
        ("profile shift x", pair.profile_shifts, "1"),
        ("generating profile shift x_E", pair.generating_shifts, "1"),
        ("face width", [gear.face_width for gear in pair.gears], "mm"),
        ("tip diameter", [2 * gear.tip_radius for gear in pair.gears], "mm"),
        ("reference diameter", [2 * gear.pitch_radius for gear in pair.gears], "mm"),
        ("start of active profile, diameter", [2 * ends[0] for ends in m.active_radii], "mm"),
        ("root form diameter", [2 * gear.form_radius for gear in pair.gears], "mm"),
        ("root diameter", [2 * gear.root_radius for gear in pair.gears], "mm"),
        ("tip clearance", m.tip_clearances, "mm"),
        ("largest specific sliding", _sliding(pair), "1"),
        ("tip thickness, normal", [float(gear.normal_thickness(gear.tip_radius)) for gear in pair.gears], "mm"),
    )
    rows = [(name, _number(first), _number(second), unit) for name, (first, second), unit in both]
    bores = ["–" if bore is None else f"{bore:.6g}" for bore in body]
    rows.append(("bore, outside of a ring" if pair.is_internal else "bore", bores[0], bores[1], "mm"))
    for name, value, unit in (
        ("working pressure angle", math.degrees(m.alpha_wt), "°"),
        ("gear ratio", pair.wheel.teeth / pair.pinion.teeth, "1"),
        ("contact ratio ε_α", m.transverse_contact_ratio, "1"),
        ("overlap ratio ε_β", m.overlap_ratio, "1"),
        ("total contact ratio ε_γ", m.total_contact_ratio, "1"),
        ("common face width", m.face_width, "mm"),
        ("working centre distance", m.centre_distance, "mm"),
        ("circumferential backlash", pair.actual_backlash, "mm"),
        ("least backlash within the deviations", pair.backlash_limits[0], "mm"),
        ("greatest backlash within the deviations", pair.backlash_limits[1], "mm"),
    ):
        rows.append((name, _number(value), "", unit))
    for name, force in forces(scene).items():
        rows.append((name, f"{force:.5g}", "", "N"))
    rows.append(("model of the gear bodies", support(scene), "", ""))
    return rows


def _number(value: float) -> str:
    """Format a number with six digits; rounding errors become 0."""
    return f"{value if abs(value) > 1e-9 else 0.0:.6g}"


def _sliding(pair: Pair) -> list[float]:
    """Specific sliding ζ of both gears at the start of their active profiles, where it is largest."""
    line = pair.meshing.centre_distance * math.sin(pair.meshing.alpha_wt)
    sliding = []
    for gear, mate, ends in zip(pair.gears, pair.gears[::-1], pair.meshing.active_radii, strict=True):
        roll = float(gear.roll_length(ends[0]))
        sliding.append(1 - (line - roll) / roll * gear.teeth / mate.teeth if roll else -math.inf)
    return sliding


def forces(scene: Scene) -> dict[str, float]:
    """Tangential, radial and axial force at the working pitch circles, with angles of ISO 21771 [N]."""
    pair, m = scene.pair, scene.pair.meshing
    pinion = pair.gears[0]
    working = pinion.base_radius / math.cos(m.alpha_wt)
    tangential = 1e3 * abs(scene.load.torque) / working
    return {
        "tangential force F_t": tangential,
        "radial force F_r": tangential * math.tan(m.alpha_wt),
        "axial force F_a": tangential * math.tan(pinion.beta) * working / pinion.pitch_radius,
    }


def print_geometry(scene: Scene) -> None:
    """Print the derived geometry below the line of the pair."""
    print_columns(pair_line(scene), ("geometry", *scene.gear_names, "unit"), geometry_rows(scene), left=(0, 3))


def warnings(dataset: xr.Dataset) -> tuple[str, ...]:
    """Warnings of a result, one per line."""
    return tuple(f"warning: {line}" for line in dataset.attrs.get("warning", "").split("\n") if line)


def kinds(scene: Scene) -> dict[Pair, Scene]:
    """Pair → scene of its first mesh: meshes of several planets have the same pair."""
    first: dict[Pair, Scene] = {}
    for mesh in scene.meshes.values():
        first.setdefault(mesh.pair, mesh)
    return first


def cautions(scene: Scene, dataset: xr.Dataset) -> list[str]:
    """Warnings about all meshes of a result, each once."""
    from gearbench.results.origin import single_mesh
    from gearbench.results.warnings import warnings as of_mesh

    own = kinds(scene)
    each = (of_mesh(own[mesh.pair], single_mesh(dataset, name)) for name, mesh in scene.meshes.items())
    return [*dict.fromkeys(line for lines in each for line in lines)]


def first_mesh(scene: Scene) -> list[str]:
    """Note that a result is of the first mesh of a gearbox with several; none for other scenes."""
    if scene.system is None or len(scene.mesh_names) == 1:
        return []
    first, *others = scene.mesh_names
    return [f"note: of mesh {first}; {', '.join(others)} only load the shafts"]


def accuracy_line(dataset: xr.Dataset) -> list[str]:
    """Line on the settings chosen for an accuracy, and their estimated error; none without."""
    attrs = dataset.attrs
    if "accuracy_settings" not in attrs:
        return []
    chosen = f"accuracy {100 * attrs['accuracy_requested']:.3g} %: {attrs['accuracy_settings']}"
    error, seconds = 100 * attrs["accuracy_estimated"], attrs["accuracy_seconds"]
    return [f"{chosen}; estimated error {error:.2g} %, chosen in {seconds:.2g} s"]


def print_points(scene: Scene, dataset: xr.Dataset) -> None:
    """Print one line per point of a sweep: peak-to-peak and RMS values."""
    names = [str(dim) for dim in dataset["transmission_error_mean"].dims if dim != "sample"]
    shown = [f"{name}_{suffix}" for name in ("transmission_error_rms", "mesh_stiffness_rms") for suffix in ("mean", "")]
    shown = [
        "transmission_error_mean",
        "transmission_error_peak_to_peak",
        *shown,
        "mesh_stiffness_mean",
        "flank_pressure_max",
    ]
    shown = [name.removesuffix("_") for name in shown]
    shown = [name for name in shown if name in dataset and set(dataset[name].dims) == set(names)]
    heads = []
    for name in (*names, *shown):
        unit = dataset[name].attrs["units"]
        # break a dotted key into lines
        key = name.removeprefix("effects.").replace(".", "\n").replace("_", " ")
        heads.append(f"{dataset[name].attrs.get('symbol', key)}\n{'–' if unit == '1' else unit}")
    rows = dataset[[*shown]].to_dataframe().reset_index()[[*names, *shown]].itertuples(index=False)
    shown = [[value if isinstance(value, str) else f"{value:.5g}" for value in row] for row in rows]
    print_columns(pair_line(scene), heads, shown, left=())


def print_table(title: str, rows: list[tuple[str, str, str]]) -> None:
    """Print rows of (quantity, value, unit)."""
    print_columns(title, ("quantity", "value", "unit"), rows, left=(0, 2))


def result_rows(dataset: xr.Dataset) -> list[tuple[str, str, str]]:
    """Rows of all scalar variables, of variables of both gears, and of the first orders, with units."""
    rows, orders = [], []
    for name, values in dataset.data_vars.items():
        label, unit = str(values.attrs.get("long_name", name)), str(values.attrs.get("units", "1"))
        symbol = str(values.attrs.get("symbol", ""))
        if values.dims == ("harmonic",) and str(name).endswith("_amplitude"):
            numbers = "  ".join(f"{value:.5g}" for value in values[:ORDERS].values)
            n = ", ".join(f"{order:.4g}" for order in dataset["harmonic"][:ORDERS].values)
            orders.append((f"{label}, orders {n}", numbers, unit))
            continue
        if values.dims not in ((), ("gear",)) or "standard error" in label:
            continue
        label = f"{label}, {symbol}" if "_" in symbol else label
        rows.append((label, "  ".join(f"{value:.5g}" for value in np.atleast_1d(values.values)), unit))
    return rows + orders


def duration(seconds: float) -> str:
    """Format a time in a suitable unit."""
    for limit, factor, unit in ((0.9995, 1e3, "ms"), (90.0, 1.0, "s"), (5400.0, 1 / 60, "min")):
        if seconds < limit:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds / 3600:.3g} h"
