"""Modes of the system with its mean mesh stiffness, and their response to a force at the meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.size import in_blocks
from gearbench.errors import InputError
from gearbench.system.mechanics import Mechanics

#: σ over k̄/m of the stiffest mesh, and ω² over σ below which a motion is that of a rigid body.
_SHIFT, _RIGID = 1e-3, 1e-6


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Receptances of the system whose meshes are springs of their mean stiffness (D4).

    Parameters
    ----------
    frequency
        ω_r (mode,) [rad/s], ascending; 0 for rigid bodies.
    damping_ratio
        ζ (mode,).
    shape
        φ_r of unit modal mass, all motions of the system (n, mode).
    mesh, spin
        a_m · φ_r of the rows of the meshes (row, mode), and of their transmission errors (mesh, mode).
    bearing
        Force on the bearings per mode (bearing, 3, mode).
    push
        Work of the ripples per mode (ripple, mode).
    dampers
        Rows of the viscous dampers per mode (d, mode), and their constants [N·s/mm].
    stiffness
        Mean stiffness K̄ of the meshes (row, row) [N/mm].
    """

    frequency: NDArray
    damping_ratio: NDArray
    shape: NDArray
    mesh: NDArray
    spin: NDArray
    bearing: NDArray
    push: NDArray
    dampers: tuple[NDArray, NDArray]
    stiffness: NDArray

    def _dynamic(self, omega: NDArray) -> tuple[NDArray, NDArray]:
        """Real and imaginary part of 1/(ω_r² − ω² + 2iζω_rω), (…, mode).

        ``InputError`` if an order meets an undamped mode.
        """
        w, r = omega[..., None], self.frequency
        real, imaginary = r**2 - w**2, (2 * self.damping_ratio * r) * w
        size = real**2 + imaginary**2
        # a rigid body has no static response
        size = np.where((r == 0) & (w == 0), 1.0, size)
        if (size == 0).any():
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
        damping = (1j * omega[..., None] * constants)[..., None]
        joined = np.eye(len(constants)) + damping * _summed(rows, g, rows)
        return _summed(left, g, right) - _summed(left, g, rows) @ np.linalg.solve(
            joined, damping * _summed(rows, g, right)
        )

    def at_meshes(self, omega: NDArray, rows: NDArray) -> NDArray:
        """ĥ_c: motion in each of the ``rows`` of meshes, its sign turned, per force in each, (…, row, row) [mm/N]."""
        return self._between(self.mesh[rows], self.mesh[rows], omega)

    def everywhere(self, omega: NDArray, push: NDArray, rows: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Transmission errors (…, mesh), motions of all meshes (…, row) and forces on the bearings (…, bearing, 3).

        They answer forces ``push`` (…, row) in the ``rows`` of meshes at the frequencies ``omega`` (…,).
        """
        return self.driven(omega, push, self.mesh[rows])

    def driven(self, omega: NDArray, push: NDArray, rows: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """The same under forces on any rows of modes (row, mode)."""
        out = np.concatenate([-self.spin, -self.mesh, self.bearing.reshape(-1, len(self.frequency))]).T
        w, forces = omega.ravel(), push.reshape(-1, len(rows))
        found = np.empty((len(w), out.shape[1]), dtype=complex)
        for here in in_blocks(len(w), len(self.frequency)):
            real, imaginary = self._dynamic(w[here])
            g, load = real + 1j * imaginary, forces[here] @ rows
            dampers, constants = self.dampers
            if len(constants):
                damping = (1j * w[here, None] * constants)[..., None]
                joined = np.eye(len(constants)) + damping * _summed(dampers, (real, imaginary), dampers)
                load = load - np.linalg.solve(joined, damping * ((g * load) @ dampers.T)[..., None])[..., 0] @ dampers
            q = g * load
            found[here] = q.real @ out + 1j * (q.imag @ out)
        te, motion, bearing = np.split(found.reshape(*omega.shape, -1), np.cumsum([len(self.spin), len(self.mesh)]), -1)
        return te, motion, bearing.reshape(*omega.shape, -1, 3)

    @property
    def participation(self) -> NDArray:
        """Share (mesh, mode) of each mode in the static compliance of each mesh to its force; 0 for rigid bodies."""
        safe = np.where(self.frequency > 0, self.frequency, np.inf)
        share = self.mesh[:: len(self.mesh) // len(self.spin)] ** 2 / safe**2
        return share / np.maximum(share.sum(axis=1, keepdims=True), 1e-300)


def _summed(left: NDArray, g: tuple[NDArray, NDArray], right: NDArray) -> NDArray:
    """Σ_r left_ir g_r right_jr, (…, left, right): one real product for all frequencies."""
    real, imaginary = g
    both = (left[:, None] * right).reshape(-1, real.shape[-1]).T
    return (real @ both + 1j * (imaginary @ both)).reshape(*real.shape[:-1], len(left), len(right))


def modes(
    mechanics: Mechanics, stiffness: NDArray, damping_ratio: float, by_mode: Sequence[tuple[float, float]] = ()
) -> Modes:
    """Modes of M, K + aᵀ K̄ a.

    Parameters
    ----------
    mechanics
        The system, its meshes cut.
    stiffness
        K̄ of the meshes (row, row) [N/mm].
    damping_ratio
        ζ of every mode.
    by_mode
        Pairs of a frequency [Hz] and ζ there, in its place.

    Raises
    ------
    InputError
        If a part without mass can move.
    """
    from scipy.linalg import LinAlgError, eigh

    a, k = mechanics.mesh, np.asarray(stiffness, dtype=float)
    K = mechanics.stiffness + a.T @ k @ a
    # mm and rad, t and t·mm² side by side: scaled to unit mass
    scale = np.diag(mechanics.mass)
    if np.any(scale <= 0):
        raise InputError("system", "a part without mass", "every shaft and gear must have inertia")
    d = 1 / np.sqrt(scale)
    K, M = K * d[:, None] * d, mechanics.mass * d[:, None] * d
    # shifted and inverted, 1/(ω² + σ): rounding then falls on the highest modes, not on the lowest, and meshes that act
    # against each other cancel; σ well below the modes of the meshes
    sigma = _SHIFT * float(np.max(np.diag(k) * (a**2 @ d**2)))
    try:
        inverse, vectors = eigh(M, K + sigma * M)
    except LinAlgError:
        inverse, vectors = np.zeros(1), K
    if inverse[0] <= 0:
        raise InputError("system", "mass matrix not positive", "every shaft and gear must have inertia")
    values = 1 / inverse[::-1] - sigma
    # rounding of the inverse gives a rigid body a small ω² of either sign, below any coupling
    values = np.where(np.abs(values) < _RIGID * sigma, 0.0, values)
    rows = d[:, None] * (vectors / np.sqrt(inverse))[:, ::-1]
    rigid = values == 0
    mesh = a @ rows
    # a rigid body does not move against its mate: no mesh would hold it otherwise
    mesh[:, rigid] = 0.0
    spin = mechanics.spin @ rows
    spin[:, rigid] = 0.0
    table = np.array([*by_mode] or [(0.0, damping_ratio)])
    return Modes(
        frequency=np.sqrt(values),
        damping_ratio=np.interp(np.sqrt(values) / (2 * np.pi), *table.T),
        shape=rows,
        mesh=mesh,
        spin=spin,
        bearing=mechanics.bearing @ rows,
        push=np.zeros((0, len(values))) if mechanics.push is None else mechanics.push @ rows,
        dampers=(mechanics.damping[0] @ rows, mechanics.damping[1]),
        stiffness=k,
    )
