"""Section of a solid tooth, mapped from a rectangle, and the elastic energy of functions on it.

``solid_tooth.SolidTooth`` adds the functions of z along the face. Coordinates: x = R − r_f along the height, s ∈ [−1,
1] across the tooth at constant radius, θ = s ψ(R), and z along the axis in the frame that turns with the screw.
Displacements are u_θ, u_R, u_z in cylindrical components, so that nothing depends on the position along the screw. With
the half-width e = R ψ along the arc, curvature c = 1/R (zero for a straight block), κ = tan β / r and D = ∂_z − κ ∂_θ
the strains are (S1 of docs/theory.md)

    ε_θθ = ∂_s u_θ / e + c u_R     γ_θR = ∂_R u_θ − c u_θ + ∂_s u_R / e     ∂_R = ∂_x − s (e′/e − c) ∂_s
    ε_RR = ∂_R u_R                 γ_θz = D u_θ + ∂_s u_z / e               ∂_θ = ∂_s / (c e)
    ε_zz = D u_z                   γ_Rz = D u_R + ∂_R u_z                   dV = e dx ds dz

Every term is (function of x) × (function of s) × (function of z). The stiffness is therefore a short sum of Kronecker
products: integrals over s and z are exact, and those over x come from a quadrature.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from gearbench.compliance.bases import (
    gauss,
    height_functions,
    height_quadrature,
    jointed_height_functions,
    legendre_functions,
    width_functions,
)
from gearbench.compliance.outline import Outline
from gearbench.threads import lazy

#: Quadrature points of a panel, in addition to the number of functions along the height: of an outline, and without
#: one.
POINTS, POINTS_WITHOUT_OUTLINE = 16, 12
#: From ``JOINTED`` functions along the height on, there are two families. The share of the lower family is
#: ``LEAST_SHARE`` plus half its share of the height, because the stress is singular at the root.
JOINTED, LEAST_SHARE = 9, 0.25

#: A term of a strain: its sign, its field (0: u_θ, 1: u_R, 2: u_z), the numbers of its functions of x and s (below),
#: and the order of its derivative by z.
Term = tuple[float, int, int, int, int]

# with f the function along the height and P that across, the functions of x are f, f′, f(e′/e − c), c f, f/e, κ f/(c
# e), and those of s are P, s P′, P′
_F, _DF, _FA, _CF, _FE, _FK = range(6)
_P, _SDP, _DP = range(3)


def _radial(field: int) -> tuple[Term, ...]:
    """∂_R of a field."""
    return (1.0, field, _DF, _P, 0), (-1.0, field, _FA, _SDP, 0)


def _axial(field: int) -> tuple[Term, ...]:
    """D of a field."""
    return (1.0, field, _F, _P, 1), (-1.0, field, _FK, _DP, 0)


def _around(field: int) -> tuple[Term, ...]:
    """∂_s of a field, divided by e."""
    return ((1.0, field, _FE, _DP, 0),)


# T, R, Z: θ, R, z
STRAIN_TT = (*_around(0), (1.0, 1, _CF, _P, 0))
STRAIN_RR = _radial(1)
STRAIN_ZZ = _axial(2)
SHEAR_TR = (*_radial(0), (-1.0, 0, _CF, _P, 0), *_around(1))
SHEAR_TZ = (*_axial(0), *_around(2))
SHEAR_RZ = (*_axial(1), *_radial(2))


@dataclass(frozen=True, kw_only=True)
class ToothSection:
    """Section of the tooth with its functions: Legendre across, integrated Legendre (zero at the root) along x.

    Parameters
    ----------
    height
        Height from root to tip [mm].
    half_width
        e(x) [mm], half the arc thickness, vectorised.
    root_radius
        r_f [mm]; ``math.inf`` for a straight block.
    screw
        κ, turn of the section along the axis [rad/mm]; zero for a straight block.
    order
        Numbers of functions across and along the height.
    free
        Whether the root moves. Legendre polynomials of θ, constant along R (S6), then precede the functions that are
        zero at the root, so that the whole tooth follows its root without strain across.
    outline
        Function from points per panel to the quadrature along the height; None: quadrature by ``half_width``.
    root_half_width
        e(0) [mm], if known without ``half_width``.
    joint
        Height [mm] at which the loaded flank begins: the load jumps there, and the outline of undercut teeth has a
        kink. ``JOINTED`` or more functions along the height are two families that meet there.
        Below it the half-width may grow like √x.
    """

    height: float
    half_width: Callable[[NDArray], NDArray]
    root_radius: float
    screw: float
    order: tuple[int, int]
    free: bool = False
    outline: Callable[[int], Outline] | None = None
    root_half_width: float | None = None
    joint: float | None = None

    def __post_init__(self) -> None:
        if self.screw and math.isinf(self.root_radius):
            raise ValueError("a straight block has no screw: root_radius must be finite")

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of functions across and along the height, including the one that moves the root."""
        return self.order[0], self.order[1] + self.free

    @lazy
    def _nodes(self) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Quadrature in x: nodes, weights, e and e′ there, (node,)."""
        if self.outline is not None:
            return self.outline(self.order[1] + POINTS)
        points = self.order[1] + POINTS_WITHOUT_OUTLINE
        xi, weight = height_quadrature(points, [] if self.joint is None else [self.joint / self.height])
        x = xi * self.height
        e = np.broadcast_to(np.asarray(self.half_width(x), dtype=float), x.shape)
        slope = _differentiation(points)
        # e and x are smooth in the variable of a panel, which is √x on the first panel
        de, dx = (slope @ v.reshape(-1, points).T for v in (e, x))
        return x, weight * self.height, e, (de / dx).T.ravel()

    def heights(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Functions along the height that are zero at the root, and their derivatives by x, each (…, n_x)."""
        count, xi = self.order[1], x / self.height
        if self.joint is None or count < JOINTED:
            f, df = height_functions(count, xi)
        else:
            share = self.joint / self.height
            lower = round(count * (LEAST_SHARE + share / 2))
            f, df = jointed_height_functions((lower, count - lower), share, xi)
        return f, df / self.height

    def curvature(self, x: NDArray) -> NDArray:
        """c = 1/R at height x [1/mm]."""
        return 1 / (self.root_radius + x)

    @lazy
    def _along(self) -> NDArray:
        """∫ a_i b_k e dx of the functions of x, (kind, i, kind, k)."""
        x, weight, e, de = self._nodes
        c = self.curvature(x)
        f, df = self.heights(x)
        if self.free:
            # σ^m, σ = ψ/ψ(root): times s^m it is a power of θ. Its slope is infinite at the root, as that of ψ; in
            # ∂_R at constant θ the two cancel node by node
            m = np.arange(self.order[0])
            power = self._spread(x, e)[:, None] ** m
            f, df = np.hstack([power, f]), np.hstack([m * power * (de / e - c)[:, None], df])
        turn = self.screw / (c * e) if self.screw else np.zeros_like(e)
        factors = (np.ones_like(e), None, de / e - c, c, 1 / e, turn)
        kinds = np.stack([df if a is None else f * a[:, None] for a in factors], axis=1)
        flat = kinds.reshape(len(x), -1)
        return (flat.T @ (flat * (weight * e)[:, None])).reshape(2 * kinds.shape[1:])

    def stiffness(self, lame: tuple[float, float]) -> NDArray:
        """S[a, b], factor of ∫ g⁽ᵃ⁾ g⁽ᵇ⁾ dz, for Lamé's λ, μ [N/mm²] (S2, S3), (2, 2, 3, n_s, n_x, 3, n_s, n_x)."""
        lam, mu = lame
        of_lam, of_mu = _coefficients(bool(self.screw))
        (n_s, n_x), terms = self.shape, (2, 2, 3, 3)
        count = self._along.shape[1]
        along = self._along.swapaxes(1, 2).reshape(-1, count * count)
        # many pairs of functions of x share a pair of functions of s: sum these first; 36 = 2·2 derivatives × 3·3
        # fields
        summed = ((lam * of_lam + mu * of_mu) @ along).reshape(36, -1, count, count)
        result, moving = np.empty((2, 2, 3, n_s, n_x, 3, n_s, n_x)), count - self.order[1]
        inner, root = slice(int(self.free), None), slice(0, moving)
        across = [factors.reshape(n_s * n_s, -1) for factors in _across_factors(n_s)]

        def sums(of_s: NDArray, rows: slice, columns: slice) -> NDArray:
            """Products of factors of s and of x, summed, (a, b, field, field, s, s, x·x)."""
            of_x = summed[:, :, rows, columns].reshape(36, of_s.shape[1], -1)
            return (of_s @ of_x).reshape(*terms, n_s, n_s, -1)

        along_both = sums(across[0], slice(moving, None), slice(moving, None))
        along_both = along_both.reshape(*terms, n_s, n_s, self.order[1], -1)
        result[..., inner, :, :, inner] = along_both.transpose(0, 1, 2, 4, 6, 3, 5, 7)
        if self.free:
            mixed = sums(across[1], root, slice(moving, None))
            result[..., 0, :, :, 1:] = mixed.transpose(0, 1, 2, 4, 3, 5, 6)
            # S[a, b] and S[b, a] are each other's transposes
            result[..., 1:, :, :, 0] = mixed.transpose(1, 0, 3, 5, 6, 2, 4)
            both = summed[:, :, root, root].reshape(36, -1) @ across[2].T
            result[..., 0, :, :, 0] = both.reshape(*terms, n_s, n_s).transpose(0, 1, 2, 4, 3, 5)
        return result

    def _spread(self, x: NDArray, e: NDArray) -> NDArray:
        """σ = ψ/ψ(root) at height x, e/e(root) of a straight block."""
        return e / self._root_half_width / (1 + x / self.root_radius)

    @lazy
    def _root_half_width(self) -> float:
        return self.root_half_width or float(np.ravel(self.half_width(np.zeros(1)))[0])

    def values(self, x: NDArray, s: float) -> NDArray:
        """Functions of a field at height x and s, (…, n_s, n_x). Below the root they have their values at the root."""
        x = np.clip(x, 0.0, self.height)
        f, _ = self.heights(x)
        p = legendre_functions(self.order[0], (s + 1) / 2)
        inner = p[:, None] * f[..., None, :]
        if not self.free:
            return inner
        sigma = self._spread(x, np.asarray(self.half_width(x)))
        moving = legendre_functions(self.order[0], (sigma * s + 1) / 2)
        return np.concatenate([moving[..., None], inner], axis=-1)


