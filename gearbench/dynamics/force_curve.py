"""The whole force of a mesh over its displacement and phase: zero where flanks part, negative on the back flanks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.gaps import total_gap
from gearbench.contact.look import scene_lines
from gearbench.contact.solver import solve
from gearbench.dynamics.loaded_mesh import Flanks, LoadedMesh

#: Rounding of the corner where flanks touch, over the mean deflection: some hundredths of a micrometre.
ROUNDING = 0.01
#: Reach of the table over the mean deflection, and its points.
REACH, POINTS = 8.0, 4000
#: Loads at which the contact is solved, relative to the mean force.
LEVELS = (0.003, 0.01, 0.03, 0.08, 0.16, 0.3, 0.5, 0.75, 1.0, 1.4, 2.0, 3.0, 5.0)


@dataclass(frozen=True, kw_only=True)
class Beside:
    """Rows beside the approach, about the contact under the mean force at equal steps of the phase; see (D9).

    Parameters
    ----------
    couple
        κ_j = K_0j/K_00 (phase, j).
    motion, force
        Motions [mm] and resultants [N] at rest (phase, j).
    stiffness
        K_ij − K_0i K_0j/K_00 (phase, i, j) [N/mm].
    """

    couple: NDArray
    motion: NDArray
    force: NDArray
    stiffness: NDArray

    @classmethod
    def of(cls, flanks: Flanks) -> Beside:
        """Linear about these flanks."""
        K = flanks.stiffness
        couple = K[:, 0, 1:] / K[:, :1, 0]
        return cls(
            couple=couple,
            motion=flanks.motion[:, 1:],
            force=flanks.force[:, 1:],
            stiffness=K[:, 1:, 1:] - couple[:, :, None] * K[:, :1, 1:],
        )


def _loaded(rest: NDArray, slope: NDArray, level: float, mean: float) -> NDArray:
    """Resultants (phase, j) [N] at ``level`` times the ``mean`` force: at rest with a slope, below it a parabola."""
    if level > 1:
        return rest + slope * (level - 1) * mean
    return level * (rest + (slope * mean - rest) * (level - 1))


@dataclass(frozen=True, kw_only=True)
class ForceCurve:
    """F(x, τ) at equal steps of the phase (D9): force of the drive flanks less that of the back flanks.

    Parameters
    ----------
    beside
        What tilt and bending add.
    begin
        x below which the drive flanks carry no load (phase,) [mm].
    table
        Force of the drive flanks at equal steps of x from there (phase, point) [N]; linear between them and beyond.
    spacing
        Step of x [mm].
    backlash
        Play along the line of action [mm].
    mirrored
        Phase (phase,), as a real number, at which the back flanks are in the position of the drive flanks.
    """

    beside: Beside
    begin: NDArray
    table: NDArray
    spacing: float
    backlash: float
    mirrored: NDArray

    @property
    def steps(self) -> int:
        """Steps of the phase."""
        return len(self.begin)

    def force(self, x: NDArray) -> NDArray:
        """Force [N] at x (…, phase) [mm]: readable version of the compiled one."""
        low = np.floor(self.mirrored).astype(int)
        f, part = self._drive(x, np.arange(self.steps)), self.mirrored - low
        for index, weight in ((low % self.steps, 1 - part), ((low + 1) % self.steps, part)):
            f = f - weight * self._drive(-x - self.backlash, index)
        return f

    def _drive(self, x: NDArray, phase: NDArray) -> NDArray:
        at = np.maximum((x - self.begin[phase]) / self.spacing, 0.0)
        j = np.minimum(at.astype(int), self.table.shape[1] - 2)
        low, high = self.table[phase, j], self.table[phase, j + 1]
        return low + (at - j) * (high - low)


def force_curve(cycle: LoadedMesh, steps: int) -> ForceCurve:
    """Curve of a mesh from its contact on its shafts at several loads, less what the shafts yield by themselves.

    Back flanks are assumed to be mirrored drive flanks.
    """
    from scipy.interpolate import PchipInterpolator

    scene, pair = cycle.scene, cycle.scene.pair
    phase, unit = np.arange(steps) / steps, scene.F_bt / float(cycle.mean_stiffness[0, 0])
    flanks, C = cycle.at(phase), cycle.compliance
    beside = Beside.of(flanks)
    # S on the shafts: they tilt as the force grows
    S = np.linalg.solve(np.eye(len(C)) + flanks.stiffness @ C, flanks.stiffness)
    lines = scene_lines(scene, phase)
    cos_b = math.cos(pair.meshing.beta_b)
    gap = np.where(lines.active[..., None], total_gap(cycle.effects, lines), np.inf)
    touch = gap.min(axis=(1, 2)) / cos_b
    # tilt and bending at rest belong to the approach of flanks that carry nothing
    forces, knots = [0.0], [touch - (beside.couple * beside.motion).sum(axis=1)]
    for level in LEVELS:
        loaded = replace(scene, load=replace(scene.load, torque=level * scene.load.torque))
        approach = solve(assemble(loaded, lines, cycle.effects)).approach / cos_b
        others = _loaded(beside.force, S[:, 0, 1:] / S[:, :1, 0], level, scene.F_bt)
        force = np.column_stack([np.full(steps, loaded.F_bt), others])
        moved = (-force @ C[:, 1:] - beside.motion) * beside.couple
        knots.append(approach - force @ C[0] + moved.sum(axis=1))
        forces.append(loaded.F_bt)
    # the least gap of all segments may lie above what cells along which it varies yield to the least load
    knots[0] = np.minimum(knots[0], knots[1] - 0.1 * LEVELS[0] * unit)
    x = np.maximum.accumulate(np.array(knots).T, axis=1) + np.arange(len(knots)) * 1e-12
    # the corner where flanks touch is rounded: d → (d + ε)²/4ε within ±ε
    ε, spacing = ROUNDING * unit, REACH * unit / POINTS
    d = spacing * np.arange(POINTS + 1) - ε
    d = np.where(d < ε, (d + ε) ** 2 / (4 * ε), d)
    table = np.empty((steps, len(d)))
    for i in range(steps):
        curve = PchipInterpolator(x[i], forces)
        inside, slope = np.minimum(x[i, 0] + d, x[i, -1]), float(curve.derivative()(x[i, -1]))
        table[i] = curve(inside) + slope * (x[i, 0] + d - inside)
    pinion, r_w = pair.gears[0], pair.gears[0].base_radius / math.cos(pair.meshing.alpha_wt)
    centred = (pair.meshing.pitch_point - pair.meshing.path_start) / pair.meshing.base_pitch
    centred += float(pinion.half_angle(r_w)) * pair.pinion.teeth / (2 * math.pi)
    return ForceCurve(
        beside=beside,
        begin=x[:, 0] - ε,
        table=table,
        spacing=spacing,
        # an overlap is the rounding of the data, not a preload
        backlash=max(pair.actual_backlash, 0.0) * math.cos(pair.meshing.alpha_wt),
        mirrored=((2 * centred - phase) * steps) % steps,
    )
