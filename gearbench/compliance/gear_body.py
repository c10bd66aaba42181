"""Teeth on their gear body: solid teeth joined to a ring along their roots.

The root of every tooth moves by q (polynomials of s and z for each displacement) and loads the rim of the ring with
tractions t in the same polynomials φ (orthonormal on the root). With the tooth's stiffness S against motions of
its root, the displacement Φ of its flank under them, and the compliance B of the ring between the roots (R6 of
docs/theory.md),

    q = B t    S q + t = Φᵀ P    ⇒    deflection of the flank due to the body = Φ (S + B⁻¹)⁻¹ Φᵀ P.

The gear is periodic: with waves e^{2πi m d/z} over the teeth d, the ring's harmonics n = m, m ± z,
m ± 2z, … make up B(m), and each wave is solved separately. Half-turn symmetry makes all these matrices real in the
phases η = i^{k+j} (times i for u_θ, u_z) of the polynomials P_k(s) g_j(z); with a web out of the middle they are
Hermitian.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import spline_weights
from gearbench.compliance.flank import FlankCompliance
from gearbench.compliance.lapack import addresses, cholesky, solve_lower
from gearbench.compliance.lugs import Anchors, Lugs, often, tractions
from gearbench.compliance.ring import APART as RING_APART
from gearbench.compliance.ring import APART_ON_SPRINGS, FIRM, Ring, harmonic_weights, rigid_motions
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.web import Web
from gearbench.threads import lazy

if TYPE_CHECKING:
    from gearbench.compliance.webbed_ring import WebbedRing

#: Largest n ψ of the harmonics, ψ the half-angle of a root: the remainder falls like its square.
FINEST = 30.0
#: All waves up to ``LONG`` are computed, and further ones these steps of ln tan(πm/2z) apart, closer where springs
#: hold the body; degree of the spline between them.
LONG, APART, DEGREE = 5, 0.4, 7
CLOSER = 0.1
#: Functions along the radius of a ring on lugs, and the greatest n ln(r_i/r_o) they resolve at its outside; n w of the
#: shortest harmonics of the tractions on lugs of the half-angle w.
FINE, RESOLVED, SHORT = 16, 16.0, 24.0


@dataclass(frozen=True, kw_only=True)
class ToothedRing:
    """A ring with teeth along its rim; ``flank`` is the compliance that the ring adds to the teeth.

    Parameters
    ----------
    tooth
        The tooth, with its flank polynomials.
    bore_radius
        Radius [mm] at which the body is held; negative for the outside of an internal gear.
    web
        Rim, web and hub, seen as on a driving gear; None for a solid body.
    order
        Number of functions along the radius of the ring; along the axis as for the tooth.
    support
        Stiffness of springs at ``bore_radius``, radial and along the edge [N/mm³], both 0 of a free ring; None where
        the body is held firmly.
    lugs
        Lugs that a ring of the same ``support`` as a free one is held by; all teeth are then different.
    both_flanks
        Whether the polynomials are those of the right flank of a tooth and, behind them, those of its left one, as it
        is seen when the gear is turned over.
    """

    tooth: SolidTooth
    bore_radius: float
    web: Web | None = None
    order: int = 6
    support: tuple[float, float] | None = None
    lugs: Lugs | None = None
    both_flanks: bool = False

    @property
    def axis_order(self) -> int:
        """Number of polynomials in z of the root."""
        return self.tooth.root_axis_order

    @lazy
    def tooth_parts(self) -> tuple[NDArray, NDArray]:
        """S (r, r) and Φ (flank, r) of the tooth, r = (field, k, j): (R5)."""
        # from the Ritz functions, orthonormal on [0, 1], to those orthonormal on the root
        scale = math.sqrt(self.root_arc * self.tooth.gear.face_width)
        parts = self.tooth.root_parts(self.axis_order)
        moved = parts.moved / scale
        if self.both_flanks:
            # a tooth turned over about its middle looks the same: its root moves by η² as much
            moved = np.concatenate([moved, moved * np.real(self._phase**2)])
        return parts.stiffness / scale**2, moved

    @property
    def root_arc(self) -> float:
        """Length of the root of a tooth along the root circle [mm]."""
        return 2 * self.tooth.gear.root_half_angle * self.tooth.gear.root_radius

    @property
    def _apart(self) -> float:
        """Steps between the waves computed; all of them where there are lugs, as far apart as they may be."""
        return APART if self.support is None else CLOSER if self.lugs is None else 0.01 / abs(self.tooth.gear.teeth)

    @property
    def _phase(self) -> NDArray:
        """η of the functions (field, k, j)."""
        return _phases(self.tooth.order[0], self.axis_order)

    @lazy
    def ring(self) -> Ring | WebbedRing:
        """The body without its teeth."""
        gear, web, axis = self.tooth.gear, self.web, self.axis_order
        ring = Ring(
            inner_radius=self.bore_radius,
            radius=gear.root_radius,
            width=gear.face_width,
            screw=math.tan(gear.beta) / gear.pitch_radius,
            E=self.tooth.E,
            nu=self.tooth.nu,
            order=(self.order if self.lugs is None else FINE, axis),
            support=self.support,
            grip=FIRM if self.lugs is None else 1.0,
        )
        if web is None:
            return ring
        from gearbench.compliance.webbed_ring import ALONG, BEYOND, WebbedRing

        rim = replace(ring, inner_radius=web.rim_radius, order=(ALONG, axis + BEYOND))
        return WebbedRing(rim=rim, web=web, bore_radius=self.bore_radius, seen=axis)

    @property
    def _symmetric(self) -> bool:
        """Whether the body is symmetric about the middle of the face."""
        return isinstance(self.ring, Ring) or self.ring.symmetric

    @lazy
    def _harmonics(self) -> tuple[NDArray, NDArray]:
        """B(m) of waves m computed as weights (m, pair of k ≤ l, …) times (…, field·j·field·j) (R4).

        Every harmonic is a weighted sum of computed ones. Harmonic −n is the conjugate of n; in the phases of the
        functions this leaves their squares, ±1.
        """
        gear = self.tooth.gear
        across, axis = self.tooth.order[0], self.axis_order
        z, psi = abs(gear.teeth), abs(gear.root_half_angle)
        turns = math.ceil(FINEST / psi / z)
        m = waves_computed(z, self._apart)
        n = m[:, None] + z * np.arange(-turns, turns + 1)
        bessel = _legendre_transform(across, n * psi) * math.sqrt(z * self.root_arc / (2 * math.pi))
        k, l = np.triu_indices(across)
        squares = np.swapaxes(bessel[:, :, k] * bessel[:, :, l], 1, 2)
        apart = RING_APART if self.support is None else APART_ON_SPRINGS
        some, each = harmonic_weights(int(np.abs(n).max()), apart)
        c = rim_harmonics(self.ring, tuple(some))
        odd = ((-1.0) ** (np.array([1, 0, 1])[:, None] + np.arange(axis))).ravel()
        c = np.concatenate([c, np.conj(c) * (odd[:, None] * odd)]).reshape(2 * len(some), -1)
        below = (n < 0)[:, :, None]
        each = np.concatenate([np.where(below, 0.0, each[np.abs(n)]), np.where(below, each[np.abs(n)], 0.0)], axis=2)
        return squares @ each, c

    @lazy
    def _waves(self) -> tuple[NDArray, NDArray]:
        """Deflection Φ (S + B⁻¹)⁻¹ Φᵀ of the flank of tooth 0 per unit force, of waves m = 0 … z/2, (m, p·q, p·q).

        First between motions of the root of equal phase, ±1 or ±i, then between different phases. Only for computed
        waves; ``wave_weights`` interpolate between them.
        """
        weights, c = self._harmonics
        sign = np.real(self._phase) + np.imag(self._phase)
        S, phi = self.tooth_parts[0] * sign[:, None] * sign, self.tooth_parts[1] * sign
        B = (weights @ c).reshape(len(weights), -1)
        same, other = np.zeros((2, len(B), len(phi), len(phi)), dtype=c.dtype)
        for parts, taken in _coupled_functions(self.tooth.order[0], self.axis_order, self._split):
            low = np.flatnonzero(np.isin(np.concatenate(parts), self._lowest))
            sprung = _SprungTooth.on_springs(
                [S[np.ix_(p, p)] for p in parts], [phi[:, p] for p in parts], low, self._spring
            )
            sprung.join(B, taken, same, other)
        return same, other

    @property
    def _lowest(self) -> NDArray:
        """Constant and linear functions (field, k, j) of the root, which include all motions without strain."""
        _, k, j = np.indices((3, self.tooth.order[0], self.axis_order)).reshape(3, -1)
        return np.flatnonzero(k + j <= 1)

    @lazy
    def _spring(self) -> float:
        """Half of the least stiffness of the body against each of these motions, over all waves."""
        weights, c = self._harmonics
        across, axis = self.tooth.order[0], self.axis_order
        k, l = np.triu_indices(across)
        c = np.real(np.diagonal(c.reshape(len(c), 3 * axis, 3 * axis), axis1=1, axis2=2))
        diagonal = (weights[:, k == l] @ c).reshape(-1, across, 3, axis).swapaxes(1, 2).reshape(len(weights), -1)
        return 0.5 / float(diagonal[:, self._lowest].sum(axis=1).max())

    @property
    def _split(self) -> bool:
        """Whether functions of the root decouple in two classes: symmetric faces and no helix angle."""
        return not self.tooth.gear.beta and self._symmetric

    def blocks(self, neighbours: int) -> NDArray:
        """Deflection [mm/N] of the flank of tooth d = −n … n due to the body, loads on tooth 0 (R7): (d, p·q, p·q)."""
        z = abs(self.tooth.gear.teeth)
        m = np.arange(z // 2 + 1)
        # the real part of φ η M η̄ φᵀ is left: sines between the phases ±1 and ±i, cosines otherwise
        twice = np.where((m == 0) | (2 * m == z), 1.0, 2.0) / z
        angle = 2 * math.pi * np.outer(np.arange(neighbours + 1), m) / z
        even, odd = wave_weights(z, self._apart)
        cos, sin = twice * np.cos(angle) @ even, twice * np.sin(angle) @ odd
        same, other = self._waves
        found = np.tensordot(cos, np.real(same), 1) + np.tensordot(sin, np.real(other), 1)
        if np.iscomplexobj(same):
            found += np.tensordot(cos, np.imag(other), 1) - np.tensordot(sin, np.imag(same), 1)
        return np.concatenate([np.swapaxes(found[:0:-1], 1, 2), found])

    def flank(self, neighbours: int) -> FlankCompliance:
        """The compliance for any points of the flanks of a driving tooth and its ``neighbours`` on each side."""
        tooth = self.tooth
        blocks = self.blocks(neighbours)
        return FlankCompliance(gear=tooth.gear, order=tooth.flank_order, blocks=blocks, anchors=self.anchors)

    @lazy
    def anchors(self) -> Anchors | None:
        """Reduction of the compliance of the teeth by the lugs (R13)."""
        ring, z, q, lugs = self.ring, abs(self.tooth.gear.teeth), self.axis_order, self.lugs
        if lugs is None or not isinstance(ring, Ring):
            return None
        half, depth = lugs.length / 2 / abs(self.bore_radius), abs(math.log(self.bore_radius / ring.radius))
        most, last = math.ceil(SHORT / half), math.floor(RESOLVED / depth)
        numbers, weights = harmonic_weights(min(most, last), APART_ON_SPRINGS)
        edges = np.tensordot(weights, ring.edges(numbers), 1)
        n = np.arange(most + 1)
        b = tractions(lugs, ring, n)
        held, at = self._held_motions(ring), b.shape[2]
        b = np.concatenate([b, np.zeros((*b.shape[:2], held[0].shape[1] + 2 * held[1].shape[1]), complex)], axis=2)
        b[0, :, at : at + 2] = 1j * held[0] / math.sqrt(2 * math.pi)  # both along θ and z
        b[1, :, at + 2 :] = np.hstack([held[1], 1j * held[1]]) / (2 * math.sqrt(math.pi))
        # beyond those resolved the edge is a half-space
        solved = np.minimum(n, len(edges) - 1)
        own = edges[solved, 3 * q :, 3 * q :] * (np.maximum(solved, 1) / np.maximum(n, 1))[:, None, None]
        twice = np.where(n == 0, 1.0, 2.0)[:, None, None]
        C = 2 * math.pi * np.real(np.sum(twice * (np.conj(np.swapaxes(b, 1, 2)) @ (own @ b)), axis=0))
        moved = edges[:, : 3 * q, 3 * q :] @ b[: len(edges)]
        waves = self._rooted(moved)
        sign = np.real(self._phase) + np.imag(self._phase)
        S, phi = self.tooth_parts[0] * sign[:, None] * sign, self.tooth_parts[1] * self._phase
        parts = self._joint(S, waves)
        weight = often(z)[:, None, None]
        C -= z * np.real(np.sum(weight * (np.conj(np.swapaxes(waves, 1, 2)) @ (S @ parts)), axis=0))
        turn = np.exp(2j * math.pi / z * np.outer(np.arange(z), np.arange(z // 2 + 1)))
        reach = np.real(np.tensordot(turn, weight * (phi @ parts), 1))
        rigid = np.full(C.shape[0] - at, -1 / (ring.grip * ring.E))
        return Anchors(reach=reach, own=C + np.diag(np.concatenate([lugs.yields, rigid])))

    def _held_motions(self, ring: Ring) -> list[NDArray]:
        """Motions of the outside that the springs of a free ring resist, of harmonics 0 and 1."""
        K, _ = replace(ring, support=None, held=False).stiffness(np.array([0.0, 1.0]))
        return [rigid_motions(free, self.axis_order) for free in K]

    def _rooted(self, moved: NDArray) -> NDArray:
        """Motions of the root of tooth 0 in the waves m = 0 … z/2, (m, root, …), in the phases of its functions.

        ``moved``: amplitudes of the rim in the harmonics n = 0, 1, …, (n, field·j, …).
        """
        gear, across, q = self.tooth.gear, self.tooth.order[0], self.axis_order
        z, psi, last = abs(gear.teeth), abs(gear.root_half_angle), len(moved) - 1
        odd = ((-1.0) ** (np.array([1, 0, 1])[:, None] + np.arange(q))).ravel()[:, None]
        found = np.zeros((z // 2 + 1, 3, across, q, moved.shape[2]), complex)
        for n in range(-last, last + 1):
            m = n % z
            if m > z // 2:
                continue
            bessel = _legendre_transform(across, np.array([n * psi]))[0] * math.sqrt(self.root_arc)
            rim = moved[n] if n >= 0 else odd * np.conj(moved[-n])
            found[m] += bessel[:, None, None] * rim.reshape(3, 1, q, -1)
        return found.reshape(z // 2 + 1, 3 * across * q, -1)

    def _joint(self, S: NDArray, moved: NDArray) -> NDArray:
        """(1 + B S)⁻¹ of motions of the root, (m, root, …): what teeth leave of the ring's motion."""
        weights, c = self._harmonics
        ((parts, taken),) = _coupled_functions(self.tooth.order[0], self.axis_order, False)
        order = np.concatenate(parts)
        B = np.empty((len(weights), len(order), len(order)))
        B[:, order[:, None], order] = (weights @ c).reshape(len(weights), -1)[:, taken]
        return np.linalg.solve(np.eye(len(order)) + B @ S, moved)


