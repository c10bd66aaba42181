"""Representations in notebooks: tables in HTML in the notebook's style."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gearbench.geometry.pair import Pair
    from gearbench.scene import Scene


def html_table(title: str, heads: Sequence[str], rows: Mapping[str, Iterable[object]]) -> str:
    """A table with a caption, column heads, and the cells of each row by its heading; numbers with five digits."""
    head = "".join(f"<th>{escape(name)}</th>" for name in ("", *heads)) if heads else ""
    lines = [f"<table><caption>{escape(title)}</caption>", f"<thead><tr>{head}</tr></thead>" if head else "", "<tbody>"]
    for name, cells in rows.items():
        lines.append(f"<tr><th>{escape(name)}</th>{''.join(f'<td>{escape(_shown(cell))}</td>' for cell in cells)}</tr>")
    return "".join((*lines, "</tbody></table>"))


def _shown(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def pair_html(pair: Pair) -> str:
    """Both gears, and the pair they make."""
    pinion, wheel = both = pair.gears
    gears = {
        "teeth z": (pinion.teeth, wheel.teeth),
        "profile shift x": pair.profile_shifts,
        "addendum, dedendum [m_n]": [f"{gear.addendum:g}, {gear.dedendum:g}" for gear in both],
        "tip radius r_a [mm]": (pinion.tip_radius, wheel.tip_radius),
        "pitch radius r [mm]": (pinion.pitch_radius, wheel.pitch_radius),
        "base radius r_b [mm]": (pinion.base_radius, wheel.base_radius),
        "root radius r_f [mm]": (pinion.root_radius, wheel.root_radius),
        "tip clearance [mm]": pair.meshing.tip_clearances,
    }
    together = {
        "normal module m_n [mm]": pair.normal_module,
        "pressure angle, helix angle [°]": f"{pair.pressure_angle:g}, {pair.helix_angle:g}",
        "face width, centre distance [mm]": f"{pair.meshing.face_width:g}, {pair.centre_distance:g}",
        "working pressure angle α_wt [°]": math.degrees(pair.meshing.alpha_wt),
        "contact ratios ε_α, ε_β": f"{pair.meshing.transverse_contact_ratio:.4g}, {pair.meshing.overlap_ratio:.4g}",
        "backlash j_wt [mm]": round(pair.actual_backlash, 9),
        "E [GPa], ν": "; ".join(dict.fromkeys(f"{m.youngs_modulus:g}, {m.poisson_ratio:g}" for m in pair.materials)),
    }
    return html_table("gears", ("pinion", "wheel"), gears) + html_table("pair", (), _column(together))


def scene_html(scene: Scene) -> str:
    """The pair, then load, effects and resolution as in the scene file."""
    tables = scene.to_mapping()
    given = {**tables["effects"], "resolution": tables.get("resolution", {})}
    rows = {name: ", ".join(f"{k} = {v}" for k, v in table.items()) or "defaults" for name, table in given.items()}
    load = f"{', '.join(f'{each.load.torque:g}' for each in scene.each_load)} N·m on the pinion"
    return pair_html(scene.pair) + html_table(scene.name or "scene", (), _column({"load": load, **rows}))


def _column(cells: Mapping[str, object]) -> dict[str, tuple[object]]:
    return {name: (cell,) for name, cell in cells.items()}
