"""One mesh with its whole force curve on a linear system: harmonic balance in alternation of frequency and time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.balance import block_rows
from gearbench.dynamics.force_curve import ForceCurve
from gearbench.dynamics.model import Group, Model
from gearbench.dynamics.stability import multipliers


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
        return float(self.model.force[mesh] / self.model.stiffness[mesh, mesh])

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
        k_mean, mean = self.model.stiffness[mesh, mesh], self.model.force[mesh]
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
        between = (k + np.roll(k, -1, axis=-1)) / 2
        return multipliers(self.model.modes, self.group.meshes, omega, between[..., None, None])