@dataclass(frozen=True, kw_only=True)
class _SprungTooth:
    """A tooth on springs σ against ``low`` motions of its root, so that no motion is free; for two phases.

    With the springs subtracted from the body, B_σ⁻¹ = B⁻¹ − σ E Eᵀ and S_σ = S + σ E Eᵀ,

        (S + B⁻¹)⁻¹ = S_σ⁻¹ − S_σ⁻¹ (S_σ⁻¹ + B_σ)⁻¹ S_σ⁻¹.
    """

    yields: NDArray
    moved: list[NDArray]
    alone: NDArray
    low: NDArray
    spring: float

    @classmethod
    def on_springs(cls, S: list[NDArray], phi: list[NDArray], low: NDArray, spring: float) -> _SprungTooth:
        """S_σ⁻¹ of both phases in one matrix, Φ S_σ⁻¹ and Φ S_σ⁻¹ Φᵀ."""
        n, sizes = len(S[0]) + len(S[1]), np.array([0, len(S[0])])
        yields, alone, moved = np.zeros((n, n)), np.zeros(2 * (len(phi[0]),)), []
        for part, shapes, start in zip(S, phi, sizes, strict=True):
            held = part.copy()
            mine = low[(low >= start) & (low < start + len(part))] - start
            held[mine, mine] += spring
            soft = np.linalg.inv(held)
            yields[start : start + len(part), start : start + len(part)] = soft
            moved.append(soft @ shapes.T)
            alone += shapes @ moved[-1]
        return cls(yields=yields, moved=moved, alone=(alone + alone.T) / 2, low=low, spring=spring)

    def join(self, every: NDArray, taken: NDArray, same: NDArray, other: NDArray) -> None:
        """Add Φ (S + B⁻¹)⁻¹ Φᵀ of the waves, within the phases and between the two, to two of (m, flank, flank).

        ``taken``: which numbers of a wave, ``every`` (m, …), make up its Hermitian B (n, n).
        """
        low, n, size = self.low, len(self.moved[0]), len(taken)
        if np.isrealobj(every):
            from gearbench.compliance._ring_kernels import join

            tooth = self.yields, np.concatenate(self.moved), n, self.alone, low, 1 / self.spring
            if not join(np.ascontiguousarray(every), taken, tooth, same, other, addresses()):
                raise np.linalg.LinAlgError("a tooth on its body is not positive definite")
            return
        # one wave at a time: its data stay in the cache
        B, halves = (np.empty((k, w), every.dtype) for k, w in ((size, size), (2 * size - n, len(self.alone))))
        first, second = halves[:size], halves[size:]
        for k, numbers in enumerate(every):
            np.take(numbers, taken, out=B, mode="clip")
            pressed = B[:, low]
            lent = np.linalg.inv(np.eye(len(low)) / self.spring - pressed[low])
            B += pressed @ lent @ pressed.T.conj()
            B += self.yields
            first[:n], first[n:], second[:] = self.moved[0], 0.0, self.moved[1]
            L = cholesky(B)
            solve_lower(L, first)
            solve_lower(L[n:, n:], second)
            same[k] += self.alone
            same[k] -= halves.T.conj() @ halves
            between = second.T.conj() @ first[n:]
            other[k] += between - between.T.conj()


