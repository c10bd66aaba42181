"""Default curves of relieved spur pairs under any torque, against panels halved until they are resolved.

The reference knows nothing of load transfers: it halves a panel whose last Legendre coefficients are large, or whose
polynomials do not meet those of its neighbours.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from gearbench import read_scene
from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import gap_kinks
from gearbench.contact.patches import first_round, next_round, solve_patches
from gearbench.contact.problem import under_shares
from gearbench.contact.solver import Guess
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.geometry.quadrature import gauss, interpolation, legendre_transform
from gearbench.results.cycle import MeshCycle, Phases, coefficients, fluctuation_rms, mean
from gearbench.results.outputs import output
from gearbench.scene import Load, Resolution, Scene
from gearbench.solution import solve_scene
from tests.support.campaign import many
from tests.support.paths import EXAMPLES

PAIRS = ("fine_pitch", "fzg_c", "hcr_spur", "nasa_28", "osu_50", "rim_17_43", "ross_62", "thin_rim")
#: Torques of 90 that miss off the line, and by how many times at most: steep curves behind the corners of the relief.
BEYOND = {"nasa_28": (1, 1.05)}
#: Segments that resolve how a line ceases to touch, from one end of the face to the other.
FINE = 60
CURVES = ("transmission_error", "mesh_stiffness")
POINTS, TOLERANCE, LEAST = 5, 3e-5, 1e-6
#: Shares of the torque of an example, of 90; ``CAMPAIGN=30 make test-all`` tries all of them.
SHARES = np.linspace(0.1, 2.0, 90)[3 :: max(1, 30 // max(1, many(1)))]


def relieved(name: str, share: float, off_line: bool) -> Scene:
    scene = read_scene(EXAMPLES / "gears" / f"{name}.toml").without("off_line_contact")
    effects, m = scene.effects, scene.pair.normal_module
    if not any(effect.name == "tip_relief" for effect in effects):
        effects = (*effects, TipRelief(amount=5.0 * m, length=0.4 * m))
    if off_line:
        effects = (*effects, OffLineContact())
    return replace(scene, effects=effects, load=Load(torque=share * scene.load.torque), resolution=Resolution())


class Halved:
    """Curves on panels, and those panels halved where the curves are not resolved."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.known = scene, {}
        meshing = scene.pair.meshing
        kinks = meshing.phases_at((meshing.path_start, meshing.path_end, *gap_kinks(scene)[0]))
        edges = np.unique([0.0, *np.linspace(0.0131, 0.9873, 17), *kinks])
        self.panels = list(pairwise([*edges[np.append(True, np.diff(edges) > 1e-9)].tolist(), 1.0]))
        self._solve(self.panels)
        self.range = np.ptp(self._values(), axis=(0, 2))
        while (unresolved := self._unresolved()).any():
            halves = [(a, (a + b) / 2, b) for (a, b), no in zip(self.panels, unresolved, strict=True) if no]
            new = [half for each in halves for half in pairwise(each)]
            self._solve(new)
            kept = [panel for panel, no in zip(self.panels, unresolved, strict=True) if not no]
            self.panels = sorted(kept + new)

    def _solve(self, panels: list) -> None:
        for first in range(0, len(panels), 40):
            some = panels[first : first + 40]
            phase = np.concatenate([(a + b) / 2 + (b - a) / 2 * gauss(POINTS)[0] for a, b in some])
            solution = solve_patches(assemble(self.scene, scene_lines(self.scene, phase)))
            both = np.stack([solution.approach, solution.stiffness]).reshape(2, -1, POINTS)
            self.known |= dict(zip(some, both.transpose(1, 0, 2), strict=True))

    def _values(self) -> np.ndarray:
        return np.array([self.known[panel] for panel in self.panels])

    def _unresolved(self) -> np.ndarray:
        width, values = np.array([b - a for a, b in self.panels])[:, None], self._values()
        last = np.abs(values @ legendre_transform(POINTS)[-2:].T).sum(axis=-1)
        ends = values @ interpolation(POINTS, np.array([-1.0, 1.0])).T
        jump = np.abs(np.roll(ends[..., 0], -1, axis=0) - ends[..., 1])
        miss = width * np.maximum(np.maximum(last, jump), np.roll(jump, 1, axis=0)) / self.range
        return ((miss > TOLERANCE) & (width > LEAST)).any(axis=1)

    @property
    def cycle(self) -> MeshCycle:
        nodes, weights = gauss(POINTS)
        phase = np.concatenate([(a + b) / 2 + (b - a) / 2 * nodes for a, b in self.panels])
        weight = np.concatenate([(b - a) / 2 * weights for a, b in self.panels])
        approach, stiffness = self._values().transpose(1, 0, 2).reshape(2, -1)
        phases = Phases(phase=phase, weight=weight, size=POINTS)
        return MeshCycle.of(self.scene, phases, approach, stiffness)

    def peak_to_peak(self, curve: str) -> float:
        """Range of the samples, and of the polynomials on panels that they resolve."""
        values = getattr(self.cycle, curve).reshape(-1, POINTS)
        last = np.abs(values @ legendre_transform(POINTS)[-2:].T).sum(axis=-1)
        fine = values @ interpolation(POINTS, np.linspace(-1, 1, 41)).T
        fine = np.where((last < 4e-3 * np.ptp(values))[:, None], fine, values[:, :1])
        return float(np.ptp(np.concatenate([values.ravel(), fine.ravel()])))


