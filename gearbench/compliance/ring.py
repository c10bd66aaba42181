"""Gear body: a ring clamped at its bore, loaded by tractions on its rim, by Fourier series around and Ritz elsewhere.

The ring looks the same at every angle, so the harmonics e^{inθ} of its displacement do not see each other, not even in
the coordinates θ, z that turn with the screw of a helical gear, where D = ∂_z − iκn stands for ∂_z. With the phases

    u_θ = i U e^{inθ}    u_R = V e^{inθ}    u_z = i W e^{inθ},    D = i d,    functions of z: i^j g_j

all strains of a harmonic are real up to a common phase (R1 of docs/theory.md),

    ε_θθ = (V − nU)/R    ε_RR = V′    ε_zz = −dW    γ_θR ~ U′ − (U − nV)/R    γ_θz ~ dU + nW/R    γ_Rz ~ dV + W′

and each harmonic is a small real system: (integrated Legendre along R, zero at the bore) × (Legendre along z). A
harmonic reaches about r/n below the rim, so that high ones are given a layer of that depth only (the functions vanish
at its inner end: still a Rayleigh–Ritz bound). Between the harmonics computed, n ĉ_n is interpolated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss, height_functions, width_functions
from gearbench.compliance.chain import lower_solve
from gearbench.geometry.material import lame

#: Depth of the layer that carries harmonic n, in units of r/n: e⁻⁷ of the rim's displacement reaches its inner end.
LAYER = 7.0
#: Grading of the functions along ln R towards the rim: their points lie e^1.5 times denser there than at the bore.
GRADING = 1.5


@dataclass(frozen=True, kw_only=True)
class Ring:
    """Annulus r_i ≤ R ≤ r_o, 0 ≤ z ≤ b, held at r_i.

    Parameters
    ----------
    inner_radius, radius, width
        r_i, r_o and b [mm].
    screw
        κ, turn of the coordinates along the axis [rad/mm].
    E, nu
        Young's modulus [N/mm²] and Poisson's ratio.
    order
        Numbers of functions along R and along z.
    held
        Whether it is held at r_i. If not, one more function along R, the first, is 1 there and 0 at r_o.
    """

    inner_radius: float
    radius: float
    width: float
    screw: float
    E: float
    nu: float
    order: tuple[int, int]
    held: bool = True

    def harmonics(self, n: NDArray) -> NDArray:
        """ĉ_n (harmonic, 3·q, 3·q) [mm²/N·1/mm]: amplitudes (U, V, W) × g_j/√b on the rim per unit traction × r_o⁻¹.

        (R3) of docs/theory.md.
        """
        n = np.asarray(n, dtype=float)
        K, edge = self.stiffness(n)
        part = np.arange(K.shape[1]).reshape(3, len(edge), -1)
        # of the functions along R one moves the rim; the others are condensed
        rim, below = part[:, edge != 0].ravel(), part[:, edge == 0]
        result = np.zeros((len(n), len(rim), len(rim)))
        for mine in self._classes:
            outer, inner = rim[mine], below.swapaxes(1, 2).reshape(len(rim), -1)[mine].ravel()
            found = np.linalg.inv([_condensed(k, outer, inner) for k in K]) if len(n) else np.zeros((0, 1, 1))
            result[:, mine[:, None], mine] = (found + _transposed(found)) / 2
        return result * edge[edge != 0] ** 2

    @property
    def _classes(self) -> list[NDArray]:
        """Functions (field, z) that see each other: without screw the two faces are alike, and W is odd."""
        field, j = np.indices((3, self.order[1])).reshape(2, -1)
        odd = (j + (field == 2)) % 2
        return [np.arange(odd.size)] if self.screw else [np.flatnonzero(odd == k) for k in range(2)]

    def stiffness(self, n: NDArray) -> tuple[NDArray, NDArray]:
        """K (harmonic, 3·p·q, 3·p·q) and the values of the functions of R at r_o (p,); p + 1 of them if not held."""
        lam, mu = lame(self.E, self.nu)
        (M, M1, M2, X, X1, S), edge = self._along(n)
        B, A = self._axial(n)
        unit = np.broadcast_to(np.eye(self.order[1]), A.shape)
        m = n[:, None, None]
        T, X1T, BT = _transposed(X), _transposed(X1), _transposed(B)

        def kron(along: NDArray, across: NDArray) -> NDArray:
            """(harmonic, p, q, p, q)."""
            return along[:, :, None, :, None] * across[:, None, :, None, :]

        blocks = {
            # ⟨tr, tr⟩ λ + 2μ(ε_θθ² + ε_RR² + ε_zz²) + μ(γ_θR² + γ_θz² + γ_Rz²), field by field
            (0, 0): kron((lam + 2 * mu) * m**2 * M2 + mu * (S - X1 - X1T + M2), unit) + kron(mu * M, A),
            (1, 1): kron(lam * (M2 + X1 + X1T + S) + mu * (2 * (M2 + S) + m**2 * M2), unit) + kron(mu * M, A),
            (2, 2): kron((lam + 2 * mu) * M, A) + kron(mu * (m**2 * M2 + S), unit),
            (0, 1): kron(m * (-lam * (M2 + X1) - 2 * mu * M2 + mu * (X1T - M2)), unit),
            (0, 2): kron(lam * m * M1, B) + kron(mu * m * M1, BT),
            (1, 2): kron(-lam * (M1 + T), B) + kron(mu * X, BT),
        }
        p, q = len(edge), self.order[1]
        K = np.empty((len(n), 3, p, q, 3, p, q))
        for (a, b), block in blocks.items():
            K[:, a, :, :, b] = block
            K[:, b, :, :, a] = block.transpose(0, 3, 4, 1, 2)
        return K.reshape(len(n), 3 * p * q, 3 * p * q), edge

    def _along(self, n: NDArray) -> tuple[tuple[NDArray, ...], NDArray]:
        """∫ ff R, ∫ ff, ∫ ff/R, ∫ ff′R, ∫ ff′, ∫ f′f′R dR over each harmonic's layer (R2), each (harmonic, p, p)."""
        p = self.order[0]
        w, weight = gauss(p + 8)
        f, df = height_functions(p, 1 - w)
        edge, _ = height_functions(p, np.array(1.0))
        layer = np.full((len(n), 1), self.radius - self.inner_radius)
        if self.held:
            layer = np.minimum(layer, LAYER * self.radius / np.maximum(n[:, None], 1e-9))
        else:
            f, df, edge = np.column_stack([w, f]), np.column_stack([-np.ones_like(w), df]), np.append(0.0, edge)
        # the solutions are powers of R: polynomials of ln R follow them down to bores of a twentieth of the rim
        span = -np.log1p(-layer / self.radius)
        R = self.radius * np.exp(-span * np.expm1(GRADING * w) / math.expm1(GRADING))
        slope = R * span * GRADING * np.exp(GRADING * w) / math.expm1(GRADING)  # −dR/dw

        def integral(a: NDArray, b: NDArray, factor: NDArray) -> NDArray:
            return np.swapaxes(a * factor[..., None], 1, 2) @ b

        f = np.broadcast_to(f, (len(n), *f.shape))
        # R falls as w grows, and so does 1 − w: ∂_R f = f′(1 − w) / slope
        df = df / slope[..., None]
        dR = weight * slope
        parts = (f, f, dR * R), (f, f, dR), (f, f, dR / R), (f, df, dR * R), (f, df, dR), (df, df, dR * R)
        return tuple(integral(*part) for part in parts), edge

    def _axial(self, n: NDArray) -> tuple[NDArray, NDArray]:
        """⟨φ_j, dφ_l⟩ and ⟨dφ_j, dφ_l⟩ of φ_j = i^j g_j, (harmonic, q, q)."""
        q = self.order[1]
        eta, weight = gauss(q + 1)
        g, dg = width_functions(q, eta)
        dg = dg / self.width
        first = g.T @ (weight[:, None] * dg)
        second = dg.T @ (weight[:, None] * dg)
        j = np.arange(q)
        phase = 1j ** ((j - j[:, None]) % 4)
        turn = self.screw * n[:, None, None]
        B = (phase * (-1j * first - turn * np.eye(q))).real
        A = (phase * (second + turn**2 * np.eye(q) + 1j * turn * (first - first.T))).real
        return B, A


