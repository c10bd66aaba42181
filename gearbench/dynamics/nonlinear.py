"""Response with loss of contact and back-side impact: harmonic balance with the force over time, followed in speed."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.dynamics import waves
from gearbench.dynamics.analysis import GROWTH, HARMONICS, check_speeds, modal_variables, spans
from gearbench.dynamics.balance import block_rows, orders, real
from gearbench.dynamics.continuation import at_fixed, follow
from gearbench.dynamics.force_curve import ForceCurve, force_curve
from gearbench.dynamics.model import Group, Model
from gearbench.dynamics.stability import multipliers
from gearbench.errors import GearbenchError
from gearbench.results.provenance import provenance
from gearbench.results.responses import described
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

#: Steps of the period at which the force is evaluated, at least, and for each order.
STEPS, PER_ORDER = 128, 8
#: First and longest step along the curve, in units of speed range and mean deflection.
FIRST, LONGEST = 2e-3, 0.05
#: Ways in which the speed changes.
SWEEPS = ("up", "down")


@dataclass(frozen=True, kw_only=True)
class Oscillator:
    """One mesh with its whole force curve, on a linear system; all else as ``balance`` (D10).

    Parameters
    ----------
    model, group
        The dynamic model, and the mesh in a group of its own.
    curve
        F(x, τ).
    harmonics
        H.
    speeds
        Lowest and highest speed [1/min]: 0 and 1 of the parameter.
    """

    model: Model
    group: Group
    curve: ForceCurve
    harmonics: int
    speeds: tuple[float, float]

    @cached_property
    def unit(self) -> float:
        """Unit of displacement: mean force over mean stiffness [mm]."""
        mesh = self.group.meshes[0]
        return float(self.model.force[mesh] / self.model.stiffness[mesh])

    @cached_property
    def _waves(self) -> tuple[NDArray, NDArray]:
        """Values at the steps per real unknown (step, n), and orders per values at the steps (n, step)."""
        n, t = np.arange(1, self.harmonics + 1), 2 * np.pi * np.arange(self.curve.steps) / self.curve.steps
        T = np.empty((len(t), 2 * self.harmonics + 1))
        T[:, 0], T[:, 1::2], T[:, 2::2] = 1.0, 2 * np.cos(np.outer(t, n)), -2 * np.sin(np.outer(t, n))
        back = T.T / len(t)
        back[1:] /= 2
        return T, back

    def speed(self, parameter: float | NDArray) -> NDArray:
        """Speed [1/min] at a parameter 0 … 1."""
        low, high = self.speeds
        return np.asarray(low + (high - low) * parameter)

    def values(self, z: NDArray) -> NDArray:
        """x (…, step) [mm] of unknowns (…, n)."""
        return self.unit * z @ self._waves[0].T

    def forces(self, z: NDArray) -> tuple[NDArray, NDArray]:
        """Force orders (…, n) real [N] and stiffness over time (…, step) [N/mm]."""
        f, k = self.curve.force(self.values(z))
        return f @ self._waves[1].T, k

    def system(self, z: NDArray, parameter: float) -> tuple[NDArray, NDArray, NDArray]:
        """R = x̂ + ĥ_c (f̂ − k̄ x̂), dimensionless, with its derivatives by z and by the parameter."""
        step = 1e-6
        mesh = self.group.meshes[0]
        k_mean, mean = self.model.stiffness[mesh], self.model.force[mesh]
        T, back = self._waves
        f, k = self.forces(z)
        near = np.array([parameter, parameter + step])
        h = self.model.receptances(self.group, self.speed(near), self.harmonics)
        B, B_next = block_rows(h)[:, 0, :, 0, :]
        push = f / self.unit - k_mean * z
        dpush = (back * k) @ T
        dpush[np.diag_indices_from(dpush)] -= k_mean
        residual, J = z + B @ push, np.eye(len(z)) + B @ dpush
        residual[0] = (f[0] - mean) / mean
        J[0] = ((back[0] * k) @ T) * self.unit / mean
        return residual, J, (B_next - B) @ push / step

    def multiplier(self, z: NDArray, parameter: NDArray) -> NDArray:
        """Largest Floquet multiplier (point,) of solutions (point, n)."""
        _, k = self.forces(z)
        omega = self.model.omega(self.group, self.speed(parameter))
        return multipliers(self.model.modes, self.group.meshes, omega, (k + np.roll(k, -1, axis=-1))[:, None] / 2)


def nonlinear_response(scene: Scene, *, speed: ArrayLike, harmonics: int = HARMONICS) -> xr.Dataset:
    """Steady response of the scene's own pair with loss of contact, as the speed rises and as it falls.

    The curve of all periodic solutions is followed around its folds; at each speed the first stable one along it is met
    when the speed rises, the last when it falls. Other meshes are springs of their mean stiffness.

    Parameters
    ----------
    scene
        With ``[system]``.
    speed
        Of the pinion [1/min].
    harmonics
        Orders of the mesh frequency.

    Returns
    -------
    Dataset with the dimensions ``sweep`` ("up", "down"), ``speed``, ``mesh``, ``harmonic``: NaN where no solution with
    the period of the mesh is stable. ``branches`` counts the solutions at each speed, stable or not.

    Raises
    ------
    InputError
        As ``response``.
    GearbenchError
        If the curve cannot be followed over the range of speeds.
    """
    start = time.perf_counter()
    speeds = check_speeds(speed)
    model = Model(scene=scene)
    first = model.groups[0]
    group = Group(meshes=first.meshes[:1], rate=first.rate, phase=first.phase[:1])
    low, high = float(speeds.min()), float(speeds.max())
    oscillator = Oscillator(
        model=model,
        group=group,
        curve=force_curve(model.cycles[0], max(STEPS, PER_ORDER * harmonics)),
        harmonics=harmonics,
        speeds=(low, high if high > low else 1.01 * low),
    )
    z, parameter = solution_curve(oscillator)
    found, growth, count = at_speeds(oscillator, z, parameter, speeds)
    return _dataset(oscillator, speeds, found, growth, count, start)


def solution_curve(oscillator: Oscillator) -> tuple[NDArray, NDArray]:
    """Solutions (point, n) and their parameters over the range of speeds, along the curve."""
    cycle = oscillator.model.cycles[0]
    rows = cycle.rows(oscillator.harmonics)
    quasi_static = real(rows @ cycle.error) / oscillator.unit
    first = at_fixed(oscillator.system, quasi_static, 0.0)
    if first is None:
        still = np.zeros_like(quasi_static)
        still[0] = quasi_static[0]
        first = at_fixed(oscillator.system, still, 0.0)
    if first is None:
        speed = float(oscillator.speed(0.0))
        raise GearbenchError(f"no periodic response found at {speed:.5g} 1/min: begin at another speed")
    return follow(oscillator.system, first, 0.0, 1.0, FIRST, LONGEST)


def at_speeds(
    oscillator: Oscillator, z: NDArray, parameter: NDArray, speeds: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Stable solutions (sweep, speed, n), their multipliers (sweep, speed), and the number of all of them (speed,)."""
    low, high = oscillator.speeds
    found = np.full((2, len(speeds), z.shape[1]), np.nan)
    growth = np.full((2, len(speeds)), np.nan)
    count = np.zeros(len(speeds), dtype=int)
    points, owners = [], []
    for k, wanted in enumerate((speeds - low) / (high - low)):
        before, after = parameter[:-1], parameter[1:]
        crossing = np.flatnonzero(((before <= wanted) & (after > wanted)) | ((before > wanted) & (after <= wanted)))
        if wanted >= parameter[-1]:
            crossing = np.append(crossing, len(parameter) - 2)
        for i in crossing:
            share = (wanted - before[i]) / (after[i] - before[i])
            point = at_fixed(oscillator.system, (1 - share) * z[i] + share * z[i + 1], float(wanted))
            if point is not None:
                points.append(point)
                owners.append(k)
                count[k] += 1
    solutions, owner = np.array(points).reshape(-1, z.shape[1]), np.array(owners, dtype=int)
    size = oscillator.multiplier(solutions, ((speeds - low) / (high - low))[owner])
    for k in range(len(speeds)):
        stable = np.flatnonzero((owner == k) & (size <= 1 + GROWTH))
        if len(stable):
            for sweep, at in enumerate((stable[0], stable[-1])):
                found[sweep, k], growth[sweep, k] = solutions[at], size[at]
    return found, growth, count


