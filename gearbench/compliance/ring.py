"""Gear body as a ring, held at one edge and loaded by tractions on the other.

The displacement is a Fourier series around the ring and a Ritz series along R and z. The ring is rotationally
symmetric, so its harmonics e^{inθ} are independent. This also holds in coordinates θ, z that turn with the screw of a
helical gear, where D = ∂_z − iκn replaces ∂_z. With the phases

    u_θ = i U e^{inθ}    u_R = V e^{inθ}    u_z = i W e^{inθ},    D = i d,    functions of z: i^j g_j

all strains of a harmonic are real up to a common phase (R1 of docs/theory.md),

    ε_θθ = (V − nU)/R    ε_RR = V′    ε_zz = −dW    γ_θR ~ U′ − (U − nV)/R    γ_θz ~ dU + nW/R    γ_Rz ~ dV + W′

where n counts the waves along the arc towards e_θ. An internal gear is held at its outside. Its R and c = 1/R are
negative, but n/R stays positive on its rim, so that its curvature terms have the opposite sign to those of an external
gear. Each harmonic is a small real system in products of integrated Legendre polynomials along R, zero at the bore, and
Legendre polynomials along z. A harmonic decays below the rim with the depth r/n, so high harmonics are computed in a
layer of seven times this depth. The functions vanish at the inner end of the layer, so that the compliance is still a
lower (Rayleigh–Ritz) bound. Between computed harmonics n ĉ_n is interpolated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss, height_functions, sampled, spline_weights, width_functions
from gearbench.compliance.lapack import addresses
from gearbench.geometry.material import lame

#: Depth of the layer for harmonic n, in units of r/n. At its inner end e⁻⁷ of the rim's displacement is left.
LAYER = 7.0
#: Grading of the functions along ln R: they resolve the rim e^1.5 times finer than the bore.
GRADING = 1.5
#: Stiffness [E] of the springs against rigid motions, which are then 10⁻⁶ of the deformation.
FIRM = 1e6
#: Approximate ratio of successive computed harmonics, for a ring held rigidly and for a ring on springs.
APART, APART_ON_SPRINGS = 1.45, 1.1


@dataclass(frozen=True, kw_only=True)
class Ring:
    """Annulus r_i ≤ R ≤ r_o, 0 ≤ z ≤ b, usually held at r_i.

    Parameters
    ----------
    inner_radius, radius, width
        r_i, r_o and b [mm]. The radii of an internal gear are negative, and r_i is its outer radius.
    screw
        κ, rotation of the coordinates per length along the axis [rad/mm].
    E, nu
        Young's modulus [N/mm²] and Poisson's ratio.
    order
        Numbers of functions along R and along z.
    held
        Whether the ring is held at r_i. If not, an additional first function along R is 1 at r_i and 0 at r_o.
    support
        Stiffness of springs at r_i, radial and tangential [N/mm³]; None if it is held rigidly. If both are 0, the ring
        is free, and only its rigid motions are held.
    grip
        Stiffness of the springs against rigid motions [E].
    """

    inner_radius: float
    radius: float
    width: float
    screw: float
    E: float
    nu: float
    order: tuple[int, int]
    held: bool = True
    support: tuple[float, float] | None = None
    grip: float = FIRM

    def harmonics(self, n: NDArray) -> NDArray:
        """Compliance ĉ_n of the rim (R3), (harmonic, 3·q, 3·q) [mm²/N].

        It maps amplitudes of tractions on the rim, times r_o, to those of its displacements (U, V, W) × g_j/√b.
        """
        from gearbench.compliance._ring_kernels import condense

        if self.support is not None:
            return self._on_springs(np.asarray(n, dtype=float))
        n, rim = np.asarray(n, dtype=float), 3 * self.order[1]
        result = np.zeros((len(n), rim, rim))
        (along, edge), across = self._along(n), self._across(n)
        for chosen in self._classes:
            condensed = np.empty((len(n), len(chosen), len(chosen)))
            of_class = np.ascontiguousarray(across[:, :, chosen[:, None], chosen])
            if not condense(along, of_class, edge[-1], condensed, addresses()):
                raise np.linalg.LinAlgError("the stiffness of a ring is not positive definite")
            result[:, chosen[:, None], chosen] = condensed
        return result

    def _on_springs(self, n: NDArray) -> NDArray:
        """``harmonics`` of a ring on springs at r_i; those that do not reach r_i are as for a rigidly held ring."""
        result, reaching = replace(self, support=None).harmonics(n), self.reaching(n)
        result[reaching] = self.edges(n[reaching])[:, : result.shape[1], : result.shape[1]]
        return result

    def reaching(self, n: NDArray) -> NDArray:
        """Whether each harmonic n reaches from one edge to the other, with a margin of a fifth, (harmonic,)."""
        return n * abs(math.log(self.inner_radius / self.radius)) < 1.2 * LAYER

    def edges(self, n: NDArray) -> NDArray:
        """Compliance of both edges of a ring on springs, (harmonic, 2·3·q, 2·3·q): amplitudes at r_o, then at r_i."""
        K, edge = replace(self, support=None, held=False).stiffness(n)
        size = 3 * self.order[1]
        for harmonic, number in zip(K, n, strict=True):
            harmonic[:size, :size] += self._springs(harmonic, int(number))
        edge_motion = np.zeros((K.shape[1], 2 * size))
        edge_motion[-size:, :size] = edge[-1] * np.eye(size)
        edge_motion[:size, size:] = np.eye(size)
        L = np.linalg.cholesky(K)
        half = np.linalg.solve(L, np.broadcast_to(edge_motion, (len(K), *edge_motion.shape)))
        return _transposed(half) @ half

    def _springs(self, free: NDArray, n: int) -> NDArray:
        """Stiffness of the springs at r_i for harmonic n, (3·q, 3·q); ``free`` is the stiffness of the free ring."""
        assert self.support is not None
        radial, along = self.support
        springs = np.diag(np.repeat([along, radial, along], self.order[1]) * abs(self.inner_radius))
        if along or n > 1 or (n and radial):
            return springs
        e = rigid_motions(free, self.order[1])
        return springs + self.grip * self.E * e @ e.T

    @property
    def _classes(self) -> list[NDArray]:
        """Index sets of coupled functions (field, z).

        Without screw the faces are symmetric, and there are two decoupled sets, with W of the opposite parity.
        """
        field, j = np.indices((3, self.order[1])).reshape(2, -1)
        odd = (j + (field == 2)) % 2
        return [np.arange(odd.size)] if self.screw else [np.flatnonzero(odd == k) for k in range(2)]

    def stiffness(self, n: NDArray) -> tuple[NDArray, NDArray]:
        """Stiffness K (harmonic, p·3·q, p·3·q) with p functions of R, q of z; and values of those of R at r_o, (p,).

        There are p + 1 functions of R if the inner edge is free: the first then moves the inner edge. The last function
        moves the rim.
        """
        from gearbench.compliance._ring_kernels import assemble

        (along, edge), across = self._along(n), self._across(n)
        p, size = len(edge), 3 * self.order[1]
        K = np.empty((len(n), p, size, p, size))
        assemble(along, across, K)
        return K.reshape(len(n), p * size, p * size), edge

    def _across(self, n: NDArray) -> NDArray:
        """Factors along z that multiply the integrals of ``_along`` in the stiffness, (harmonic, 8, 3·q, 3·q)."""
        lam, mu = lame(self.E, self.nu)
        n = math.copysign(1.0, self.radius) * n
        B, A = self._axial(n)
        m, BT, q = n[:, None, None], _transposed(B), self.order[1]
        across = np.zeros((len(n), 8, 3, q, 3, q))
        # numbers of the integrals of ``_along``: ff R, ff, ff/R, ff′R, f′fR, ff′, f′f, f′f′R
        M, M1, M2, X, XT, X1, X1T, S = range(8)
        # ⟨tr, tr⟩ λ + 2μ(ε_θθ² + ε_RR² + ε_zz²) + μ(γ_θR² + γ_θz² + γ_Rz²), field by field
        for term, a, b, matrix in (
            (M, 0, 0, mu * A), (M, 1, 1, mu * A), (M, 2, 2, (lam + 2 * mu) * A),
            (M1, 0, 2, m * (lam * B + mu * BT)), (M1, 2, 0, m * (lam * BT + mu * B)),
            (M1, 1, 2, -lam * B), (M1, 2, 1, -lam * BT),
            (XT, 1, 2, -lam * B), (X, 2, 1, -lam * BT), (X, 1, 2, mu * BT), (XT, 2, 1, mu * B),
        ):  # fmt: skip
            across[:, term, a, :, b] = matrix
        for term, a, b, value in (  # the functions of z are orthonormal
            (M2, 0, 0, (lam + 2 * mu) * m**2 + mu), (M2, 1, 1, lam + 2 * mu + mu * m**2), (M2, 2, 2, mu * m**2),
            (M2, 0, 1, -m * (lam + 3 * mu)), (M2, 1, 0, -m * (lam + 3 * mu)),
            (S, 0, 0, mu), (S, 1, 1, lam + 2 * mu), (S, 2, 2, mu),
            (X1, 0, 0, -mu), (X1T, 0, 0, -mu), (X1, 1, 1, lam), (X1T, 1, 1, lam),
            (X1, 0, 1, -lam * m), (X1T, 1, 0, -lam * m), (X1T, 0, 1, mu * m), (X1, 1, 0, mu * m),
        ):  # fmt: skip
            across[:, term, a, :, b] = value * np.eye(q)
        return across.reshape(len(n), 8, 3 * q, 3 * q)

    def _along(self, n: NDArray) -> tuple[NDArray, NDArray]:
        """Integrals over the layer of each harmonic (R2), (harmonic, p, p, 8), and the functions' values at r_o, (p,).

        The integrands are ff R, ff, ff/R, ff′R, f′fR, ff′, f′f and f′f′R.
        """
        p = self.order[0]
        w, weight = gauss(p + 8)
        # the first function moves the rim: make it the last
        f, df = (np.roll(each, -1, axis=1) for each in height_functions(p, 1 - w))
        edge = np.roll(height_functions(p, np.array(1.0))[0], -1)
        layer = np.full((len(n), 1), self.radius - self.inner_radius)
        if self.held:
            depth = LAYER / np.maximum(n[:, None], 1e-9)
            if self.radius < 0:  # outwards a harmonic decays like R^−n, more slowly than inwards
                depth = -np.expm1(np.minimum(1.2 * depth, 50.0))
            layer = np.minimum(layer, self.radius * depth)
        else:
            f, df, edge = np.column_stack([w, f]), np.column_stack([-np.ones_like(w), df]), np.append(0.0, edge)
        # solutions are powers of R: polynomials of ln R approximate them down to bores of 1/20 of the rim
        span = -np.log1p(-layer / self.radius)
        R = self.radius * np.exp(-span * np.expm1(GRADING * w) / math.expm1(GRADING))
        slope = R * span * GRADING * np.exp(GRADING * w) / math.expm1(GRADING)  # −dR/dw

        def integral(a: NDArray, b: NDArray, factor: NDArray) -> NDArray:
            return np.swapaxes(a * factor[..., None], 1, 2) @ b

        f = np.broadcast_to(f, (len(n), *f.shape))
        # R decreases with w, and so does 1 − w: ∂_R f = f′(1 − w) / slope
        df = df / slope[..., None]
        dR = math.copysign(1.0, self.radius) * weight * slope
        M, M1, M2 = (integral(f, f, factor) for factor in (dR * R, dR, dR / R))
        X, X1 = integral(f, df, dR * R), integral(f, df, dR)
        integrals = M, M1, M2, X, _transposed(X), X1, _transposed(X1), integral(df, df, dR * R)
        return np.stack(integrals, axis=-1), edge

    def _axial(self, n: NDArray) -> tuple[NDArray, NDArray]:
        """Products ⟨φ_j, dφ_l⟩ and ⟨dφ_j, dφ_l⟩ of φ_j = i^j g_j, (harmonic, q, q) each."""
        q = self.order[1]
        first, second = _axial_products(q)
        turn, one = self.screw * n[:, None, None], np.eye(q)
        B = first / self.width - turn * one
        A = second / self.width**2 + turn**2 * one - turn / self.width * (first + first.T)
        return B, A


@lru_cache(maxsize=16)
def _axial_products(q: int) -> tuple[NDArray, NDArray]:
    """Products ⟨φ_j, dφ_l⟩ and ⟨dφ_j, dφ_l⟩ without screw and for unit width, (q, q) each."""
    eta, weight = gauss(q + 1)
    g, dg = width_functions(q, eta)
    j = np.arange(q)
    phase = 1j ** ((j - j[:, None]) % 4)
    first, second = g.T @ (weight[:, None] * dg), dg.T @ (weight[:, None] * dg)
    return (phase * -1j * first).real, (phase * second).real


@lru_cache(maxsize=64)
def harmonic_weights(most: int, spacing: float = APART) -> tuple[NDArray, NDArray]:
    """Numbers of the computed harmonics, and their weights (n, computed) in the ĉ_n for n = 0 … ``most``."""
    computed = sampled(most, spacing)
    if len(computed) > most:
        weights = np.eye(most + 1)
    else:
        n = np.arange(1, most + 1)
        weights = np.zeros((most + 1, len(computed)))
        weights[0, 0] = 1.0
        # n ĉ_n is interpolated over ln n by splines of degree five
        weights[1:, 1:] = spline_weights(np.log(computed[1:]), np.log(n), 5) * computed[1:] / n[:, None]
    weights.flags.writeable = False
    return computed, weights


def rigid_motions(free: NDArray, q: int) -> NDArray:
    """Rigid motions of a free ring with the stiffness ``free``: orthonormal motions of its inner edge (3·q, 2).

    In harmonic 0 these are rotation and axial shift, in harmonic 1 radial shift and tilt.
    """
    return np.linalg.qr(np.linalg.eigh(free)[1][: 3 * q, :2])[0]


def _transposed(matrices: NDArray) -> NDArray:
    return np.swapaxes(matrices, 1, 2)