@lru_cache(maxsize=2)
def _coefficients(screw: bool) -> tuple[NDArray, NDArray]:
    """Factors of λ and μ in the energy (S2).

    Rows: (derivatives in z, fields, functions of s), each twice; columns: functions of x, twice.
    """
    kinds = len((_F, _DF, _FA, _CF, _FE, _FK))
    of_lam, of_mu = np.zeros((2, 2, 2, 3, 3, 3, 3, kinds, kinds))
    trace = (*STRAIN_TT, *STRAIN_RR, *STRAIN_ZZ)
    direct = [(of_mu, 2.0, strain) for strain in (STRAIN_TT, STRAIN_RR, STRAIN_ZZ)]
    shear = [(of_mu, 1.0, strain) for strain in (SHEAR_TR, SHEAR_TZ, SHEAR_RZ)]
    for into, modulus, strain in [(of_lam, 1.0, trace), *direct, *shear]:
        terms = [t for t in strain if screw or t[2] != _FK]
        for (sign_a, field_a, x_a, s_a, z_a), (sign_b, field_b, x_b, s_b, z_b) in product(terms, terms):
            into[z_a, z_b, field_a, field_b, s_a, s_b, x_a, x_b] += modulus * sign_a * sign_b
    both = of_lam.reshape(-1, kinds * kinds), of_mu.reshape(-1, kinds * kinds)
    for coefficients in both:
        coefficients.flags.writeable = False
    return both


