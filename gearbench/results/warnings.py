"""What a result should not be trusted or built with: one line for each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from gearbench.geometry.role import Role
from gearbench.results.provenance import support
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

#: Allowable contact stress of case-hardened steel of quality MQ, ISO 6336-5 [MPa].
HARDENED = 1500.0
#: Least tip thickness of a tooth [normal modules], ISO 21771-1 and usual practice.
LEAST_TIP = 0.2
#: Harmonics below this part of the peak-to-peak value are not told from the noise of the discretisation, and the least
#: peak-to-peak value that is, over the mean.
NOISE = 1e-3


def warnings(scene: Scene, dataset: xr.Dataset | None = None) -> tuple[str, ...]:
    """Body absent, pointed tips, interference; and of a Dataset a pressure beyond a hardened flank, and noise."""
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
    if "flank_pressure_max" in dataset and (p := float(dataset["flank_pressure_max"])) > HARDENED:
        found.append(f"contact pressure {p:.0f} MPa is beyond a case-hardened flank ({HARDENED:.0f} MPa, ISO 6336-5)")
    names = ("transmission_error_mean", "transmission_error_peak_to_peak")
    if all(name in dataset for name in names):
        mean, swing = (float(dataset[name]) for name in names)
        if mean > 0 and math.isfinite(swing) and swing < NOISE * mean:
            found.append(f"noise floor: peak-to-peak STE of {swing:.2g} µm is below {NOISE:g} of its mean")
    return tuple(found)
