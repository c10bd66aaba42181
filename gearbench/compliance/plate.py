"""Tooth as a Reissner–Mindlin plate of variable thickness, clamped at the root, by the Ritz method.

Kinematics u_x = zθ_y, u_y = −zθ_x; κ_xx = θ_y,x, κ_yy = −θ_x,y, 2κ_xy = θ_y,y − θ_x,x; γ_xz = θ_y + w,x,
γ_yz = −θ_x + w,y. Twice the energy is ∬ D[κ_xx² + κ_yy² + 2ν κ_xx κ_yy + (1−ν)/2 (2κ_xy)²] + κGh (γ_xz² + γ_yz²), with
D = E h³ / 12(1−ν²) and κ = 5/6 (PL1, PL2 of docs/theory.md).
Source: Garambois et al. 2017, section 2; Timoshenko & Woinowsky-Krieger.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.compliance.bases import gauss, height_functions, height_quadrature, legendre_functions, width_functions
from gearbench.compliance.ritz import Ritz

SHEAR_FACTOR = 5 / 6

#: Numbers (height function, width function) of the products that span the paper's x(a + by + cx), for every field.
PAPER_BASIS = ((0, 0), (0, 1), (1, 0))


@dataclass(frozen=True, kw_only=True)
class PlateTooth:
    """Rectangular plate, clamped along x = 0, loaded by transverse forces.

    Parameters
    ----------
    height, width
        Lengths along x, from the root, and along y, across the face [mm].
    thickness
        h(x) [mm], vectorised, for 0 ≤ x ≤ height.
    E, nu
        Young's modulus [N/mm²] and Poisson's ratio.
    basis
        "paper" (9 unknowns) or (p, q), numbers of functions along height and width of each field.
    breaks
        Heights [mm] at which h has a kink.
    branches
        Heights [mm] above which h is smooth in the square root of the distance, see ``height_quadrature``.
    """

    height: float
    width: float
    thickness: Callable[[NDArray], NDArray]
    E: float
    nu: float
    basis: Literal["paper"] | tuple[int, int] = "paper"
    breaks: tuple[float, ...] = ()
    branches: tuple[float, ...] = (0.0,)

    @cached_property
    def pairs(self) -> NDArray:
        """Indices (height function, width function) of the functions of a field, (n, 2)."""
        if self.basis == "paper":
            return np.array(PAPER_BASIS)
        return np.array(list(product(range(self.basis[0]), range(self.basis[1]))))

    @cached_property
    def ritz(self) -> Ritz:
        """The Ritz system, amplitudes ordered θ_x, θ_y, w."""
        return Ritz(self.stiffness(), len(self.pairs))

    @property
    def condition(self) -> float:
        """Condition number of the scaled Ritz matrix."""
        return self.ritz.condition

    def stiffness(self) -> NDArray:
        """Ritz matrix of the three fields θ_x, θ_y, w, (3n, 3n) [N·mm between rotations, N with w, N/mm for w]."""
        nu = self.nu
        D, S, Y = self._integrals()  # D[a, b] etc.: weighted ∫ f⁽ᵃ⁾ f⁽ᵇ⁾ for all pairs of functions
        xx = D[0, 0] * Y[1, 1] + (1 - nu) / 2 * D[1, 1] * Y[0, 0] + S[0, 0] * Y[0, 0]
        yy = D[1, 1] * Y[0, 0] + (1 - nu) / 2 * D[0, 0] * Y[1, 1] + S[0, 0] * Y[0, 0]
        ww = S[1, 1] * Y[0, 0] + S[0, 0] * Y[1, 1]
        xy = -nu * D[0, 1] * Y[1, 0] - (1 - nu) / 2 * D[1, 0] * Y[0, 1]
        wx, wy = -S[0, 0] * Y[1, 0], S[1, 0] * Y[0, 0]
        return np.block([[xx, xy, wx.T], [xy.T, yy, wy.T], [wx, wy, ww]])

    def factor(self, height: ArrayLike, y: ArrayLike) -> NDArray:
        """ψ(x, y), (…, rank) [√(mm/N)]: a unit force at b deflects a by ψ(a) · ψ(b) (PL3)."""
        return self.ritz.factor(self.functions(height, y))

    def deflection(self, x: ArrayLike, y: ArrayLike, x0: ArrayLike, y0: ArrayLike) -> NDArray:
        """Deflection w at (x, y) under a unit transverse force at (x0, y0) [mm/N]."""
        return np.sum(self.factor(x, y) * self.factor(x0, y0), axis=-1)

    def functions(self, x: ArrayLike, y: ArrayLike) -> NDArray:
        """Functions of the field w at (x, y), (…, n)."""
        i, j = self.pairs.T
        f, _ = height_functions(i.max() + 1, np.asarray(x, dtype=float) / self.height)
        g = legendre_functions(j.max() + 1, np.asarray(y, dtype=float) / self.width)
        return f[..., i] * g[..., j]

    def _integrals(self) -> tuple[NDArray, NDArray, NDArray]:
        """∫ f_i⁽ᵃ⁾ f_k⁽ᵇ⁾ D dx, the same with κGh, and ∫ g_j⁽ᵃ⁾ g_l⁽ᵇ⁾ dy, for all pairs of functions, (2, 2, n, n)."""
        i, j = self.pairs.T
        E, nu, H, b = self.E, self.nu, self.height, self.width
        # panels at branches are mapped by a square, which doubles the degree of the integrand
        count = 2 * i.max() + 20
        xi, weight = height_quadrature(count, [x / H for x in self.breaks], [x / H for x in self.branches])
        h = np.broadcast_to(self.thickness(xi * H), xi.shape)
        bending, shear = E * h**3 / (12 * (1 - nu**2)), SHEAR_FACTOR * E / (2 * (1 + nu)) * h
        f = np.stack(height_functions(i.max() + 1, xi))
        f[1] /= H
        D, S = (_products(f, weight * H * stiffness) for stiffness in (bending, shear))
        Y = _width_products(int(j.max()) + 1) * b / np.array([[1.0, b], [b, b * b]])[:, :, None, None]
        rows, columns = np.ix_(i, i), np.ix_(j, j)
        return D[:, :, *rows], S[:, :, *rows], Y[:, :, *columns]


def _products(f: NDArray, weight: NDArray) -> NDArray:
    """Σ f_i⁽ᵃ⁾ f_k⁽ᵇ⁾ × weight over the nodes, (2, 2, n, n), of functions and derivatives (2, node, n)."""
    flat = f.transpose(1, 0, 2).reshape(len(weight), -1)
    return ((flat.T * weight) @ flat).reshape(2, f.shape[2], 2, -1).transpose(0, 2, 1, 3)


@lru_cache(maxsize=64)
def _width_products(count: int) -> NDArray:
    """∫ g_j⁽ᵃ⁾ g_l⁽ᵇ⁾ dη on [0, 1], (2, 2, count, count)."""
    eta, weight = gauss(count + 1)
    return _products(np.stack(width_functions(count, eta)), weight)
