"""The whole force of a mesh over its displacement and phase: zero where flanks part, negative on the back flanks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, scene_lines
from gearbench.contact.gaps import total_gap
from gearbench.contact.solver import solve
from gearbench.dynamics.loaded_mesh import LoadedMesh

#: Rounding of the corner where flanks touch, over the mean deflection: some hundredths of a micrometre.
ROUNDING = 0.01
#: Forces over the mean force at which the contact is solved.
LEVELS = (0.003, 0.01, 0.03, 0.08, 0.16, 0.3, 0.5, 0.75, 1.0, 1.4, 2.0, 3.0, 5.0)


@dataclass(frozen=True, kw_only=True)
class ForceCurve:
    """F(x, τ) at equal steps of the phase (D9); drive flanks touch above ``touch``, back flanks below ``back``.

    Parameters
    ----------
    knots
        x (phase, level) [mm], ascending; the first is where F begins.
    coefficients
        Cubic pieces of F (phase, level, 4), highest power first; linear beyond the last.
    backlash
        Play along the line of action [mm].
    mirrored
        Phase (phase,), fraction and all, at which the back flanks stand as the drive flanks do.
    rounding
        ε [mm]: the corner where F begins is rounded within ± ε, as rough flanks round it.
    """

    knots: NDArray
    coefficients: NDArray
    backlash: float
    mirrored: NDArray
    rounding: float

    @property
    def steps(self) -> int:
        """Steps of the phase."""
        return len(self.knots)

    def force(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Force [N] and stiffness [N/mm] at x (…, phase) [mm]."""
        here = np.arange(self.steps)
        f, k = self._drive(x, here)
        low = np.floor(self.mirrored).astype(int)
        part = self.mirrored - low
        for index, weight in ((low % self.steps, 1 - part), ((low + 1) % self.steps, part)):
            fb, kb = self._drive(-x - self.backlash, index)
            f, k = f - weight * fb, k + weight * kb
        return f, k

    def _drive(self, x: NDArray, phase: NDArray) -> tuple[NDArray, NDArray]:
        knots = self.knots[phase]
        # the corner where flanks touch is rounded: d → (d + ε)²/4ε within ±ε, else max(d, 0)
        d, eps = x - knots[:, 0], self.rounding
        into = np.clip((d + eps) / (2 * eps), 0.0, 1.0)
        d = np.where(d < eps, eps * into**2, d)
        level = np.maximum((d[..., None] > knots - knots[:, :1]).sum(axis=-1) - 1, 0)
        d = d - (knots[np.arange(len(phase)), level] - knots[:, 0])
        c3, c2, c1, c0 = np.moveaxis(self.coefficients[phase, level], -1, 0)
        return ((c3 * d + c2) * d + c1) * d + c0, into * ((3 * c3 * d + 2 * c2) * d + c1)


def force_curve(cycle: LoadedMesh, steps: int) -> ForceCurve:
    """Curve of a mesh from its contact on its shafts at several loads, less what the shafts yield by themselves.

    Back flanks are taken to be like drive flanks, mirrored.
    """
    from scipy.interpolate import PchipInterpolator

    scene, pair = cycle.scene, cycle.scene.pair
    shafts, mean_stiffness = float(cycle.compliance[0, 0]), float(cycle.mean_stiffness[0, 0])
    phase = np.arange(steps) / steps
    lines = scene_lines(scene, phase)
    cos_b = math.cos(pair.meshing.beta_b)
    gap = np.where(lines.active[..., None], total_gap(scene, lines, cycle.effects), np.inf)
    touch = gap.min(axis=(1, 2)) / cos_b
    forces, knots = [0.0], [touch]
    for level in LEVELS:
        loaded = replace(scene, load=replace(scene.load, torque=level * scene.load.torque))
        approach = solve(assemble(loaded, lines, cycle.effects)).approach / cos_b
        knots.append(approach - shafts * loaded.F_bt)
        forces.append(loaded.F_bt)
    # the least gap of all segments may lie above what cells along which it varies yield to the least load
    knots[0] = np.minimum(touch, knots[1] - 0.1 * LEVELS[0] * scene.F_bt / mean_stiffness)
    x = np.maximum.accumulate(np.array(knots).T, axis=1) + np.arange(len(knots)) * 1e-12
    coefficients = np.empty((steps, len(forces), 4))
    for i in range(steps):
        curve = PchipInterpolator(x[i], forces)
        coefficients[i, :-1] = curve.c.T
        end = x[i, -1]
        coefficients[i, -1] = (0.0, 0.0, float(curve.derivative()(end)), forces[-1])
    pinion, r_w = pair.gears[0], pair.gears[0].base_radius / math.cos(pair.meshing.alpha_wt)
    centred = (pair.meshing.pitch_point - pair.meshing.path_start) / pair.meshing.base_pitch
    centred += float(pinion.half_angle(r_w)) * pair.pinion.teeth / (2 * math.pi)
    return ForceCurve(
        knots=x,
        coefficients=coefficients,
        # an overlap is the rounding of the data, not a preload
        backlash=max(pair.actual_backlash, 0.0) * math.cos(pair.meshing.alpha_wt),
        mirrored=((2 * centred - phase) * steps) % steps,
        rounding=ROUNDING * scene.F_bt / mean_stiffness,
    )
