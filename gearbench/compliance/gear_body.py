"""Teeth on their gear body: solid teeth joined to a ring along their roots; the model "ring" of ``effects.gear_body``.

The root of every tooth moves by q and loads the rim of the ring with tractions t. Both are series of the same
polynomials φ of s and z, orthonormal on the root, for each displacement component. S is the stiffness of the tooth
against motions of its root, Φ the displacement of its flank under these motions, and B the compliance of the ring
between the roots. Then (R6 of docs/theory.md)

    q = B t    S q + t = Φᵀ P    ⇒    deflection of the flank due to the body = Φ (S + B⁻¹)⁻¹ Φᵀ P.

The teeth are alike, so any load on them is a sum of waves m: loads that differ by the factor e^{2πi m/z} from one tooth
to the next. Waves do not interact, and each is solved separately. The roots of a wave meet the ring's harmonics n = m,
m ± z, m ± 2z, …, over which B(m) is a sum. Half-turn symmetry makes all these matrices real in the phases
η = i^{k+j} (times i for u_θ, u_z) of the polynomials P_k(s) g_j(z). With a web off the middle of the face they are
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
from gearbench.compliance.lugs import LugReduction, Lugs, multiplicity, tractions
from gearbench.compliance.ring import APART as RING_APART
from gearbench.compliance.ring import APART_ON_SPRINGS, FIRM, Ring, harmonic_weights, rigid_motions
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.web import Web
from gearbench.threads import lazy

if TYPE_CHECKING:
    from gearbench.compliance.webbed_ring import WebbedRing

#: Largest n ψ of the harmonics, where ψ is the half-angle of a root. The truncation error falls with its square.
FINEST = 30.0
#: All waves up to ``LONG`` are computed. Further waves are computed at steps ``APART`` of ln tan(πm/2z), or ``CLOSER``
#: if springs hold the body. Splines of the degree ``DEGREE`` interpolate between them.
LONG, APART, DEGREE = 5, 0.4, 7
CLOSER = 0.1
#: Ring on lugs: number of functions along the radius; largest n ln(r_i/r_o) that they resolve at the outside; largest
#: n w of the harmonics n of tractions on lugs, where w is the half-angle of a lug.
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
        Rim, web and hub, in the orientation of a driving gear; None for a solid body.
    order
        Number of functions along the radius of the ring; along the axis it has as many as the root of a tooth.
    support
        Stiffness of springs at ``bore_radius``, radial and tangential [N/mm³]; both 0 for a free ring, None for a
        rigidly held body.
    lugs
        Lugs that hold an otherwise free ring (``support`` 0, 0). The compliance then differs from tooth to tooth.
    both_flanks
        Whether the flank polynomials are those of the right flank followed by those of the left flank. The left flank
        is seen with the gear turned over.
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
        """Number of polynomials in z on the root."""
        return self.tooth.root_axis_order

    @lazy
    def tooth_parts(self) -> tuple[NDArray, NDArray]:
        """Stiffness S (r, r) and flank displacement Φ (flank, r) of the tooth (R5), with r = (field, k, j)."""
        # from Ritz functions orthonormal on [0, 1] to functions orthonormal on the root
        scale = math.sqrt(self.root_arc * self.tooth.gear.face_width)
        parts = self.tooth.root_parts(self.axis_order)
        moved = parts.moved / scale
        if self.both_flanks:
            # a tooth turned over about its middle looks the same: the motions of its root change by the factor η²
            moved = np.concatenate([moved, moved * np.real(self._phase**2)])
        return parts.stiffness / scale**2, moved

    @property
    def root_arc(self) -> float:
        """Length of the root of a tooth along the root circle [mm]."""
        return 2 * self.tooth.gear.root_half_angle * self.tooth.gear.root_radius

    @property
    def _apart(self) -> float:
        """Step between computed waves in ln tan(πm/2z); with lugs it is so small that all waves are computed."""
        return APART if self.support is None else CLOSER if self.lugs is None else 0.01 / abs(self.tooth.gear.teeth)

    @property
    def _phase(self) -> NDArray:
        """Phases η of the functions (field, k, j) of the root."""
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
        """Factors of B(m) (R4): weights (m, pair of k ≤ l, …) and computed harmonics (…, field·j·field·j).

        B(m) is their product. Every harmonic is a weighted sum of computed harmonics. Harmonic −n is the conjugate of
        harmonic n, with the signs ±1 of the squared phases of the functions.
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
        spacing = RING_APART if self.support is None else APART_ON_SPRINGS
        computed, weights = harmonic_weights(int(np.abs(n).max()), spacing)
        c = rim_harmonics(self.ring, tuple(computed))
        # signs of the squared phases
        odd = ((-1.0) ** (np.array([1, 0, 1])[:, None] + np.arange(axis))).ravel()
        c = np.concatenate([c, np.conj(c) * (odd[:, None] * odd)]).reshape(2 * len(computed), -1)
        below = (n < 0)[:, :, None]
        weights = np.concatenate(
            [np.where(below, 0.0, weights[np.abs(n)]), np.where(below, weights[np.abs(n)], 0.0)], axis=2
        )
        return squares @ weights, c

    @lazy
    def _waves(self) -> tuple[NDArray, NDArray]:
        """Deflection Φ (S + B⁻¹)⁻¹ Φᵀ of the flank of tooth 0 per unit force, for computed waves, (m, p·q, p·q) each.

        The first array is the part between root motions of equal phase (both ±1 or both ±i), the second that between
        different phases. ``wave_weights`` interpolate between the computed waves.
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
        """Indices of the constant and linear functions (field, k, j) of the root; they include all rigid motions."""
        _, k, j = np.indices((3, self.tooth.order[0], self.axis_order)).reshape(3, -1)
        return np.flatnonzero(k + j <= 1)

    @lazy
    def _spring(self) -> float:
        """Stiffness σ: half the smallest stiffness of the body against the motions ``_lowest``, over all waves."""
        weights, c = self._harmonics
        across, axis = self.tooth.order[0], self.axis_order
        k, l = np.triu_indices(across)
        c = np.real(np.diagonal(c.reshape(len(c), 3 * axis, 3 * axis), axis1=1, axis2=2))
        diagonal = (weights[:, k == l] @ c).reshape(-1, across, 3, axis).swapaxes(1, 2).reshape(len(weights), -1)
        return 0.5 / float(diagonal[:, self._lowest].sum(axis=1).max())

    @property
    def _split(self) -> bool:
        """Whether the functions of the root decouple into two classes: for symmetric faces without helix angle."""
        return not self.tooth.gear.beta and self._symmetric

    def blocks(self, neighbours: int) -> NDArray:
        """Deflection due to the body (R7), (d, p·q, p·q) [mm/N].

        It is that of the flanks of the teeth d = −``neighbours`` … ``neighbours`` under loads on tooth 0.
        """
        z = abs(self.tooth.gear.teeth)
        m = np.arange(z // 2 + 1)
        # only the real part of φ η M η̄ φᵀ remains: sines between the phases ±1 and ±i, cosines otherwise
        twice = np.where((m == 0) | (2 * m == z), 1.0, 2.0) / z
        angle = 2 * math.pi * np.outer(np.arange(neighbours + 1), m) / z
        even, odd = wave_weights(z, self._apart)
        cos, sin = twice * np.cos(angle) @ even, twice * np.sin(angle) @ odd
        same, other = self._waves
        blocks = np.tensordot(cos, np.real(same), 1) + np.tensordot(sin, np.real(other), 1)
        if np.iscomplexobj(same):
            blocks += np.tensordot(cos, np.imag(other), 1) - np.tensordot(sin, np.imag(same), 1)
        return np.concatenate([np.swapaxes(blocks[:0:-1], 1, 2), blocks])

    def flank(self, neighbours: int) -> FlankCompliance:
        """Compliance between any points of the flanks of a driving tooth and its ``neighbours`` on either side."""
        tooth = self.tooth
        blocks = self.blocks(neighbours)
        return FlankCompliance(gear=tooth.gear, order=tooth.flank_order, blocks=blocks, anchors=self.anchors)

    @lazy
    def anchors(self) -> LugReduction | None:
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
        rigid_motions, first = self._held_motions(ring), b.shape[2]
        b = np.concatenate(
            [b, np.zeros((*b.shape[:2], rigid_motions[0].shape[1] + 2 * rigid_motions[1].shape[1]), complex)], axis=2
        )
        b[0, :, first : first + 2] = 1j * rigid_motions[0] / math.sqrt(2 * math.pi)  # components along θ and z
        b[1, :, first + 2 :] = np.hstack([rigid_motions[1], 1j * rigid_motions[1]]) / (2 * math.sqrt(math.pi))
        # harmonics that are not resolved see a half-space
        solved = np.minimum(n, len(edges) - 1)
        outside = edges[solved, 3 * q :, 3 * q :] * (np.maximum(solved, 1) / np.maximum(n, 1))[:, None, None]
        twice = np.where(n == 0, 1.0, 2.0)[:, None, None]
        C = 2 * math.pi * _work(twice * b, _applied(outside, b))
        at_rim = _applied(edges[:, : 3 * q, 3 * q :], b[: len(edges)])
        waves = self._rooted(at_rim)
        sign = np.real(self._phase) + np.imag(self._phase)
        S, phi = self.tooth_parts[0] * sign[:, None] * sign, self.tooth_parts[1] * self._phase
        parts = self._joint(S, waves)
        weight = multiplicity(z)[:, None, None]
        C -= z * _work(weight * waves, _applied(S, parts))
        turn = np.exp(2j * math.pi / z * np.outer(np.arange(z), np.arange(z // 2 + 1)))
        reach = np.real(np.tensordot(turn, weight * (phi @ parts), 1))
        rigid = np.full(C.shape[0] - first, -1 / (ring.grip * ring.E))
        return LugReduction(reach=reach, own=C + np.diag(np.concatenate([lugs.yields, rigid])))

    def _held_motions(self, ring: Ring) -> list[NDArray]:
        """Rigid motions of the outside, in the harmonics 0 and 1, that springs hold on a free ring."""
        K, _ = replace(ring, support=None, held=False).stiffness(np.array([0.0, 1.0]))
        return [rigid_motions(free, self.axis_order) for free in K]

    def _rooted(self, displacement: NDArray) -> NDArray:
        """Motions of the root of tooth 0 for the waves m = 0 … z/2, (m, root, …), in the phases of its functions.

        ``displacement``: amplitudes of the rim for the harmonics n = 0, 1, …, (n, field·j, …).
        """
        gear, across, q = self.tooth.gear, self.tooth.order[0], self.axis_order
        z, psi, last = abs(gear.teeth), abs(gear.root_half_angle), len(displacement) - 1
        odd = ((-1.0) ** (np.array([1, 0, 1])[:, None] + np.arange(q))).ravel()[:, None]
        at_roots = np.zeros((z // 2 + 1, 3, across, q, displacement.shape[2]), complex)
        for n in range(-last, last + 1):
            m = n % z
            if m > z // 2:
                continue
            bessel = _legendre_transform(across, np.array([n * psi]))[0] * math.sqrt(self.root_arc)
            rim = displacement[n] if n >= 0 else odd * np.conj(displacement[-n])
            at_roots[m] += bessel[:, None, None] * rim.reshape(3, 1, q, -1)
        return at_roots.reshape(z // 2 + 1, 3 * across * q, -1)

    def _joint(self, S: NDArray, displacement: NDArray) -> NDArray:
        """Motions of the root after the teeth have stiffened the ring: (1 + B S)⁻¹ ``displacement``, (m, root, …)."""
        weights, c = self._harmonics
        ((parts, taken),) = _coupled_functions(self.tooth.order[0], self.axis_order, False)
        order = np.concatenate(parts)
        B = np.empty((len(weights), len(order), len(order)))
        B[:, order[:, None], order] = (weights @ c).reshape(len(weights), -1)[:, taken]
        return np.linalg.solve(np.eye(len(order)) + B @ S, displacement.view(float)).view(complex)


def _applied(real: NDArray, x: NDArray) -> NDArray:
    """A real matrix (…, n, n) times contiguous complex columns x (…, n, k), in real arithmetic."""
    return (real @ x.view(float)).view(complex)


def _work(first: NDArray, second: NDArray) -> NDArray:
    """Re Σ first̄ᵀ second over harmonics and amplitudes (harmonic, amplitude, functional), (functional, functional)."""
    rows = first.shape[0] * first.shape[1]
    parts = ((np.real(x).reshape(rows, -1), np.imag(x).reshape(rows, -1)) for x in (first, second))
    (a, b), (c, d) = parts
    return a.T @ c + b.T @ d


@dataclass(frozen=True, kw_only=True)
class _SprungTooth:
    """A tooth with springs σ against the motions ``low`` of its root, so that S_σ has an inverse.

    The springs are subtracted from the body again. With B_σ⁻¹ = B⁻¹ − σ E Eᵀ and S_σ = S + σ E Eᵀ,

        (S + B⁻¹)⁻¹ = S_σ⁻¹ − S_σ⁻¹ (S_σ⁻¹ + B_σ)⁻¹ S_σ⁻¹.

    The functions of the root belong to two phases, ±1 and ±i, which S does not couple. ``yields`` is S_σ⁻¹, ``moved``
    S_σ⁻¹ Φᵀ of each phase, ``alone`` Φ S_σ⁻¹ Φᵀ, and ``spring`` σ.
    """

    yields: NDArray
    moved: list[NDArray]
    alone: NDArray
    low: NDArray
    spring: float

    @classmethod
    def on_springs(cls, S: list[NDArray], phi: list[NDArray], low: NDArray, spring: float) -> _SprungTooth:
        """Compute S_σ⁻¹ of both phases in one matrix, S_σ⁻¹ Φᵀ of each phase, and Φ S_σ⁻¹ Φᵀ summed over the phases."""
        n, sizes = len(S[0]) + len(S[1]), np.array([0, len(S[0])])
        yields, alone, moved = np.zeros((n, n)), np.zeros(2 * (len(phi[0]),)), []
        for part, shapes, start in zip(S, phi, sizes, strict=True):
            sprung = part.copy()
            low_in_part = low[(low >= start) & (low < start + len(part))] - start
            sprung[low_in_part, low_in_part] += spring
            inverse = np.linalg.inv(sprung)
            yields[start : start + len(part), start : start + len(part)] = inverse
            moved.append(inverse @ shapes.T)
            alone += shapes @ moved[-1]
        return cls(yields=yields, moved=moved, alone=(alone + alone.T) / 2, low=low, spring=spring)

    def join(self, every: NDArray, taken: NDArray, same: NDArray, other: NDArray) -> None:
        """Add Φ (S + B⁻¹)⁻¹ Φᵀ of the waves to ``same`` and ``other``, (m, flank, flank).

        ``same`` has the part within the phases, ``other`` the part between them.
        ``taken`` (n, n) are the indices of the entries of ``every`` (m, …) that make up the Hermitian B of a wave.
        """
        low, n, size = self.low, len(self.moved[0]), len(taken)
        if np.isrealobj(every):
            from gearbench.compliance._ring_kernels import join

            tooth = self.yields, np.concatenate(self.moved), n, self.alone, low, 1 / self.spring
            if not join(np.ascontiguousarray(every), taken, tooth, same, other, addresses()):
                raise np.linalg.LinAlgError("a tooth on its body is not positive definite")
            return
        # one wave at a time, so that its data stay in the cache
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
    """Phases η of the functions (field, k, j) of a root, flat."""
    k, j = np.arange(across)[:, None], np.arange(axis)
    return (1j ** (np.array([1, 0, 1])[:, None, None] + k + j)).ravel()


@lru_cache(maxsize=16)
def _coupled_functions(across: int, axis: int, split: bool) -> list[tuple[list[NDArray], NDArray]]:
    """Classes of coupled functions (field, k, j) of the root: two if they are ``split``, else one.

    A class holds the indices of its functions of the phases ±1 and ±i, and the indices of the entries of its B in an
    array (pair of k ≤ l, field, j, field, j).
    """
    pair = np.zeros((across, across), dtype=int)
    k, l = np.triu_indices(across)
    pair[k, l] = pair[l, k] = np.arange(len(k))
    order = np.arange(len(k) * (3 * axis) ** 2).reshape(-1, 3, axis, 3, axis)[pair]
    order = order.transpose(2, 0, 3, 4, 1, 5).reshape(2 * (3 * across * axis,))
    field, _, j = np.indices((3, across, axis)).reshape(3, -1)
    number = (j + (field == 2)) % 2 if split else np.zeros(len(order), dtype=int)
    side = np.abs(np.imag(_phases(across, axis))).astype(int)
    groups = []
    for group in range(number.max() + 1):
        parts = [np.flatnonzero((number == group) & (side == k)) for k in range(2)]
        both = np.concatenate(parts)
        groups.append((parts, np.ascontiguousarray(order[np.ix_(both, both)])))
    return groups


def waves_computed(teeth: int, spacing: float = APART) -> NDArray:
    """Numbers m of the computed waves among 0 … z/2."""
    most = teeth // 2
    if most <= LONG:
        return np.arange(most + 1)
    start, stop = _abscissa(np.array([LONG, most]), teeth)
    short = np.linspace(start, stop, 1 + math.ceil((stop - start) / spacing))
    short = np.round(2 * teeth / math.pi * np.arctan(np.exp(short)))
    return np.unique(np.append(np.arange(LONG), short)).astype(int)


def _abscissa(m: NDArray, teeth: int) -> NDArray:
    """Abscissa ln tan(πm/2z) of the splines between waves; it behaves like ln m for long waves."""
    return np.log(np.tan(math.pi * m / (2 * teeth)))


@lru_cache(maxsize=64)
def wave_weights(teeth: int, spacing: float = APART) -> tuple[NDArray, NDArray]:
    """Weights (m, computed) of the computed waves in the waves m = 0 … z/2, for functions even and odd about z/2.

    Such a function, multiplied by sin(πm/z), is smooth in ln tan(πm/2z).
    """
    with_zero, most = waves_computed(teeth, spacing), teeth // 2
    if len(with_zero) == most + 1:
        return np.eye(most + 1), np.eye(most + 1)
    computed = with_zero[1:]
    # the splines continue beyond z/2, even or odd
    below = computed[2 * computed < teeth][::-1]
    knots, waves = np.append(computed, teeth - below), np.arange(1, most + 1)
    splines = spline_weights(_abscissa(knots, teeth), _abscissa(waves, teeth), DEGREE)
    both = []
    for sign in (1.0, -1.0):
        values = np.concatenate([np.eye(len(computed)), sign * np.eye(len(computed))[: len(below)][::-1]])
        weights = np.eye(most + 1, len(with_zero))
        weights[1:, 1:] = (
            splines @ values * np.sin(math.pi * computed / teeth) / np.sin(math.pi * waves / teeth)[:, None]
        )
        both.append(weights)
    return both[0], both[1]


@lru_cache(maxsize=16)
def rim_harmonics(ring: Ring | WebbedRing, n: tuple[float, ...]) -> NDArray:
    """``ring.harmonics`` of the numbers n, cached because teeth of different orders share a ring."""
    harmonics = ring.harmonics(np.array(n))
    harmonics.flags.writeable = False
    return harmonics


def _legendre_transform(count: int, x: NDArray) -> NDArray:
    """Transform ½ ∫ P̂_k(s) e^{−ixs} ds · i^k = √(2k+1) j_k(x) of the orthonormal Legendre functions, (…, count)."""
    from scipy.special import spherical_jn

    k = np.arange(count)
    # j_k(−x) = (−1)^k j_k(x)
    sign = np.where(x[..., None] < 0, (-1.0) ** k, 1.0)
    return np.sqrt(2 * k + 1) * sign * spherical_jn(k, np.abs(x)[..., None])