def misses(scene: Scene, segments: int = 15) -> dict[str, float]:
    """What default settings miss over what they may, by name: noise floors that say so excuse it."""
    solved, halved = solve_scene(scene), Halved(replace(scene, resolution=Resolution(segments=segments)))
    found, truth, over = solved.cycle, halved.cycle, {}
    for curve in CURVES:
        mine, right = getattr(found, curve), getattr(truth, curve)
        floor = output(solved, f"{curve}_amplitude_noise_floor")[1][:8]
        total, whole = halved.peak_to_peak(curve), float(np.sqrt((floor**2).sum()))
        a, b = 2 * np.abs(coefficients(found.phases, mine, 8)), 2 * np.abs(coefficients(truth.phases, right, 8))
        over[f"{curve} harmonics"] = float(
            (np.abs(a - b) / np.maximum(np.maximum(0.05 * b, 2e-3 * total), floor)).max()
        )
        for name, of in (("mean", mean), ("rms", fluctuation_rms)):
            m, r = of(mine, found.phases.weight), of(right, truth.phases.weight)
            over[f"{curve} {name}"] = float(abs(m - r) / max(0.01 * abs(r), whole))
        miss = abs(float(found.curves[curve].peak_to_peak) - total)
        doubt = float(output(solved, f"{curve}_peak_to_peak_noise_floor")[1])
        over[f"{curve} peak_to_peak"] = miss / max(0.01 * total, doubt)
    return over


@pytest.mark.parametrize(
    ("name", "share"),
    [
        ("osu_50", 1.15),
        ("osu_50", 1.2),
        ("rim_17_43", 0.821),
        ("fine_pitch", 1.476),
        ("nasa_28", 0.821),
        ("thin_rim", 0.1),
        ("hcr_spur", 0.6124),
    ],
)
def test_load_transfers_next_to_ends_of_the_path_and_kinks_are_found(name, share):
    """Pairs loaded at the first coarse phase, and pairs that take up load close to a relief or as another sheds it."""
    over = misses(relieved(name, share, off_line=False))
    assert max(over.values()) < 1, over


def test_a_dip_between_two_load_transfers_that_no_sample_sees_is_in_the_noise_floor():
    """Its bottom, 7 % of peak-to-peak, is 0.0001 of the cycle wide; on 15 segments the last one makes it 13 %."""
    over = misses(scene := relieved("ross_62", np.linspace(0.1, 2.0, 90)[74], off_line=True), FINE)
    assert max(over.values()) < 1, over
    solved = solve_scene(scene)
    floor = output(solved, "mesh_stiffness_peak_to_peak_noise_floor")[1]
    assert floor > 0.04 * solved.cycle.curves["mesh_stiffness"].peak_to_peak


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_all_torques_on_the_line(name):
    found = {share: misses(relieved(name, share, off_line=False)) for share in SHARES}
    assert not {share: over for share, over in found.items() if max(over.values()) > 1}


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_all_torques_off_the_line(name):
    found = {share: misses(relieved(name, share, off_line=True)) for share in SHARES}
    doubtful = [share for share, over in found.items() if max(over.values()) > 1]
    again = {share: misses(relieved(name, share, off_line=True), FINE) for share in doubtful}
    beyond = {share: over for share, over in again.items() if max(over.values()) > 1}
    count, most = BEYOND.get(name, (0, 1.0))
    assert len(beyond) <= count
    assert all(max(over.values()) < most for over in beyond.values())


@pytest.mark.parametrize(
    ("name", "share", "off_line"),
    [*((name, share, False) for name in ("nasa_28", "osu_50") for share in (0.5, 1.0)), ("nasa_28", 1.0, True)],
)
def test_peak_to_peak_does_not_depend_on_gauss_points(name, share, off_line):
    """Off the line the STE dips beyond the corner of the relief: on a long panel 8 points missed 2 %."""
    scene = relieved(name, share, off_line)
    cycles = [
        solve_scene(replace(scene, resolution=Resolution(gauss_points=n))).cycle for n in (5, 8, 12, 16, 20, 24, 32, 40)
    ]
    for curve in CURVES:
        found = np.array([float(cycle.curves[curve].peak_to_peak) for cycle in cycles])
        np.testing.assert_allclose(found, found[-1], rtol=5e-3)


def test_patches_whose_points_do_not_move_are_made_once_for_each_problem():
    """The flanks of ``large_wheel`` touch along all their lines, under any load near its own."""
    scene = read_scene(EXAMPLES / "gears" / "large_wheel.toml").without("off_line_contact")
    problem = assemble(scene, scene_lines(scene, np.array([0.2, 0.7])))
    found = next_round(problem, guess := Guess.empty(problem), first_round(problem, guess).patches)
    again = next_round(problem, guess, found.patches)
    assert again.patches is found.patches
    other = next_round(under_shares(problem, np.array([1.1, 0.9])), guess, found.patches)
    assert other.patches.on_cells is not problem
    assert not np.array_equal(other.patches.problem.gap, found.patches.problem.gap)