def interpolated(harmonics: Callable[[NDArray], NDArray], n: NDArray) -> NDArray:
    """ĉ_n for numbers n ≥ 0 in any order, computed for some and interpolated between them, (…, 3·q, 3·q)."""
    from scipy.interpolate import CubicSpline

    some = sampled(int(n.max()))
    found = harmonics(some)
    if len(some) == some[-1] + 1:
        return found[n]
    wanted, back = np.unique(n, return_inverse=True)
    zeros, wanted = wanted[wanted == 0], wanted[wanted > 0]
    smooth = CubicSpline(np.log(some[1:]), some[1:, None, None] * found[1:])
    result = smooth(np.log(wanted)) / wanted[:, None, None]
    return np.concatenate([found[:1][zeros], result])[back.reshape(n.shape)]


def _condensed(K: NDArray, outer: NDArray, inner: NDArray) -> NDArray:
    """K_oo − K_oi K_ii⁻¹ K_io."""
    half = lower_solve(np.linalg.cholesky(K[inner[:, None], inner]), K[inner[:, None], outer])
    return K[outer[:, None], outer] - half.T @ half


def _transposed(matrices: NDArray) -> NDArray:
    return np.swapaxes(matrices, 1, 2)


def sampled(most: int) -> NDArray:
    """0, 1, 2, … and then ever wider apart, up to ``most``."""
    n = [0, 1, 2, 3, 4]
    while n[-1] < most:
        n.append(min(most, max(n[-1] + 1, round(n[-1] * 1.35))))
    return np.array([k for k in n if k <= most], dtype=float)
