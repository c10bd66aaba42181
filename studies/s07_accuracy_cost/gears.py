"""Work–precision of the twelve gears in use over segments, Gauss points and order of solid teeth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from gearbench.accuracy.settings import GAUSS_POINTS, SEGMENTS, SOLID_ORDER, solid_orders
from gearbench.effort.curves import as_dataset, setting_curve
from gearbench.lazy import xr
from gearbench.scene import Scene
from gearbench.scene_file import read_scene

_GEARS = Path(__file__).parents[2] / "examples" / "gears"
#: Number of timed runs per level.
REPEATS = 3
#: Settings with levels that are affordable for wide helical pairs on gear bodies; the last two are the reference.
SETTINGS = (
    replace(SEGMENTS, levels=lambda _: (2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192)),
    replace(GAUSS_POINTS, levels=lambda _: (1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32, 48, 64)),
    replace(SOLID_ORDER, levels=lambda scene: solid_orders(scene)[:8]),
)


def gears() -> dict[str, Scene]:
    """Scenes of ``examples/gears`` by name, with contact on the line of action."""
    return {path.stem: read_scene(path).one_load.without("off_line_contact") for path in sorted(_GEARS.glob("*.toml"))}


def gear_cost(scene: Scene) -> xr.Dataset:
    """Measure the work–precision of ``SETTINGS``; see ``gearbench.effort.workprecision.cost``."""
    return as_dataset([setting_curve(scene, setting, REPEATS) for setting in SETTINGS])
