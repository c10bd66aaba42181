"""The figure of all shapes of a flank: each drawn from its effect, over roll angle and face width of the pinion."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.effects.base import GapEffect
from gearbench.effects.registry import effect_class
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Member, Pair
from gearbench.named_files import files_of
from gearbench.schema import read

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PAIR = Pair(
    normal_module=3.0,
    helix_angle=12.0,
    face_width=24.0,
    centre_distance=92.2,
    pinion=Member(teeth=24),
    wheel=Member(teeth=36),
)
_RELIEF = {"amount": 10.0, "start_roll_angle": 25.0}
#: Title → effect and its table: amounts of 10 µm of the pinion.
SHAPES: dict[str, tuple[str, dict[str, Any]]] = {
    "tip relief C_αa, linear": ("tip_relief", {"pinion": _RELIEF}),
    "tip relief, parabolic": ("tip_relief", {"pinion": {**_RELIEF, "shape": "parabolic"}}),
    "tip relief, circular": ("tip_relief", {"pinion": {**_RELIEF, "shape": "circular"}}),
    "root relief C_αf": ("root_relief", {"pinion": {"amount": 10.0, "start_roll_angle": 17.5}}),
    "profile slope f_Hα": ("profile_slope", {"pinion": 10.0}),
    "profile crowning C_α": ("profile_crowning", {"pinion": 10.0}),
    "profile curve": ("profile_curve", {"pinion": {"polynomial": [0.0, 0.0, 10.0]}}),
    "crowning C_β": ("crowning", {"amount": 10.0}),
    "crowning, unsymmetrical": ("crowning", {"amount": 10.0, "amount_at_0": 4.0, "highest": 9.0}),
    "end relief C_βI, C_βII": ("end_relief", {"amount": 10.0, "length": 5.0}),
    "end relief at y = b": ("end_relief", {"at_b": {"amount": 10.0, "length": 8.0, "shape": "parabolic"}}),
    "helix slope f_Hβ": ("helix_slope", {"pinion": 10.0}),
    "flank twist S_α": ("flank_twist", {"pinion": 20.0}),
    "helix curve": ("helix_curve", {"pinion": {"at": [0.0, 6.0, 18.0, 24.0], "deviation": [10.0, 0.0, 0.0, 6.0]}}),
    "misalignment f_Σβ": ("misalignment", {"deviation": 11.0}),
    "topography": ("topography", {"pinion": "flank.csv"}),
}
#: A measured flank: radii down, face width across, material missing [µm].
MEASURED = """radius, 0, 6, 12, 18, 24
34.5, 5, 3, 2.5, 3, 4
36.0, 3, 1, 0, 0.5, 2
37.5, 4, 1.5, 0.5, 1, 3
39.5, 10, 8, 7, 7.5, 9
"""


def draw(path: Path) -> None:
    """Write the figure."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(4, 4, figsize=(12.0, 10.8), layout="constrained", subplot_kw={"projection": "3d"})
    with TemporaryDirectory() as folder, files_of(Path(folder) / "scene.toml"):
        (Path(folder) / "flank.csv").write_text(MEASURED, encoding="utf-8")
        for axis, (title, (name, table)) in zip(axes.flat, SHAPES.items(), strict=True):
            shape(axis, read(effect_class(name), table))
            axis.set_title(title, fontsize=11, y=0.97)
    figure.suptitle("Material missing on the flank of the pinion [µm], upwards; root in front, tip behind", fontsize=12)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def shape(axis: Any, effect: GapEffect) -> Axes:
    """Gap of one effect over the active flank."""
    u = np.linspace(PAIR.meshing.path_start, PAIR.meshing.path_end, 61)
    y = np.linspace(0.0, PAIR.face_width, 61)
    grid_u, grid_y = np.meshgrid(u, y, indexing="ij")
    one = np.ones((1, len(u)))
    lines = ContactLines(
        pair=PAIR, mesh_phase=np.zeros(1), index=np.zeros(len(u), int), u=grid_u[None], y=grid_y[None], length=one
    )
    gap = 1e3 * effect.gap(lines)[0]
    angle = np.degrees(grid_u / PAIR.gears[0].base_radius)
    top = 12.0 if gap.max() > 6 else 6.0
    axis.plot_surface(grid_y, angle, gap, cmap="viridis", vmin=-10, vmax=10, rcount=31, ccount=31, lw=0.1, alpha=0.95)
    axis.set(xlim=(0, PAIR.face_width), zlim=(min(0.0, math.floor(gap.min())), top))
    axis.set_xlabel("y [mm]", fontsize=8, labelpad=-6)
    axis.set_ylabel("roll angle [°]", fontsize=8, labelpad=-6)
    axis.tick_params(labelsize=7, pad=-3)
    axis.view_init(elev=24, azim=-58)
    return axis
