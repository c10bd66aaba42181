"""Force of a mesh over approach and phase, loss of contact included: zero in the backlash, negative on back flanks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import total_gap
from gearbench.contact.solver import solve
from gearbench.dynamics.loaded_mesh import FlankState, LoadedMesh
from gearbench.trains.scatter import curves
from gearbench.trains.solve import SolvedTrain

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

#: Half width of the rounded corner at first contact, divided by the mean deflection: some hundredths of a micrometre.
ROUNDING = 0.01
#: Largest approach of the table, divided by the mean deflection.
REACH = 8.0
#: Number of intervals of the table.
POINTS = 4000
#: Loads at which the contact is solved, divided by the mean force.
LEVELS = (0.003, 0.01, 0.03, 0.08, 0.16, 0.3, 0.5, 0.75, 1.0, 1.4, 2.0, 3.0, 5.0)
#: Largest force of a mesh of a train, divided by that under equal sharing, at which its contact is solved.
LARGEST_FORCE = 6.0


@dataclass(frozen=True, kw_only=True)
class TiltAndBending:
    """Tilt and bending of the flanks (rows j = 1, 2 of ``FlankState``), linearised about the contact at the mean force.

    See (D9) of docs/theory.md. All arrays are at equal steps of the mesh phase.

    Parameters
    ----------
    coupling
        κ_j = K_0j/K_00 (phase, j).
    motion, force
        Quasi-static motions x_s [mm] and resultants f_s [N] (phase, j).
    stiffness
        K_ij − K_0i K_0j/K_00 (phase, i, j) [N/mm].
    """

    coupling: NDArray
    motion: NDArray
    force: NDArray
    stiffness: NDArray

    @classmethod
    def of(cls, flanks: FlankState) -> TiltAndBending:
        """Linearise the rows about ``flanks``."""
        K = flanks.stiffness
        coupling = K[:, 0, 1:] / K[:, :1, 0]
        return cls(
            coupling=coupling,
            motion=flanks.motion[:, 1:],
            force=flanks.force[:, 1:],
            stiffness=K[:, 1:, 1:] - coupling[:, :, None] * K[:, :1, 1:],
        )


def _resultants_at(mean_resultants: NDArray, slope: NDArray, level: float, mean: float) -> NDArray:
    """Resultants (phase, j) [N] of tilt and bending at ``level`` times the ``mean`` force.

    Above the mean force they grow linearly, by ``slope`` (phase, j) per force; below it they follow a parabola to zero.
    """
    if level > 1:
        return mean_resultants + slope * (level - 1) * mean
    return level * (mean_resultants + (slope * mean - mean_resultants) * (level - 1))


@dataclass(frozen=True, kw_only=True)
class ForceCurve:
    """F(x, τ) at equal steps of the phase: force of the drive flanks minus force of the back flanks.

    See (D9) of docs/theory.md.

    Parameters
    ----------
    tilt_and_bending
        Linearised tilt and bending, at the same phases.
    begin
        Approach x at which the drive flanks begin to carry load (phase,) [mm].
    table
        Force of the drive flanks at equal steps of x from ``begin`` (phase, point) [N]; linear between and beyond.
    spacing
        Step of x [mm].
    backlash
        Play along the line of action [mm].
    back_phase
        Fractional index of the phase 2τ_0 − τ of (D9) (phase,): the drive flanks there mirror the back flanks at τ.
    """

    tilt_and_bending: TiltAndBending
    begin: NDArray
    table: NDArray
    spacing: float
    backlash: float
    back_phase: NDArray

    @property
    def steps(self) -> int:
        """Number of steps of the phase."""
        return len(self.begin)


def force_curve(mesh: LoadedMesh, steps: int) -> ForceCurve:
    """Compute the curve of a mesh: solve its contact on the shafts at several loads, then subtract the shafts' part.

    Back flanks are assumed to mirror the drive flanks.
    """
    from scipy.interpolate import PchipInterpolator

    scene, pair = mesh.scene, mesh.scene.pair
    phase, deflection = np.arange(steps) / steps, scene.F_bt / float(mesh.mean_stiffness[0, 0])
    flanks, C = mesh.at(phase), mesh.compliance
    tilt_and_bending = TiltAndBending.of(flanks)
    # (W14) of docs/theory.md solved for S, the stiffness of flanks and shafts together; f_j grows by S_0j/S_00 with f_0
    S = np.linalg.solve(np.eye(len(C)) + flanks.stiffness @ C, flanks.stiffness)
    lines = scene_lines(scene, phase)
    cos_b = math.cos(pair.meshing.beta_b)
    gap = np.where(lines.active[..., None], total_gap(mesh.effects, lines), np.inf)
    first_contact = gap.min(axis=(1, 2)) / cos_b
    # x at first contact: the formula below with the force 0
    forces, approaches = [0.0], [first_contact - (tilt_and_bending.coupling * tilt_and_bending.motion).sum(axis=1)]
    for level in LEVELS:
        loaded = replace(scene, load=replace(scene.load, torque=level * scene.load.torque))
        approach = solve(assemble(loaded, lines, mesh.effects)).approach / cos_b
        resultants = _resultants_at(tilt_and_bending.force, S[:, 0, 1:] / S[:, :1, 0], level, scene.F_bt)
        force = np.column_stack([np.full(steps, loaded.F_bt), resultants])
        # x = x_0 + κ_j (x_j − x_s,j), with the motions x_0 = δ − C_0·f and x_j = −C_j·f of the flanks off the shafts
        by_tilt_and_bending = (-force @ C[:, 1:] - tilt_and_bending.motion) * tilt_and_bending.coupling
        approaches.append(approach - force @ C[0] + by_tilt_and_bending.sum(axis=1))
        forces.append(loaded.F_bt)
    # the smallest gap of the segments may exceed the approach at the smallest load: the gap varies within a segment
    approaches[0] = np.minimum(approaches[0], approaches[1] - 0.1 * LEVELS[0] * deflection)
    # ascending even where rounding makes two approaches equal
    x = np.maximum.accumulate(np.array(approaches).T, axis=1) + np.arange(len(approaches)) * 1e-12
    begin, table, spacing = _rounded([PchipInterpolator(approach, forces) for approach in x], deflection)
    pinion, r_w = pair.gears[0], pair.gears[0].base_radius / math.cos(pair.meshing.alpha_wt)
    # mesh phase at which the middle of a pinion tooth is on the line of centres: the flanks mirror each other about it
    centred = (pair.meshing.pitch_point - pair.meshing.path_start) / pair.meshing.base_pitch
    centred += float(pinion.half_angle(r_w)) * pair.pinion.teeth / (2 * math.pi)
    return ForceCurve(
        tilt_and_bending=tilt_and_bending,
        begin=begin,
        table=table,
        spacing=spacing,
        # a negative backlash comes from rounded data, not from preload
        backlash=max(pair.actual_backlash, 0.0) * math.cos(pair.meshing.alpha_wt),
        back_phase=((2 * centred - phase) * steps) % steps,
    )


def _rounded(curves: Sequence[PPoly], deflection: float) -> tuple[NDArray, NDArray, float]:
    """``begin``, ``table`` and ``spacing`` of a ``ForceCurve``, from force over approach at each phase.

    The corner where flanks touch is rounded: d → (d + ε)²/4ε within ±ε. ``deflection`` is that under the mean force.
    """
    ε, spacing = ROUNDING * deflection, REACH * deflection / POINTS
    d = spacing * np.arange(POINTS + 1) - ε
    d = np.where(d < ε, (d + ε) ** 2 / (4 * ε), d)
    table = np.empty((len(curves), len(d)))
    for row, curve in zip(table, curves, strict=True):
        x = curve.x[0] + d
        inside, slope = np.minimum(x, curve.x[-1]), float(curve.derivative()(curve.x[-1]))
        row[:] = curve(inside) + slope * (x - inside)
    return np.array([curve.x[0] for curve in curves]) - ε, table, spacing


def train_force_curves(solved: SolvedTrain, deflection: float) -> list[ForceCurve]:
    """Curves of the meshes of a train, each over its own period; the phases of ``solved`` are uniform.

    Each is for the teeth and gear bodies of one mesh, without the deflection of its bodies under other meshes. Back
    flanks are left out: their distance is infinite. ``deflection`` [mm] is that under the mean force.
    """
    from scipy.interpolate import CubicHermiteSpline

    of_meshes, count, found = curves(solved, LARGEST_FORCE), len(solved.phases.phase), []
    for m, periods in enumerate(solved.linkage.train.periods.values()):
        own = slice(count // periods)
        x, F, k = (values[m, own] for values in (of_meshes.approach, of_meshes.force, of_meshes.slope))
        # the curve begins on the tangent at the smallest force
        x = np.column_stack([x[:, 0] - F[:, 0] / k[:, 0], x])
        F, k = np.pad(F, [(0, 0), (1, 0)]), np.column_stack([k[:, 0], k])
        splines = [CubicHermiteSpline(*of_phase) for of_phase in zip(x, F, k, strict=True)]
        begin, table, spacing = _rounded(splines, deflection)
        none = np.zeros((len(x), 0))
        found.append(
            ForceCurve(
                tilt_and_bending=TiltAndBending(coupling=none, motion=none, force=none, stiffness=none[..., None]),
                begin=begin,
                table=table,
                spacing=spacing,
                backlash=math.inf,
                back_phase=np.zeros(len(x)),
            )
        )
    return found
