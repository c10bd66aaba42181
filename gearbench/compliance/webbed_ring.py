"""Gear body of three joined rings: rim, web and hub, each with the functions of ``Ring``.

In every harmonic, web and hub carry the rim like a foundation, whose stiffness is condensed to the web's outer edge.
The web is narrower than both. Motions u of rim or hub move its edges by v, their projection on polynomials across it,

    v = T u,    T_kl = i^{l−k} ∫ g_k(web) g_l dz    (R10 of docs/theory.md),

with the phases of the functions i^j g_j of both rings. T is real if the web is in the middle of the face. Otherwise the
body is not symmetric, and its harmonics are Hermitian matrices.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss, legendre_functions
from gearbench.compliance.ring import LAYER, Ring
from gearbench.geometry.web import Web

#: Number of functions along the radius of a ring, of polynomials along the axis of the rim in addition to ``seen``, and
#: largest number of polynomials across the web.
ALONG, BEYOND, ACROSS = 8, 9, 8


@dataclass(frozen=True, kw_only=True)
class WebbedRing:
    """Rim, web and hub, held at the bore.

    Parameters
    ----------
    rim
        The rim: a ring down to the web.
    web
        Sizes of web and hub, seen like the rim.
    bore_radius
        Radius [mm] at which hub or, without one, web is held.
    seen
        Number of polynomials along the axis in the result; the edges of the web need more in the rim.
    """

    rim: Ring
    web: Web
    bore_radius: float
    seen: int

    def harmonics(self, n: NDArray) -> NDArray:
        """ĉ_n of the rim's outer edge, as ``Ring.harmonics``; high harmonics do not reach the web."""
        rim, n = self.rim, np.asarray(n, dtype=float)
        reaching = n * (rim.radius - rim.inner_radius) < LAYER * rim.radius
        q, seen, dtype = rim.order[1], self.seen, self._shared.dtype
        compliance = np.zeros((len(n), 3 * seen, 3 * seen), dtype=dtype)
        compliance[~reaching] = replace(rim, order=(rim.order[0], seen)).harmonics(n[~reaching])
        K, edge = replace(rim, held=False).stiffness(n[reaching])
        p = len(edge)
        K = K.reshape(-1, p, 3, q, p, 3, q).astype(dtype)
        T = np.kron(np.eye(3), self._shared)
        K[:, 0, :, :, 0] += (T.conj().T @ self.foundation(n[reaching]) @ T).reshape(-1, 3, q, 3, q)
        load = np.einsum("p,ab->pab", edge, np.eye(3))[:, :, None, :, None] * np.eye(q, seen)[:, None]
        load = load.reshape(3 * p * q, 3 * seen)
        compliance[reaching] = load.T @ np.linalg.solve(K.reshape(len(K), len(load), -1), load)
        return (compliance + _adjoint(compliance)) / 2

    def foundation(self, n: NDArray) -> NDArray:
        """Stiffness of web and hub against motions of the web's outer edge (R11), (harmonic, 3·q, 3·q) of the web."""
        rim, web, q = self.rim, self.web, len(self._shared)
        hub = self.bore_radius < web.hub_radius
        disc = replace(
            rim,
            inner_radius=web.hub_radius,
            radius=web.rim_radius,
            width=web.thickness,
            order=(rim.order[0], q),
            held=not hub,
        )
        if not hub:
            return np.linalg.inv(disc.harmonics(n))
        T = np.kron(np.eye(3), self._shared)
        below = T @ replace(rim, inner_radius=self.bore_radius, radius=web.hub_radius).harmonics(n) @ T.conj().T
        K, edge = disc.stiffness(n)
        part = np.arange(K.shape[1]).reshape(len(edge), 3 * q)
        inner, outer, between = part[0], part[-1], part[1:-1].ravel()
        # the hub yields by u = −c (K_ii u + K_ir v): no inverse of c, which is nearly singular under a thin web
        rest = np.concatenate([outer, between])
        K_ii, K_ir = K[:, inner[:, None], inner], K[:, inner[:, None], rest]
        yields = np.linalg.solve(np.eye(len(inner)) + below @ K_ii, below @ K_ir)
        K = K[:, rest[:, None], rest] - np.swapaxes(K_ir, 1, 2) @ yields
        o, b = np.arange(len(outer)), np.arange(len(outer), len(rest))
        K_bo = K[:, b[:, None], o]
        stiffness = K[:, o[:, None], o] - K[:, o[:, None], b] @ np.linalg.solve(K[:, b[:, None], b], K_bo)
        return (stiffness + _adjoint(stiffness)) / 2

    @property
    def symmetric(self) -> bool:
        """Whether the web lies in the middle of the face."""
        return bool(np.isrealobj(self._shared))

    @property
    def _shared(self) -> NDArray:
        """T (q of the web, q of the rim)."""
        b, web, q = self.rim.width, self.web, self.rim.order[1]
        count = min(q, ACROSS)
        eta, weight = gauss(q + 2)
        y = (web.start + web.thickness * eta) / b
        T = legendre_functions(count, eta).T @ (weight[:, None] * legendre_functions(q, y))
        T *= np.sqrt(web.thickness / b)
        turn = 1j ** ((np.arange(q) - np.arange(count)[:, None]) % 4)
        if abs(web.start + web.stop - b) < 1e-9 * b:
            return T * turn.real
        return T * turn


def _adjoint(matrices: NDArray) -> NDArray:
    return np.conj(np.swapaxes(matrices, -1, -2))
