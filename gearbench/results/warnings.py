"""What a result should not be trusted or built with: one line for each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearbench.geometry.role import Role
from gearbench.results.provenance import support
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

#: Where a warning begins: allowable contact stress of case-hardened steel of quality MQ, ISO 6336-5, quoted from memory
#: [MPa].
HARDENED = 1500.0
#: Least tip thickness of a tooth [normal modules], ISO 21771-1 and usual practice.
LEAST_TIP = 0.2


def warnings(scene: Scene, dataset: xr.Dataset | None = None) -> tuple[str, ...]:
    """Body absent, pointed tips, interference; and of a Dataset a pressure beyond a hardened flank."""
    pair, found = scene.pair, []
    if support(scene) == "clamped":
        found.append("teeth are clamped at their roots and too stiff: add [effects.gear_body]")
    for role in Role:
        gear = pair.gears[role]
        tip = float(gear.normal_thickness(gear.tip_radius))
        if tip < LEAST_TIP * pair.normal_module:
            found.append(f"pointed tip of the {role.label}: s_an = {tip:.3g} mm is below {LEAST_TIP} m_n")
        if pair.meshing.has_interference[role]:
            mate = role.mate.label
            found.append(f"interference: the tip of the {mate} reaches below the form circle of the {role.label}")
    if dataset is None:
        return tuple(found)
    if "flank_pressure_max" in dataset and (p := float(dataset["flank_pressure_max"].max())) > HARDENED:
        found.append(f"contact pressure {p:.0f} MPa is beyond a case-hardened flank ({HARDENED:.0f} MPa, ISO 6336-5)")
    return tuple(found)