@lru_cache(maxsize=16)
def _phases(across: int, axis: int) -> NDArray:
    """η of the functions (field, k, j) of a root."""
    k, j = np.arange(across)[:, None], np.arange(axis)
    return (1j ** (np.array([1, 0, 1])[:, None, None] + k + j)).ravel()


@lru_cache(maxsize=16)
def _coupled_functions(across: int, axis: int, split: bool) -> list[tuple[list[NDArray], NDArray]]:
    """Coupled functions of the root (field, k, j): one of two classes if they are ``split``, else all.

    For each class the functions of phase ±1 and ±i, and the numbers (pair of k ≤ l, field, j, field, j) of their B.
    """
    pair = np.zeros((across, across), dtype=int)
    k, l = np.triu_indices(across)
    pair[k, l] = pair[l, k] = np.arange(len(k))
    order = np.arange(len(k) * (3 * axis) ** 2).reshape(-1, 3, axis, 3, axis)[pair]
    order = order.transpose(2, 0, 3, 4, 1, 5).reshape(2 * (3 * across * axis,))
    field, _, j = np.indices((3, across, axis)).reshape(3, -1)
    number = (j + (field == 2)) % 2 if split else np.zeros(len(order), dtype=int)
    side = np.abs(np.imag(_phases(across, axis))).astype(int)
    found = []
    for mine in range(number.max() + 1):
        parts = [np.flatnonzero((number == mine) & (side == k)) for k in range(2)]
        both = np.concatenate(parts)
        found.append((parts, np.ascontiguousarray(order[np.ix_(both, both)])))
    return found


