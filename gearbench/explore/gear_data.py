"""The picture of a gear as columns that a page draws."""

from __future__ import annotations

import json
from html import escape
from typing import Any

import numpy as np

from gearbench.explore.model import Cycle, Picture, density
from gearbench.explore.tooth_shapes import mesh

#: Tables of columns by the name of their source.
Tables = dict[str, dict[str, Any]]


def tables(picture: Picture, *, teeth: bool = True) -> Tables:
    """All columns of one picture; numbers as 4-byte floats, because they are drawn only.

    Without ``teeth`` those of the tooth shapes are left out, which sliders do not change; those of a scatter that is
    not computed yet are, too.
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
    scatter = {} if picture.unfinished else densities(picture)
    shapes = _teeth(picture) if teeth else {}
    return {
        **_short(found),
        **scatter,
        "pressure": image,
        **shapes,
        "scene": {"text": [picture.scene.to_toml()], "tables": [json.dumps(picture.scene.to_mapping())]},
    }


def densities(picture: Picture) -> Tables:
    """Columns of the scatter alone; empty where there is none."""
    if picture.scatter is None:
        return _short({f"{name}_density": {"value": [], "density": []} for name in ("ste", "stiffness")})
    scatter = {"ste": picture.scatter.transmission_error, "stiffness": picture.scatter.mesh_stiffness}
    return _short(
        {f"{name}_density": dict(zip(("value", "density"), density(v), strict=True)) for name, v in scatter.items()}
    )


def _short(found: Tables) -> Tables:
    return {name: {key: np.asarray(v, dtype="float32") for key, v in table.items()} for name, table in found.items()}


def _curve(cycle: Cycle) -> dict[str, Any]:
    """Two mesh periods, as they are and less their mean."""
    values = np.tile(cycle.values, 2)
    return {"phase": [*cycle.phase, *(cycle.phase + 1)], "value": values, "fluctuation": values - cycle.mean}


def _orders(amplitude: np.ndarray) -> dict[str, Any]:
    known = np.isfinite(amplitude)
    return {"order": 1 + np.flatnonzero(known), "amplitude": amplitude[known]}


def _teeth(picture: Picture) -> Tables:
    """Outlines at phase 0 about their own centres, and their rotation."""
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


def summary(name: str, *pictures: Picture) -> str:
    """A table as HTML: the gear as stored, and with the settings of the page where a second picture is given."""
    pair = pictures[-1].scene.pair
    z = f"{pair.pinion.teeth}/{pair.wheel.teeth}"
    head = f"z {z}, m_n {pair.normal_module:g} mm, β {pair.helix_angle:g}°, b {pair.meshing.face_width:g} mm"
    ratios = f"ε_α {pair.meshing.transverse_contact_ratio:.3f}, ε_β {pair.meshing.overlap_ratio:.3f}"
    rows = [
        ("RMS δ [µm]", *(f"{p.transmission_error.rms:.3f}" for p in pictures)),
        ("peak-to-peak δ [µm]", *(f"{p.transmission_error.peak_to_peak:.3f}" for p in pictures)),
        ("mean k [N/µm]", *(f"{p.mesh_stiffness.mean:.1f}" for p in pictures)),
        ("RMS k [%]", *(f"{p.mesh_stiffness.rms:.2f}" for p in pictures)),
        ("RMS δ, errors [µm]", *(_scatter(p, "transmission_error") for p in pictures)),
        ("RMS k, errors [%]", *(_scatter(p, "mesh_stiffness") for p in pictures)),
    ]
    heads = ("", "stored", "now")[: len(pictures) + 1]
    lines = [_row("th", heads), *(_row("td", row) for row in rows)]
    table = f"<table style='border-spacing:6px 1px;margin-left:-6px'>{''.join(lines)}</table>"
    return f"<b>{escape(name)}</b><br>{head}<br>{ratios}{table}"


def _row(tag: str, cells: tuple[str, ...]) -> str:
    first, *rest = cells
    right = "".join(f"<{tag} style='text-align:right'>{cell}</{tag}>" for cell in rest)
    return f"<tr><{tag} style='text-align:left'>{first}</{tag}>{right}</tr>"


def _scatter(picture: Picture, which: str) -> str:
    """Mean ± standard deviation over the error samples."""
    if picture.scatter is None:
        return "…" if picture.unfinished else "–"
    values = getattr(picture.scatter, which)
    return f"{values.mean():.2f} ± {values.std(ddof=1):.2f}"