def _dataset(
    oscillator: Oscillator, speeds: NDArray, found: NDArray, growth: NDArray, count: NDArray, start: float
) -> xr.Dataset:
    import xarray as xr

    model, unit = oscillator.model, oscillator.unit
    te = orders(found) * unit
    force = orders(oscillator.forces(found)[0])
    mean = model.force[oscillator.group.meshes]
    over_time = oscillator.curve.force(oscillator.values(found))[0]
    over_time[np.isnan(growth)] = np.nan
    force[np.isnan(growth)] = np.nan
    dims = ("sweep", "speed", "mesh")
    variables = {
        "dynamic_transmission_error_amplitude": ((*dims, "harmonic"), 1e3 * waves.amplitude(te)[:, :, None]),
        "dynamic_transmission_error_phase": ((*dims, "harmonic"), waves.phase(te)[:, :, None]),
        "dynamic_transmission_error_rms": (dims, 1e3 * waves.rms(te)[:, :, None]),
        "mesh_force_amplitude": ((*dims, "harmonic"), waves.amplitude(force)[:, :, None]),
        "mesh_force_phase": ((*dims, "harmonic"), waves.phase(force)[:, :, None]),
        "mesh_force_rms": (dims, waves.rms(force)[:, :, None]),
        "mean_force": (("mesh",), mean),
        "dynamic_factor": (dims, (over_time.max(axis=-1) / mean)[:, :, None]),
        "contact_kept": (dims, ~(over_time.min(axis=-1) <= 0)[:, :, None]),
        "floquet_multiplier": (dims, growth[:, :, None]),
        "branches": (("speed",), count),
    }
    one = {k: v for k, v in modal_variables(model, speeds, oscillator.harmonics).items() if k == "natural_frequency"}
    lost = np.isnan(growth[0])
    notes = [] if not lost.any() else [f"no stable response with the mesh's period at {spans(speeds, lost)} 1/min"]
    jumps = ~np.isclose(found[0], found[1], rtol=1e-6, atol=1e-6, equal_nan=True).all(axis=-1)
    if jumps.any():
        notes.append(f"two stable responses, by the way the speed changes, at {spans(speeds, jumps)} 1/min")
    if oscillator.curve.backlash <= 0:
        notes.append("no backlash: back flanks touch as soon as drive flanks part")
    rate = np.array([oscillator.group.rate])
    coords = {
        "sweep": ("sweep", list(SWEEPS)),
        "speed": ("speed", speeds),
        "mesh": ("mesh", list(model.names[:1])),
        "harmonic": ("harmonic", np.arange(1, oscillator.harmonics + 1)),
        "mesh_frequency": (("speed", "mesh"), speeds[:, None] / 60 * rate),
    }
    attrs = provenance(model.scene, wall_time=time.perf_counter() - start) | {"notes": "\n".join(notes)}
    return xr.Dataset(described(variables | one), coords=described(coords), attrs=attrs)
