"""Tables that a page draws, made from the results of a pair or a train (``model.ShownResults``)."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from gearbench.explore.look import PALETTE
from gearbench.explore.model import POINTS, CycleCurve, FlankPressure, Sharing, ShownResults, density
from gearbench.geometry.tooth_shapes import mesh
from gearbench.optimisation.numbers import gear_ratio
from gearbench.results.cycle import curves
from gearbench.results.provenance import support
from gearbench.results.responses import response
from gearbench.robustness.montecarlo import RobustProblem
from gearbench.scene import Scene
from gearbench.trains.figures import is_internal, outline
from gearbench.trains.scatter import SampledTrain

#: Name of the Bokeh source → name of the column → values.
Tables = dict[str, dict[str, Any]]
#: Mesh orders listed in the table of numbers and drawn over torque.
ORDERS = (1, 2, 3)
#: Response → figure of its density over the error samples.
DENSITIES = {
    "transmission_error_rms": "ste_density",
    "mesh_stiffness_rms": "stiffness_density",
    "train_transmission_error_rms": "ste_density",
    "mesh_load_factor": "sharing_density",
}
#: Response → label of its mean and standard deviation in the table of numbers.
OVER_ERRORS = {
    "transmission_error_rms": "RMS STE, mean ± σ of the error samples [µm]",
    "mesh_stiffness_rms": "RMS of k, mean ± σ of the error samples [%]",
    "train_transmission_error_rms": "RMS Δ, mean ± σ of the error samples [µm]",
    "mesh_load_factor": "K_γ, mean ± σ of the error samples",
}
#: Colours of the load shares, one for each planet.
SHARES = PALETTE[1:4] + PALETTE[:1] + PALETTE[5:]


def tables(results: ShownResults, *, teeth: bool = True) -> Tables:
    """All tables of ``results``, with 4-byte floats, which are precise enough to draw.

    Without ``teeth`` the tooth shapes are left out, for answers and variants that do not draw them. Scatter is left out
    if it is not computed yet.
    """
    ste, k = results.transmission_error, results.mesh_stiffness
    curve_tables: Tables = {
        "ste": _curve(ste),
        "stiffness": _curve(k),
        "ste_orders": _orders(ste),
        "stiffness_orders": _orders(k),
    }
    scatter = numbers(results) if results.unfinished else densities(results)
    if isinstance(results.load, Sharing):
        load_tables, shapes = _sharing(results.load), _gears(results.load) if teeth else {}
    else:
        load_tables, shapes = _pressure(results.load, results.scene), _teeth(results) if teeth else {}
    return {
        **_single_precision(curve_tables),
        **scatter,
        **load_tables,
        **shapes,
        "scene": {"text": [results.scene.to_toml()], "tables": [json.dumps(results.scene.to_mapping())]},
    }


def densities(results: ShownResults) -> Tables:
    """Tables of the densities of the scatter (empty without scatter) and of the numbers."""
    drawn: Tables = {}
    for name in _responses(results):
        curve = ([], []) if results.scatter is None else density(results.scatter[name])
        drawn[DENSITIES[name]] = dict(zip(("value", "density"), curve, strict=True))
    return {**_single_precision(drawn), **numbers(results)}


def _responses(results: ShownResults) -> tuple[str, ...]:
    """Responses whose scatter over the error samples is shown."""
    return (SampledTrain if isinstance(results.load, Sharing) else RobustProblem).studied


def _single_precision(tables: Tables) -> Tables:
    """Convert all columns to 4-byte floats."""
    return {name: {key: np.asarray(v, dtype="float32") for key, v in table.items()} for name, table in tables.items()}


def _curve(cycle: CycleCurve) -> dict[str, Any]:
    """Curve over two mesh periods or the whole cycle, with and without its mean."""
    phase, values = _periods(cycle.phase, cycle.values, cycle.length)
    return {"phase": phase, "value": values, "fluctuation": values - cycle.mean}


def _periods(phase: np.ndarray, values: np.ndarray, length: int) -> tuple[np.ndarray, np.ndarray]:
    """Repeat a cycle of one mesh period; a longer one is shown once."""
    return (np.r_[phase, phase + 1], np.r_[values, values]) if length == 1 else (phase, values)


def _orders(cycle: CycleCurve) -> dict[str, Any]:
    """Mesh orders and amplitudes, without those that few phases cannot resolve (NaN)."""
    finite = np.isfinite(cycle.amplitude)
    return {"order": cycle.orders[finite], "amplitude": cycle.amplitude[finite]}


def _pressure(pressure: FlankPressure, scene: Scene) -> Tables:
    """Image of the pressure, its place and size [mm], and ``top``, the end of the colour scale [MPa]."""
    image = {
        "image": [pressure.values.astype("float32")],
        "x": [0.0],
        "y": [pressure.range[0]],
        "dw": [scene.pair.meshing.face_width],
        "dh": [pressure.range[1] - pressure.range[0]],
        "top": [float(np.nanquantile(pressure.values, 0.99))],  # peaks at edges would hide the rest
    }
    return {"pressure": image}


def _sharing(load: Sharing) -> Tables:
    """Load shares of the paths over the mesh cycle, and the largest over a revolution of the carrier."""
    phases, paths = load.cycle.phases, _paths(load)
    mesh_of_path = [paths.index(path) for path in dict.fromkeys(paths)]
    share_curves = [curves(phases, values, POINTS) for values in load.cycle.sharing.T[mesh_of_path]]
    xs, ys = ([np.concatenate([piece[i] for piece in share]) for share in share_curves] for i in (0, 1))
    over_turns = load.over_turns[mesh_of_path] if load.over_turns.size else load.over_turns
    points_by_table = {
        "sharing": [_periods(x, y, phases.length) for x, y in zip(xs, ys, strict=True)],
        "revolution": [(load.turns, largest) for largest in over_turns],
    }
    return {
        name: {
            "xs": [x.astype("f4") for x, _ in points],
            "ys": [y.astype("f4") for _, y in points],
            "colour": _colours(len(points)),
        }
        for name, points in points_by_table.items()
    }


def _paths(load: Sharing) -> list[str]:
    """Path of the load through each mesh, (mesh,): the name of its planet, or of the mesh if it has none.

    Both meshes of a planet carry the same force, so they are one path.
    """
    train, carried = load.cycle.linkage.train, load.cycle.linkage.carried
    shafts = ([train.shaft(gear) for gear in mesh.gears] for mesh in train.meshes)
    return [
        next((shaft for shaft in of_mesh if shaft in carried), mesh.name)
        for of_mesh, mesh in zip(shafts, train.meshes, strict=True)
    ]


def _colours(count: int) -> list[str]:
    """Colours of ``count`` load paths."""
    return [SHARES[i % len(SHARES)] for i in range(count)]


def _gears(load: Sharing) -> Tables:
    """Outlines of the gears at mesh phase 0, their axes and pitch points, and their rotation in a mesh period [rad]."""
    linkage = load.cycle.linkage
    train, coast = linkage.train, linkage.coast
    phases, first = train.phases(coast=coast), train.meshes[0]
    # signed rotation of the first driver in a mesh period
    rotation = 2 * math.pi * train.turn(first.name) * (-1 if coast else 1) / first.pair.gears[0].teeth
    points = [outline(train, gear, phases, coast=coast) for gear in train.gears]
    inside = [is_internal(train, gear) for gear in train.gears]
    axes = np.array([train.places[train.shaft(gear)] for gear in train.gears])
    label_y = [each[:, 1].min() if internal else y for each, internal, (_, y) in zip(points, inside, axes, strict=True)]
    pitch_points, paths = [train.pitch_point(mesh.name) for mesh in train.meshes], _paths(load)
    path_names = list(dict.fromkeys(paths))
    labels = np.array([train.places.get(path, pitch_points[paths.index(path)]) for path in path_names])
    low, high = (np.array(each) for each in zip(*((p.min(axis=0), p.max(axis=0)) for p in points), strict=True))
    return {
        "gears": {
            "xs": [each[:, 0].astype("f4") for each in points],
            "ys": [each[:, 1].astype("f4") for each in points],
            "x": axes[:, 0],
            "y": axes[:, 1],
            "rate": [rotation * linkage.rates[train.shaft(gear)] for gear in train.gears],
            # ``timed`` holds the second gears of stepped planets (timed to the first): one name for both gears
            "name": ["" if gear in train.timed else gear for gear in train.gears],
            "label_y": label_y,
            "alpha": [0.0 if internal else 0.35 for internal in inside],
        },
        "marks": {
            "x": [x for x, _ in pitch_points],
            "y": [y for _, y in pitch_points],
            "path": [path_names.index(path) for path in paths],
        },
        "paths": {"x": labels[:, 0], "y": labels[:, 1], "colour": _colours(len(path_names))},
        "extent": {
            "low": low.min(axis=0),
            "high": high.max(axis=0),
            "cycle": [load.cycle.phases.length] * 2,
        },  # x and y
    }


def _teeth(results: ShownResults) -> Tables:
    """Tooth outlines at mesh phase 0 about the gear centres, path of contact, and ``motion`` for ``js/teeth.js``.

    ``motion`` holds the values of ``TeethInMesh``, and the middle and half of the vertical range of the figure [mm].
    """
    mesh_shape = mesh(results.scene.pair)
    pitch_point = mesh_shape.on_path(np.array([results.scene.pair.meshing.pitch_point]))[0]
    # above and below the pitch point the figure has room for the taller tooth, and a margin
    half = 1.15 * max(g.tooth_height for g in results.scene.pair.gears) + 0.15 * mesh_shape.pitch
    path = mesh_shape.on_path(np.array(mesh_shape.path))
    return {
        "pinion": {"x": mesh_shape.pinion[:, 0], "y": mesh_shape.pinion[:, 1]},
        "wheel": {"x": mesh_shape.wheel[:, 0], "y": mesh_shape.wheel[:, 1]},
        "path": {"x": path[:, 0], "y": path[:, 1]},
        "motion": {
            "pinion_base": [mesh_shape.radii[0]],
            "wheel_base": [mesh_shape.radii[1]],
            "pitch": [mesh_shape.pitch],
            "angle": [mesh_shape.angle],
            "distance": [mesh_shape.distance],
            "first": [mesh_shape.first],
            "start": [mesh_shape.path[0]],
            "end": [mesh_shape.path[1]],
            "middle": [float(pitch_point[1])],
            "half": [half],
        },
    }


def numbers(results: ShownResults) -> Tables:
    """Table of numbers: labels and values as text."""
    ste, k, load = results.transmission_error, results.mesh_stiffness, results.load
    error = "STE" if isinstance(load, FlankPressure) else "Δ"  # Δ: transmission error of the whole train
    amplitude = dict(zip(ste.orders.tolist(), ste.amplitude, strict=True))
    rows = [
        (f"peak-to-peak {error} [µm]", f"{ste.peak_to_peak:.3f}"),
        (f"RMS {error} [µm]", f"{ste.rms:.3f}"),
        *((f"order {n} of {error} [µm]", f"{amplitude[n]:.3f}") for n in ORDERS),
        (f"mean {error} [µm]", f"{ste.mean:.2f}"),
        ("mean stiffness k [N/µm]", f"{k.mean:.1f}"),
        ("RMS of k [%]", f"{k.rms:.2f}"),
        *(_of_pair(load, results.scene) if isinstance(load, FlankPressure) else _of_train(load, results.scene)),
        ("model of the gear bodies", support(results.scene).replace("_", " ")),
    ]
    if results.scatter is not None or results.unfinished:
        rows += [(OVER_ERRORS[name], _scatter(results, name)) for name in _responses(results)]
    labels, values = zip(*rows, strict=True)
    return {"numbers": {"label": list(labels), "value": list(values)}}


def _of_pair(pressure: FlankPressure, scene: Scene) -> Iterator[tuple[str, str]]:
    """Yield the rows of the table of numbers that only a pair has."""
    pair, meshing = scene.pair, scene.pair.meshing
    yield "greatest contact pressure [MPa]", f"{np.nanmax(pressure.values):.0f}"
    yield "teeth z", f"{pair.pinion.teeth}/{pair.wheel.teeth}"
    yield "m_n [mm], β [°], b [mm]", f"{pair.normal_module:g}, {pair.helix_angle:g}, {meshing.face_width:g}"
    yield "contact ratios ε_α, ε_β", f"{meshing.transverse_contact_ratio:.3f}, {meshing.overlap_ratio:.3f}"
    yield "working pressure angle α_wt [°]", f"{np.degrees(meshing.alpha_wt):.3f}"
    yield "backlash j_wt [mm]", f"{pair.actual_backlash:.4f}"
    yield "torque on the pinion [N·m]", f"{scene.load.torque:g}"


def _of_train(load: Sharing, scene: Scene) -> Iterator[tuple[str, str]]:
    """Yield the rows of the table of numbers that only a train has."""
    linkage = load.cycle.linkage
    train, phases = linkage.train, linkage.train.phases(coast=linkage.coast)
    yield "mesh load factor K_γ", f"{load.mesh_load_factor:.3f}"
    if linkage.carrier is not None:
        yield "RMS force on the sun [N]", f"{response('sun_force_rms').reduce(load.cycle):.1f}"
        yield "RMS torque ripple of the carrier [N·m]", f"{response('carrier_torque_rms').reduce(load.cycle):.2f}"
        yield "gear ratio", f"{gear_ratio(scene):.4g}"
    gears = {gear: body for mesh in train.meshes for gear, body in zip(mesh.gears, mesh.pair.gears, strict=True)}
    at_ring = {gear: "at ring" for gear in gears if gear in train.timed}  # second gears of stepped planets
    kinds = {gear: at_ring.get(gear, "planets" if gear in linkage.carried else gear) for gear in gears}
    teeth = {kind: str(gears[gear].teeth) for gear, kind in kinds.items()}
    yield f"teeth z of {', '.join(teeth)}", "/".join(teeth.values())
    pair = scene.pair
    yield "m_n [mm], β [°]", f"{pair.normal_module:g}, {pair.helix_angle:g}"
    different_pairs = dict.fromkeys(mesh.pair for mesh in train.meshes)
    ratios = ", ".join(f"{pair.meshing.transverse_contact_ratio:.3f}" for pair in different_pairs)
    yield "contact ratios ε_α of the meshes", ratios
    yield "overlap ratio ε_β", f"{pair.meshing.overlap_ratio:.3f}"
    driver_phases = [phases[mesh.name] for mesh in train.meshes if mesh.driver == train.meshes[0].driver]
    yield f"mesh phases of {train.meshes[0].driver}", ", ".join(f"{phase:.3g}" for phase in driver_phases)
    yield f"torque on {train.meshes[0].driver} [N·m]", f"{scene.load.torque:g}"


def _scatter(results: ShownResults, name: str) -> str:
    """Text "mean ± standard deviation" over the error samples; "…" if they are not computed yet."""
    if results.scatter is None:
        return "…"
    values = results.scatter[name]
    return f"{values.mean():.3f} ± {values.std(ddof=1):.3f}"