def waves_computed(teeth: int, apart: float = APART) -> NDArray:
    """Computed waves m of 0 … z/2."""
    most = teeth // 2
    if most <= LONG:
        return np.arange(most + 1)
    start, stop = _abscissa(np.array([LONG, most]), teeth)
    short = np.linspace(start, stop, 1 + math.ceil((stop - start) / apart))
    short = np.round(2 * teeth / math.pi * np.arctan(np.exp(short)))
    return np.unique(np.append(np.arange(LONG), short)).astype(int)


def _abscissa(m: NDArray, teeth: int) -> NDArray:
    """Abscissa of the splines between waves: ln m for long waves."""
    return np.log(np.tan(math.pi * m / (2 * teeth)))


@lru_cache(maxsize=64)
def wave_weights(teeth: int, apart: float = APART) -> tuple[NDArray, NDArray]:
    """Weights of computed waves in all waves m = 0 … z/2, (m, computed), for even and odd functions about z/2.

    Times sin(πm/z) they are smooth in ln tan(πm/2z).
    """
    some, most = waves_computed(teeth, apart), teeth // 2
    if len(some) == most + 1:
        return np.eye(most + 1), np.eye(most + 1)
    own = some[1:]
    below = own[2 * own < teeth][::-1]
    knots, at = np.append(own, teeth - below), np.arange(1, most + 1)
    each = spline_weights(_abscissa(knots, teeth), _abscissa(at, teeth), DEGREE)
    both = []
    for sign in (1.0, -1.0):
        values = np.concatenate([np.eye(len(own)), sign * np.eye(len(own))[: len(below)][::-1]])
        weights = np.eye(most + 1, len(some))
        weights[1:, 1:] = each @ values * np.sin(math.pi * own / teeth) / np.sin(math.pi * at / teeth)[:, None]
        both.append(weights)
    return both[0], both[1]


@lru_cache(maxsize=16)
def rim_harmonics(ring: Ring | WebbedRing, n: tuple[float, ...]) -> NDArray:
    """``ring.harmonics`` of the numbers n, cached, because teeth of other orders use the same ring."""
    found = ring.harmonics(np.array(n))
    found.flags.writeable = False
    return found


def _legendre_transform(count: int, x: NDArray) -> NDArray:
    """½ ∫ P̂_k(s) e^{−ixs} ds · i^k of Legendre functions orthonormal on [0, 1]: √(2k+1) j_k(x), (…, count)."""
    from scipy.special import spherical_jn

    k = np.arange(count)
    # j_k(−x) = (−1)^k j_k(x)
    sign = np.where(x[..., None] < 0, (-1.0) ** k, 1.0)
    return np.sqrt(2 * k + 1) * sign * spherical_jn(k, np.abs(x)[..., None])