@lru_cache(maxsize=32)
def _differentiation(points: int) -> NDArray:
    """Matrix that differentiates values at Gauss nodes of [0, 1] along the panel."""
    t, _ = gauss(points)
    p, dp = width_functions(points, t)
    return np.linalg.solve(p.T, dp.T).T


@lru_cache(maxsize=32)
def _monomials(count: int) -> NDArray:
    """Coefficients a_km of s^m in the Legendre functions of s, orthonormal on s = −1 … 1 as on [0, 1]."""
    rows = [np.pad(legendre.leg2poly(np.eye(count)[k]), (0, count))[:count] for k in range(count)]
    return np.array(rows) * np.sqrt(2 * np.arange(count) + 1)[:, None]


@lru_cache(maxsize=32)
def _across_factors(order: int) -> tuple[NDArray, NDArray, NDArray]:
    """∫ a b ds of the functions of s: held with held, moving with held, moving with moving.

    Moving functions are P_k(σ s) = Σ_l (Σ_m a_km σᵐ (a⁻¹)_ml) P_l(s), with a power m of σ for each. Axes: k, l, kind,
    kind, and the powers.
    """
    t, w = legendre.leggauss(order + 1)
    p, dp = width_functions(order, (t + 1) / 2)
    dp = dp / 2
    kinds = np.stack([p, t[:, None] * dp, dp], axis=1)
    to_power = _monomials(order)
    moving = np.einsum("km,ml,nal->namk", to_power, np.linalg.inv(to_power), kinds)
    clamped = np.einsum("n,nak,nbl->klab", w, kinds, kinds)
    mixed = np.einsum("n,namk,nbl->klabm", w, moving, kinds)
    both = np.einsum("n,namk,nbcl->klabmc", w, moving, moving, optimize=True)
    for factors in (clamped, mixed, both):
        factors.flags.writeable = False
    return clamped, mixed, both
