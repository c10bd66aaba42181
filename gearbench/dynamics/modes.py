"""Modes of the system with its mean mesh stiffnesses, and their response to forces at the meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.size import in_blocks
from gearbench.errors import InputError
from gearbench.system.mechanics import Mechanics

#: Shift σ of the eigenvalue problem, relative to k̄/m of the stiffest mesh.
_SHIFT = 1e-3
#: Modes with ω² below this multiple of σ are rigid-body motions.
_RIGID = 1e-6


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Modes and receptances of the system whose meshes are springs of their mean stiffness, (D4) of docs/theory.md.

    Parameters
    ----------
    frequency
        ω_r (mode,) [rad/s], ascending; 0 for rigid-body modes.
    damping_ratio
        ζ (mode,).
    shape
        φ_r with unit modal mass, in all coordinates of the system (n, mode).
    mesh, rotation
        ``mesh``: a_m · φ_r, the negative relative motion of each mesh row per mode (row, mode). ``rotation``: the part
        of it in the approaches that is due to the rotation of the gears, the negative transmission error (mesh, mode).
    bearing
        Force on the bearings per mode (``Model``), or motion of the bodies (``TrainModel``), (bearing, 3, mode).
    ripples
        Modal force of the torque ripples (ripple, mode).
    dampers
        Elongation of the viscous dampers per mode (damper, mode), and damper constants (damper,) [N·s/mm].
    stiffness
        Mean stiffness K̄ of the meshes (row, row) [N/mm].
    """

    frequency: NDArray
    damping_ratio: NDArray
    shape: NDArray
    mesh: NDArray
    rotation: NDArray
    bearing: NDArray
    ripples: NDArray
    dampers: tuple[NDArray, NDArray]
    stiffness: NDArray

    def _dynamic(self, omega: NDArray) -> tuple[NDArray, NDArray]:
        """Real and imaginary part of 1/(ω_r² − ω² + 2iζω_rω), (…, mode).

        Raises
        ------
        InputError
            If an order meets an undamped mode.
        """
        w, r = omega[..., None], self.frequency
        real, imaginary = r**2 - w**2, (2 * self.damping_ratio * r) * w
        size = real**2 + imaginary**2
        # a rigid-body mode has no static response
        size = np.where((r == 0) & (w == 0), 1.0, size)
        if (size == 0).any():
            f = r[np.argwhere(size == 0)[0, -1]] / (2 * np.pi)
            raise InputError("system.damping_ratio", 0.0, f"an order excites the undamped mode at {f:.6g} Hz")
        return real / size, -imaginary / size

    def _damped(self, omega: NDArray, g: tuple[NDArray, NDArray]) -> tuple[NDArray, NDArray]:
        """iωc of the viscous dampers (frequency, damper, 1), and 1 + iωc times the receptances between them."""
        rows, constants = self.dampers
        damping = (1j * omega[:, None] * constants)[..., None]
        return damping, np.eye(len(constants)) + damping * _summed(rows, g, rows)

    def mesh_receptance(self, omega: NDArray, rows: NDArray) -> NDArray:
        """ĥ (D4): negative motion of each of the mesh ``rows`` per force on each of them, (…, row, row) [mm/N].

        It holds at any real frequencies ``omega`` (…,); the dampers act as forces.
        """
        mesh, dampers, frequencies = self.mesh[rows], self.dampers[0], omega.ravel()
        receptance = np.empty((omega.size, len(mesh), len(mesh)), dtype=complex)
        for block in in_blocks(omega.size, len(self.frequency)):
            g = self._dynamic(frequencies[block])
            receptance[block] = _summed(mesh, g, mesh)
            if len(dampers):
                damping, coupled = self._damped(frequencies[block], g)
                by_dampers = np.linalg.solve(coupled, damping * _summed(dampers, g, mesh))
                receptance[block] -= _summed(mesh, g, dampers) @ by_dampers
        return receptance.reshape(*omega.shape, len(mesh), len(mesh))

    def response_to_forces(self, omega: NDArray, force: NDArray, rows: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Response of the system to forces ``force`` (…, row) at the frequencies ``omega`` (…,).

        ``rows`` (row, mode) are the modal components of the forces: rows of ``mesh`` for mesh forces.

        Returns
        -------
        Transmission errors (…, mesh), motions of all meshes (…, row), and forces on the bearings (…, bearing, 3).
        """
        outputs = np.concatenate([-self.rotation, -self.mesh, self.bearing.reshape(-1, len(self.frequency))]).T
        w, forces, dampers = omega.ravel(), force.reshape(-1, len(rows)), self.dampers[0]
        response = np.empty((len(w), outputs.shape[1]), dtype=complex)
        for block in in_blocks(len(w), len(self.frequency)):
            real, imaginary = self._dynamic(w[block])
            g, load = real + 1j * imaginary, forces[block] @ rows
            if len(dampers):
                damping, coupled = self._damped(w[block], (real, imaginary))
                load = load - np.linalg.solve(coupled, damping * ((g * load) @ dampers.T)[..., None])[..., 0] @ dampers
            q = g * load
            response[block] = q.real @ outputs + 1j * (q.imag @ outputs)
        te, motion, bearing = np.split(
            response.reshape(*omega.shape, -1), np.cumsum([len(self.rotation), len(self.mesh)]), -1
        )
        return te, motion, bearing.reshape(*omega.shape, -1, 3)

    @property
    def participation(self) -> NDArray:
        """Share (mesh, mode) of each mode in the static compliance at each mesh; 0 for rigid-body modes."""
        elastic = np.where(self.frequency > 0, self.frequency, np.inf)
        # the first row of a mesh is its approach
        share = self.mesh[:: len(self.mesh) // len(self.rotation)] ** 2 / elastic**2
        return share / np.maximum(share.sum(axis=1, keepdims=True), 1e-300)


def _summed(left: NDArray, g: tuple[NDArray, NDArray], right: NDArray) -> NDArray:
    """Σ_r left_ir g_r right_jr, (…, left, right), as real matrix products for all frequencies at once."""
    real, imaginary = g
    both = (left[:, None] * right).reshape(-1, real.shape[-1]).T
    return (real @ both + 1j * (imaginary @ both)).reshape(*real.shape[:-1], len(left), len(right))


def modes(
    mechanics: Mechanics, stiffness: NDArray, damping_ratio: float, by_mode: Sequence[tuple[float, float]] = ()
) -> Modes:
    """Solve the eigenvalue problem of M and K + aᵀ K̄ a, undamped.

    Parameters
    ----------
    mechanics
        The system without mesh stiffness.
    stiffness
        Mean stiffness K̄ of the meshes (row, row) [N/mm].
    damping_ratio
        ζ of every mode.
    by_mode
        Pairs (frequency [Hz], ζ) that replace ``damping_ratio``; ζ is linear between them.

    Raises
    ------
    InputError
        If a movable part has no mass.
    """
    from scipy.linalg import LinAlgError, eigh

    a, k = mechanics.mesh, np.asarray(stiffness, dtype=float)
    K = mechanics.stiffness + a.T @ k @ a
    # translations [mm, t] and rotations [rad, t·mm²] are scaled to unit mass
    scale = np.diag(mechanics.mass)
    if np.any(scale <= 0):
        raise InputError("system", "a part without mass", "every shaft and gear must have inertia")
    d = 1 / np.sqrt(scale)
    K, M = K * d[:, None] * d, mechanics.mass * d[:, None] * d
    # Shift and invert: M φ = μ (K + σM) φ has the eigenvalues μ = 1/(ω² + σ). The lowest modes have the largest μ, so
    # rounding errors fall on the highest modes. The shift σ keeps K + σM regular despite rigid-body modes; it is far
    # below ω² of the modes that deflect a mesh.
    sigma = _SHIFT * float(np.max(np.diag(k) * (a**2 @ d**2)))
    try:
        inverse, vectors = eigh(M, K + sigma * M)
    except LinAlgError:
        inverse, vectors = np.zeros(1), K  # refused below
    if inverse[0] <= 0:
        raise InputError("system", "mass matrix not positive", "every shaft and gear must have inertia")
    values = 1 / inverse[::-1] - sigma
    # rounding gives a rigid-body mode a small ω² of either sign, far below that of any coupling
    values = np.where(np.abs(values) < _RIGID * sigma, 0.0, values)
    shape = d[:, None] * (vectors / np.sqrt(inverse))[:, ::-1]
    rigid = values == 0
    mesh = a @ shape
    # a rigid-body mode does not deflect any mesh, otherwise the mesh would give it stiffness
    mesh[:, rigid] = 0.0
    rotation = mechanics.rotation @ shape
    rotation[:, rigid] = 0.0
    damping = np.array([*by_mode] or [(0.0, damping_ratio)])
    return Modes(
        frequency=np.sqrt(values),
        damping_ratio=np.interp(np.sqrt(values) / (2 * np.pi), *damping.T),
        shape=shape,
        mesh=mesh,
        rotation=rotation,
        bearing=mechanics.bearing @ shape,
        ripples=np.zeros((0, len(values))) if mechanics.ripples is None else mechanics.ripples @ shape,
        dampers=(mechanics.damping[0] @ shape, mechanics.damping[1]),
        stiffness=k,
    )
