"""Tables that a page draws, from the results of a gear (``Picture``)."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from gearbench.explore.model import CycleCurve, Picture, density
from gearbench.geometry.tooth_shapes import mesh
from gearbench.results.provenance import support

#: Name of the source → name of the column → values.
Tables = dict[str, dict[str, Any]]
#: Mesh orders listed in the table of numbers and drawn over torque.
ORDERS = (1, 2, 3)


def tables(picture: Picture, *, teeth: bool = True) -> Tables:
    """All tables of a picture, with 4-byte floats, which are precise enough to draw.

    Without ``teeth`` the tooth shapes are left out: sliders do not change them. Scatter is left out if it is not
    computed yet.
    """
    pair = picture.scene.pair
    ste, k = picture.transmission_error, picture.mesh_stiffness
    found: Tables = {
        "ste": _curve(ste),
        "stiffness": _curve(k),
        "ste_orders": _orders(ste.amplitude),
        "stiffness_orders": _orders(k.amplitude),
    }
    image = {
        "image": [picture.pressure.astype("float32")],
        "x": [0.0],
        "y": [picture.pressure_range[0]],
        "dw": [pair.meshing.face_width],
        "dh": [picture.pressure_range[1] - picture.pressure_range[0]],
        "top": [float(np.nanquantile(picture.pressure, 0.99))],
    }
    scatter = numbers(picture) if picture.unfinished else densities(picture)
    shapes = _teeth(picture) if teeth else {}
    return {
        **_short(found),
        **scatter,
        "pressure": image,
        **shapes,
        "scene": {"text": [picture.scene.to_toml()], "tables": [json.dumps(picture.scene.to_mapping())]},
    }


def densities(picture: Picture) -> Tables:
    """Tables of the densities of the scatter (empty without scatter) and of the numbers."""
    if picture.scatter is None:
        empty = _short({f"{name}_density": {"value": [], "density": []} for name in ("ste", "stiffness")})
        return {**empty, **numbers(picture)}
    scatter = {"ste": picture.scatter.transmission_error, "stiffness": picture.scatter.mesh_stiffness}
    drawn: Tables = {
        f"{name}_density": dict(zip(("value", "density"), density(v), strict=True)) for name, v in scatter.items()
    }
    return {**_short(drawn), **numbers(picture)}


def _short(found: Tables) -> Tables:
    return {name: {key: np.asarray(v, dtype="float32") for key, v in table.items()} for name, table in found.items()}


def _curve(cycle: CycleCurve) -> dict[str, Any]:
    """Curve over two mesh periods, with and without its mean."""
    values = np.tile(cycle.values, 2)
    return {"phase": [*cycle.phase, *(cycle.phase + 1)], "value": values, "fluctuation": values - cycle.mean}


def _orders(amplitude: np.ndarray) -> dict[str, Any]:
    known = np.isfinite(amplitude)
    return {"order": 1 + np.flatnonzero(known), "amplitude": amplitude[known]}


def _teeth(picture: Picture) -> Tables:
    """Tooth outlines at mesh phase 0 about the gear centres, path of contact, and data of the rotation."""
    drawn = mesh(picture.scene.pair)
    pitch_point = drawn.on_path(np.array([picture.scene.pair.meshing.pitch_point]))[0]
    half = 1.15 * max(g.tooth_height for g in picture.scene.pair.gears) + 0.15 * drawn.pitch
    path = drawn.on_path(np.array(drawn.path))
    return {
        "pinion": {"x": drawn.pinion[:, 0], "y": drawn.pinion[:, 1]},
        "wheel": {"x": drawn.wheel[:, 0], "y": drawn.wheel[:, 1]},
        "path": {"x": path[:, 0], "y": path[:, 1]},
        "motion": {
            "pinion_base": [drawn.radii[0]],
            "wheel_base": [drawn.radii[1]],
            "pitch": [drawn.pitch],
            "angle": [drawn.angle],
            "distance": [drawn.distance],
            "first": [drawn.first],
            "start": [drawn.path[0]],
            "end": [drawn.path[1]],
            "middle": [float(pitch_point[1])],
            "half": [half],
        },
    }


def numbers(picture: Picture) -> Tables:
    """Table of numbers of a picture: labels and values as text."""
    ste, k, pair = picture.transmission_error, picture.mesh_stiffness, picture.scene.pair
    rows = [
        ("peak-to-peak STE [µm]", f"{ste.peak_to_peak:.3f}"),
        ("RMS STE [µm]", f"{ste.rms:.3f}"),
        *((f"order {n} of STE [µm]", f"{ste.amplitude[n - 1]:.3f}") for n in ORDERS),
        ("mean STE [µm]", f"{ste.mean:.2f}"),
        ("mean stiffness k [N/µm]", f"{k.mean:.1f}"),
        ("RMS of k [%]", f"{k.rms:.2f}"),
        ("greatest contact pressure [MPa]", f"{np.nanmax(picture.pressure):.0f}"),
        ("teeth z", f"{pair.pinion.teeth}/{pair.wheel.teeth}"),
        ("m_n [mm], β [°], b [mm]", f"{pair.normal_module:g}, {pair.helix_angle:g}, {pair.meshing.face_width:g}"),
        (
            "contact ratios ε_α, ε_β",
            f"{pair.meshing.transverse_contact_ratio:.3f}, {pair.meshing.overlap_ratio:.3f}",
        ),
        ("working pressure angle α_wt [°]", f"{np.degrees(pair.meshing.alpha_wt):.3f}"),
        ("backlash j_wt [mm]", f"{pair.actual_backlash:.4f}"),
        ("torque on the pinion [N·m]", f"{picture.scene.load.torque:g}"),
        ("teeth stand on", support(picture.scene).replace("_", " ")),
    ]
    if picture.scatter is not None or picture.unfinished:
        rows.append(("RMS STE over the errors [µm]", _scatter(picture, "transmission_error")))
        rows.append(("RMS of k over the errors [%]", _scatter(picture, "mesh_stiffness")))
    labels, values = zip(*rows, strict=True)
    return {"numbers": {"label": list(labels), "value": list(values)}}


def _scatter(picture: Picture, which: str) -> str:
    """Text "mean ± standard deviation" over the error samples; "…" if they are not computed yet."""
    if picture.scatter is None:
        return "…"
    values = getattr(picture.scatter, which)
    return f"{values.mean():.3f} ± {values.std(ddof=1):.3f}"
