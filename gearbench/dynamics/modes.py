"""Modes of the system with its mean mesh stiffness, and what they make of a force at the meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.size import in_blocks
from gearbench.errors import InputError
from gearbench.system.mechanics import Mechanics

#: σ over k̄/m of the stiffest mesh.
_SHIFT = 1e-3


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Receptances of the system whose meshes are springs of their mean stiffness (D4).

    Parameters
    ----------
    frequency
        ω_r (mode,) [rad/s], ascending; 0 for rigid bodies.
    damping_ratio
        ζ of every mode.
    mesh
        a_m · φ_r (mesh, mode).
    bearing
        Force on the bearings per mode (bearing, 3, mode).
    dampers
        Rows of the viscous dampers per mode (d, mode), and their constants [N·s/mm].
    stiffness
        Mean mesh stiffnesses (mesh,) [N/mm].
    """

    frequency: NDArray
    damping_ratio: float
    mesh: NDArray
    bearing: NDArray
    dampers: tuple[NDArray, NDArray]
    stiffness: NDArray

    def _dynamic(self, omega: NDArray) -> tuple[NDArray, NDArray]:
        """Real and imaginary part of 1/(ω_r² − ω² + 2iζω_rω), (…, mode).

        ``InputError`` where nothing damps a mode that is met.
        """
        w, r = omega[..., None], self.frequency
        real, imaginary = r**2 - w**2, (2 * self.damping_ratio * r) * w
        size = real**2 + imaginary**2
        if self.damping_ratio == 0 and (size == 0).any():
            f = r[np.argwhere(size == 0)[0, -1]] / (2 * np.pi)
            raise InputError("system.damping_ratio", 0.0, f"an order meets the mode at {f:.6g} Hz: give it damping")
        return real / size, -imaginary / size

    def _between(self, left: NDArray, right: NDArray, omega: NDArray) -> NDArray:
        """Receptance (…, left, right) at ω > 0 between rows of modes; dampers joined to it by their forces."""
        each, found = omega.ravel(), np.empty((omega.size, len(left), len(right)), dtype=complex)
        for here in in_blocks(omega.size, len(self.frequency)):
            found[here] = self._at(left, right, each[here])
        return found.reshape(*omega.shape, len(left), len(right))

    def _at(self, left: NDArray, right: NDArray, omega: NDArray) -> NDArray:
        """The same at some ω (frequency,)."""
        g = self._dynamic(omega)
        rows, constants = self.dampers
        if not len(constants):
            return _summed(left, g, right)
        own = _summed(rows, g, rows)
        own[..., range(len(constants)), range(len(constants))] += 1 / (1j * omega[..., None] * constants)
        return _summed(left, g, right) - _summed(left, g, rows) @ np.linalg.solve(own, _summed(rows, g, right))

    def at_meshes(self, omega: NDArray, meshes: NDArray) -> NDArray:
        """ĥ_c: relative motion at each of ``meshes``, its sign turned, per force at each, (…, mesh, mesh) [mm/N]."""
        return self._between(self.mesh[meshes], self.mesh[meshes], omega)

    def at_bearings(self, omega: NDArray, meshes: NDArray) -> NDArray:
        """Force on the bearings (…, bearing·3, mesh) per force at each of the ``meshes``."""
        return self._between(self.bearing.reshape(-1, len(self.frequency)), self.mesh[meshes], omega)

    @property
    def participation(self) -> NDArray:
        """Share (mesh, mode) of each mode in the static compliance at each mesh; 0 for rigid bodies."""
        safe = np.where(self.frequency > 0, self.frequency, np.inf)
        share = self.mesh**2 / safe**2
        return share / np.maximum(share.sum(axis=1, keepdims=True), 1e-300)


def _summed(left: NDArray, g: tuple[NDArray, NDArray], right: NDArray) -> NDArray:
    """Σ_r left_ir g_r right_jr, (…, left, right): one real product for all frequencies."""
    real, imaginary = g
    both = (left[:, None] * right).reshape(-1, real.shape[-1]).T
    return (real @ both + 1j * (imaginary @ both)).reshape(*real.shape[:-1], len(left), len(right))


def modes(mechanics: Mechanics, stiffness: NDArray, damping_ratio: float) -> Modes:
    """Modes of M, K + Σ k̄_m a_m a_mᵀ.

    Parameters
    ----------
    mechanics
        The system, its meshes cut.
    stiffness
        k̄ (mesh,) [N/mm].
    damping_ratio
        ζ.

    Raises
    ------
    InputError
        If a part without mass can move.
    """
    from scipy.linalg import LinAlgError, eigh

    a, k = mechanics.mesh, np.asarray(stiffness, dtype=float)
    K = mechanics.stiffness + (a.T * k) @ a
    # mm and rad, t and t·mm² side by side: scaled to unit mass
    scale = np.diag(mechanics.mass)
    if np.any(scale <= 0):
        raise InputError("system", "a part without mass", "every shaft and gear must have inertia")
    d = 1 / np.sqrt(scale)
    K, M = K * d[:, None] * d, mechanics.mass * d[:, None] * d
    # shifted and inverted, 1/(ω² + σ): rounding then falls on the highest modes, not on the lowest, and meshes that act
    # against each other cancel; σ well below the modes of the meshes
    sigma = _SHIFT * float(np.max(k * (a**2 @ d**2)))
    try:
        inverse, vectors = eigh(M, K + sigma * M)
    except LinAlgError:
        inverse, vectors = np.zeros(1), K
    if inverse[0] <= 0:
        raise InputError("system", "mass matrix not positive", "every shaft and gear must have inertia")
    values = 1 / inverse[::-1] - sigma
    # rounding makes a rigid body's ω² of either sign
    values = np.where(np.abs(values) < 1e-11 * values[-1], 0.0, values)
    rows = d[:, None] * (vectors / np.sqrt(inverse))[:, ::-1]
    rigid = values == 0
    mesh = a @ rows
    # a rigid body does not move against its mate: no mesh would hold it otherwise
    mesh[:, rigid] = 0.0
    return Modes(
        frequency=np.sqrt(values),
        damping_ratio=damping_ratio,
        mesh=mesh,
        bearing=mechanics.bearing @ rows,
        dampers=(mechanics.damping[0] @ rows, mechanics.damping[1]),
        stiffness=k,
    )
