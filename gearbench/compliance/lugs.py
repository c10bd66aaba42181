"""Lugs that hold the outside of a ring: tractions on them, and what they take from the compliance of its teeth.

The ring is first held by springs κ against motions as a rigid body alone, so that it looks the same from all teeth.
Tractions t on the lugs, polynomials of arc and axis, then hold it, and forces on these springs take them away again.
With the displacement s of all of them under loads on the flanks and under themselves, and their own springs K,

    s = Rᵀ P + C t,    s = −K⁻¹ t    ⇒    the flanks move by − R (C + K⁻¹)⁻¹ Rᵀ P more (R12 of docs/theory.md),

K = −κ of the springs that are taken away, K⁻¹ = 0 of firm lugs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss, legendre_functions
from gearbench.threads import lazy

if TYPE_CHECKING:
    from gearbench.compliance.ring import Ring

#: Numbers of polynomials of a traction along the arc of a lug and along the axis.
ALONG, ACROSS = 3, 3
#: Functionals of a lug: polynomials of the traction along θ, R and the axis.
EACH = 3 * ALONG * ACROSS


@dataclass(frozen=True, kw_only=True)
class Lugs:
    """Parts of the outside where a ring is held.

    Parameters
    ----------
    angles
        Angles of their middles from tooth 0, along the arcs [rad].
    length
        Length along the circumference [mm].
    springs
        Stiffness, radial and along the edge [N/mm³]; None where they hold firmly.
    """

    angles: tuple[float, ...]
    length: float
    springs: tuple[float, float] | None = None

    @property
    def yields(self) -> NDArray:
        """K⁻¹ of the functionals (lug, field, k, j), fields θ, R, z."""
        if self.springs is None:
            return np.zeros(len(self.angles) * EACH)
        radial, along = self.springs
        return np.tile(np.repeat([1 / along, 1 / radial, 1 / along], ALONG * ACROSS), len(self.angles))


@dataclass(frozen=True, kw_only=True, eq=False)
class Anchors:
    """Reduction of the compliance of the teeth by the lugs.

    Parameters
    ----------
    reach
        R: displacement of the functionals under flank polynomials of each tooth, (tooth, p·q, functional) [mm/N].
    own
        C + K⁻¹ of the functionals.
    """

    reach: NDArray
    own: NDArray

    @lazy
    def grip(self) -> NDArray:
        """(C + K⁻¹)⁻¹; zero for tractions across the face that a ring of few functions along its axis does not feel."""
        size = np.abs(self.own).max(axis=1)
        felt = np.flatnonzero(size > 1e-9 * size.max())
        scale = 1 / np.sqrt(size[felt])
        both, out = scale[:, None] * scale, np.zeros_like(self.own)
        own = self.own[np.ix_(felt, felt)]
        out[np.ix_(felt, felt)] = both * np.linalg.inv(both * (own + own.T) / 2)
        return out

    def between(self, i: int, j: int) -> NDArray:
        """Displacement of tooth i under loads on tooth j that the lugs add, (p·q, p·q) [mm/N]."""
        z = len(self.reach)
        return -self.reach[i % z] @ self.grip @ self.reach[j % z].T

    def turned(self, teeth: int) -> Anchors:
        """The same where another tooth is tooth 0."""
        return Anchors(reach=np.roll(self.reach, -teeth, axis=0), own=self.own) if teeth else self


def often(z: int) -> NDArray:
    """Number of waves −z/2 … z/2 that each of m = 0 … z/2 represents, itself and its conjugate, (m,)."""
    m = np.arange(z // 2 + 1)
    return np.where((m == 0) | (2 * m == z), 1.0, 2.0)


def tractions(lugs: Lugs, ring: Ring, n: NDArray) -> NDArray:
    """Harmonics of the tractions on lugs, of unit norm, in the phases of the ring's, (n, field·j, functional).

    They are one over 2π of the work on the amplitudes at the outside.
    """
    from scipy.special import spherical_jn

    q, b = ring.order[1], ring.width
    half, screw = lugs.length / 2 / abs(ring.inner_radius), ring.screw * math.copysign(1.0, ring.radius)
    k, j = np.arange(ALONG), np.arange(q)
    arc = np.sqrt((2 * k + 1) * lugs.length) * (-1j) ** k * spherical_jn(k, n[:, None] * half)
    eta, weight = gauss(q + ACROSS + 4)
    turn = np.exp(1j * screw * b * np.outer(n, eta)) * weight
    face = np.einsum("ne,ej,el->njl", turn, legendre_functions(q, eta), legendre_functions(ACROSS, eta))
    phase = np.conj(1j ** (np.array([1, 0, 1])[:, None] + j))
    at = np.exp(-1j * np.outer(n, lugs.angles))
    found = np.einsum("nu,nk,njl,fj,fg->nfjugkl", at, arc, face, phase, np.eye(3)) / (2 * math.pi)
    return found.reshape(len(n), 3 * q, -1)
