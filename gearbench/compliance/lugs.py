"""Lugs that hold a ring at its outside: their tractions, and the reduction of the compliance of the teeth.

At first the ring has no lugs: springs κ hold its rigid motions, and all teeth have the same compliance. Lugs then act
on it with tractions, which are polynomials along arc and axis. The vector t has their amplitudes, and the forces that
cancel the springs κ; s are the displacements on which these do work, one functional of the ring's motion for each
element of t. Loads P on the flanks and the stiffness K determine both:

    s = Rᵀ P + C t,    s = −K⁻¹ t    ⇒    the flanks move in addition by − R (C + K⁻¹)⁻¹ Rᵀ P (R12 of docs/theory.md).

K is the stiffness of the lugs (K⁻¹ = 0 if they are rigid), and −κ for the forces that cancel springs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss, legendre_functions
from gearbench.threads import lazy

if TYPE_CHECKING:
    from gearbench.compliance.ring import Ring

#: Number of traction polynomials along the arc of a lug and along the axis.
ALONG, ACROSS = 3, 3
#: Longest part of a lug [rim thicknesses, or modules on a thinner rim].
LONGEST = 2.0
#: Number of functionals of a lug: one for each traction polynomial in the directions θ, R and z.
EACH = 3 * ALONG * ACROSS


@dataclass(frozen=True, kw_only=True)
class Lugs:
    """Lugs on the outside of a ring.

    Parameters
    ----------
    angles
        Arc angles of the middles of the lugs, counted from tooth 0 [rad].
    length
        Length of a lug along the circumference [mm].
    springs
        Stiffness per area, radial and tangential [N/mm³]; None for rigid lugs.
    """

    angles: tuple[float, ...]
    length: float
    springs: tuple[float, float] | None = None

    def parted(self, radius: float, longest: float) -> Lugs:
        """Divide the lugs into adjoining parts no longer than ``longest`` [mm], on an outside of the ``radius`` [mm].

        On a long lug three polynomials cannot follow the tractions near a loaded tooth.
        """
        count = math.ceil(self.length / longest - 1e-9)
        offsets = (np.arange(count) - (count - 1) / 2) * self.length / count / radius
        return replace(
            self, angles=tuple(np.add.outer(self.angles, offsets).ravel().tolist()), length=self.length / count
        )

    @property
    def yields(self) -> NDArray:
        """Diagonal of K⁻¹, (functional,): by lug, direction θ, R or z, and polynomials along arc and axis [mm³/N]."""
        if self.springs is None:
            return np.zeros(len(self.angles) * EACH)
        radial, along = self.springs
        return np.tile(np.repeat([1 / along, 1 / radial, 1 / along], ALONG * ACROSS), len(self.angles))


@dataclass(frozen=True, kw_only=True, eq=False)
class LugReduction:
    """Reduction of the compliance of the teeth by the lugs.

    Parameters
    ----------
    reach
        R: displacements s under loads on one tooth that are one of p·q flank polynomials, (tooth, p·q, functional)
        [mm/N].
    own
        C + K⁻¹, (functional, functional).
    """

    reach: NDArray
    own: NDArray

    @lazy
    def grip(self) -> NDArray:
        """(C + K⁻¹)⁻¹, zero for tractions that do no work on the few functions of the ring along its axis."""
        size = np.abs(self.own).max(axis=1)
        working = np.flatnonzero(size > 1e-9 * size.max())
        scale = 1 / np.sqrt(size[working])
        both, inverse = scale[:, None] * scale, np.zeros_like(self.own)
        own = self.own[np.ix_(working, working)]
        inverse[np.ix_(working, working)] = both * np.linalg.inv(both * (own + own.T) / 2)
        return inverse

    def between(self, i: int, j: int) -> NDArray:
        """Change, due to the lugs, of the displacement of tooth i under loads on tooth j, (p·q, p·q) [mm/N]."""
        z = len(self.reach)
        return -self.reach[i % z] @ self.grip @ self.reach[j % z].T

    def turned(self, teeth: int) -> LugReduction:
        """The same reduction with the teeth numbered anew: the tooth with the number ``teeth`` becomes tooth 0."""
        return LugReduction(reach=np.roll(self.reach, -teeth, axis=0), own=self.own) if teeth else self


def multiplicity(z: int) -> NDArray:
    """Multiplicity (m,) of the waves m = 0 … z/2: 2 if m also represents its conjugate −m, else 1."""
    m = np.arange(z // 2 + 1)
    return np.where((m == 0) | (2 * m == z), 1.0, 2.0)


def tractions(lugs: Lugs, ring: Ring, n: NDArray) -> NDArray:
    """Harmonics n of the tractions on lugs, in the phases of the ring's functions, (n, field·j, functional).

    A traction has unit norm. Its harmonic n is its work on the amplitudes of the ring's outside, divided by 2π.
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
    at_lugs = np.exp(-1j * np.outer(n, lugs.angles))
    amplitudes = np.einsum("nu,nk,njl,fj,fg->nfjugkl", at_lugs, arc, face, phase, np.eye(3)) / (2 * math.pi)
    return amplitudes.reshape(len(n), 3 * q, -1)
