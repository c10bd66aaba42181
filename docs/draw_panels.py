"""Figure of a mesh cycle under load: load transfers, transitions, the panels between them and their Gauss points."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import COARSE_PHASES, coarse_solution, scene_lines
from gearbench.contact.load_transfer import LoadTransfer, load_transfers, peak_compression
from gearbench.contact.patches import compression, solve_patches
from gearbench.effects.tip_relief import TipRelief
from gearbench.results.cycle import curves
from gearbench.scene import Load, Resolution, Scene
from gearbench.scene_file import read_scene
from gearbench.solution import solve_scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE, ORANGE, GREEN, DARK, PALE = "#0072B2", "#E69F00", "#009E73", "#333333", "#b8b8b8"
GEARS = Path(__file__).parents[1] / "examples" / "gears"
#: Share of the torque at which a third pair carries for a thirtieth of the cycle, and what is drawn around its load
#: transfer.
SHARE, AROUND = 0.74, (1.8e-3, 3.2e-3)


def relieved(share: float = SHARE) -> Scene:
    """High contact ratio spur pair with tip relief on the line of action, under a share of its torque."""
    scene = read_scene(GEARS / "hcr_spur.toml").without("off_line_contact")
    effects = (*(e for e in scene.effects if e.name != "tip_relief"), TipRelief(amount=15.0, length=1.0))
    load = Load(torque=share * scene.load.torque)
    return replace(scene, effects=effects, load=load, resolution=Resolution())


def draw_panels(path: Path) -> None:
    """Write the figure of the panels of a mesh cycle."""
    import matplotlib.pyplot as plt

    scene = relieved()
    figure, axes = plt.subplots(3, 1, figsize=(9.0, 10.0), layout="constrained")
    transfer = through_mesh(axes[0], scene)
    panels(axes[1], scene)
    ramp(axes[2], scene, transfer)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def through_mesh(axis: Axes, scene: Scene) -> LoadTransfer:
    """Greatest compression of one pair at the coarse phases, and its load transfers, of which the first is returned."""
    solution = coarse_solution(scene, COARSE_PHASES)
    s = peak_compression(compression(solution.problem, solution.lines, solution.guess))
    greatest = np.where(solution.lines.active, s, np.nan).T.reshape(1, -1)
    x = (solution.lines.index[:, None] + solution.phase).ravel()
    axis.axhline(0.0, color=DARK, lw=0.8)
    axis.plot(x, 1e3 * solution.problem.length_scale * greatest[0], "o-", ms=4, color=BLUE, lw=1)
    found = load_transfers(scene, solution, x, greatest)
    for transfer, word, place in zip(found, ("takes up its load", "sheds it"), ("left", "right"), strict=True):
        axis.axvline(transfer.x, color=ORANGE)
        where = {"xytext": (4 * transfer.side, -14), "textcoords": "offset points"}
        axis.annotate(word, (transfer.x, 0.0), ha=place, color=DARK, **where)
    title = "1. Coarse solutions: one pair through the mesh"
    axis.set(xlabel="x = τ + k", ylabel="greatest compression [µm]", title=title)
    return found[0]


def panels(axis: Axes, scene: Scene) -> None:
    """Mesh stiffness on its panels, with their Gauss points."""
    cycle = solve_scene(scene).cycle
    for phase, value in curves(cycle.phases, cycle.mesh_stiffness):
        axis.plot(phase, value, color=BLUE, lw=1.2)
    axis.plot(cycle.phases.phase, cycle.mesh_stiffness, "o", ms=4, color=BLUE, label="Gauss points")
    for i, end in enumerate(cycle.phases.edges[:, 0]):
        axis.axvline(end, color=PALE, lw=1, zorder=0, label=None if i else "ends of panels")
    axis.set(xlabel="mesh phase τ", ylabel="mesh stiffness k [N/µm]", title="2. Panels between the transitions")
    axis.legend(frameon=False, fontsize=8)


def ramp(axis: Axes, scene: Scene, transfer: LoadTransfer) -> None:
    """Mesh stiffness around a load transfer, at many phases, with the end of the panels there."""
    solved = solve_scene(scene).cycle
    tau = np.linspace(transfer.x - AROUND[0], transfer.x + AROUND[1], 81)
    axis.plot(tau, solve_at(scene, tau), ".-", color=GREEN, lw=0.8, ms=4, label="solved at 81 phases, 60 segments")
    for phase, value in curves(solved.phases, solved.mesh_stiffness, 2001):
        near = (phase > tau[0]) & (phase < tau[-1])
        axis.plot(phase[near], value[near], color=BLUE, lw=1.4)
    axis.axvline(transfer.x, color=ORANGE, label="load transfer: mean compression zero")
    for end in transfer.ends:
        axis.axvline(end, color=PALE, zorder=0)
    title = "3. The ramp of a load transfer, with a panel of its own since another is near"
    axis.set(xlabel="mesh phase τ", ylabel="mesh stiffness k [N/µm]", title=title)
    axis.legend(frameon=False, fontsize=8)


def solve_at(scene: Scene, tau: NDArray) -> NDArray:
    """Mesh stiffness [N/µm] of a spur pair at phases, on many segments."""
    fine = replace(scene, resolution=Resolution(positions=len(tau), segments=60))
    return 1e-3 * solve_patches(assemble(fine, scene_lines(fine, tau))).stiffness
