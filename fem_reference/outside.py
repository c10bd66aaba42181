"""Outside of a ring in a sector model: rigid motions, and tractions on lugs, as loads on the sector."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem_reference.axis import FaceFunctions
from fem_reference.sector import Section, lagrange
from fem_reference.waves import tooth_weights
from gearbench.compliance.bases import gauss, legendre_functions
from gearbench.compliance.lugs import ACROSS, ALONG, EACH, LugReduction, multiplicity

#: Integration of the tractions on a lug: number of pieces along its arc, Gauss points per piece, points along the axis.
_PIECES, _POINTS, _STATIONS = 12, 4, 16


@dataclass(frozen=True, kw_only=True)
class Outside:
    """Edge of a section at the outside of a ring.

    Parameters
    ----------
    section, axis
        The section of one tooth, and the functions along the axis.
    """

    section: Section
    axis: FaceFunctions

    @cached_property
    def _edges(self) -> list[tuple[int, NDArray, NDArray]]:
        """Quadrilaterals at the outside: (number, positions s along the edge, arc angles there)."""
        found, s = [], np.linspace(0.0, 1.0, 201)
        for number, at in enumerate(self.section.maps):
            R, theta, *_ = at(s, np.zeros_like(s))
            if np.allclose(R, self.section.held_radius, rtol=1e-9):
                found.append((number, s, self._sign * theta))
        return found

    @property
    def _sign(self) -> float:
        return self.section.body.gear.sign

    def _turn(self, y: NDArray) -> NDArray:
        """Rotation of the section's frame at the position y along the axis, as an arc angle [rad]."""
        gear = self.section.body.gear
        return self._sign * math.tan(gear.beta) / gear.pitch_radius * y

    def _work(self, arc: NDArray, y: NDArray, field: NDArray) -> sp.csr_array:
        """Load vectors (function, load): work of tractions ``field`` (point, component, load) on all functions."""
        section, n = self.section, self.section.grain.degree
        along = np.zeros((len(arc), len(section.positions)))
        for number, s, theta in self._edges:
            up = np.argsort(theta)
            inside = (theta[up[0]] - 1e-12 <= arc) & (arc < theta[up[-1]])
            at = np.interp(arc[inside], theta[up], s[up])
            along[np.ix_(inside, section.nodes[number][: n + 1])] = lagrange(n, at)[0]
        touched = np.flatnonzero(along.any(axis=0))
        h = self.axis.values(y)[0]
        functions = (along[:, touched, None] * h[:, None, :]).reshape(len(arc), -1)
        found = (functions.T @ field.reshape(len(arc), -1)).reshape(len(touched), h.shape[1], 3, -1).swapaxes(1, 2)
        rows = ((3 * touched[:, None] + np.arange(3))[:, :, None] * h.shape[1] + np.arange(h.shape[1])).ravel()
        size, number = 3 * len(section.positions) * h.shape[1], field.shape[2]
        at = np.repeat(rows, number), np.tile(np.arange(number), len(rows))
        return sp.coo_array((found.ravel(), at), shape=(size, number)).tocsr()

    @cached_property
    def _motions(self) -> sp.csr_array:
        """Loads shaped like the rigid motions: rotation, axial shift, radial shift (cos, sin), tilt (cos, sin)."""
        eta, w = gauss(_STATIONS)
        b, R = self.axis.breaks[-1], self.section.held_radius
        half = math.pi / abs(self.section.body.gear.teeth)
        ends = np.unique([e for _, _, theta in self._edges for e in (theta[0], theta[-1])])
        pieces = [gauss(_POINTS + 4, low, high) for low, high in pairwise(ends)]
        x, weight = (np.concatenate(each) for each in zip(*pieces, strict=True))
        arc, y = (each.ravel() for each in np.meshgrid(x, b * eta))
        area = (np.outer(b * w, weight) * abs(R)).ravel()
        theta, zero, one = self._sign * (arc + self._turn(y)), np.zeros_like(y), np.ones_like(y)
        c, s, far = np.cos(theta), np.sin(theta), (y - b / 2) / R
        fields = [(zero, one, zero), (zero, zero, one), (c, -s, zero), (s, c, zero)]
        fields += [(-far * c, far * s, c), (-far * s, -far * c, s)]
        field = np.array(fields).transpose(2, 1, 0) * (area / math.sqrt(2 * half * abs(R) * b))[:, None, None]
        return self._work(arc, y, field)

    def rigid(self, loads: int, stiffness: float) -> tuple[list[NDArray], float]:
        """Combinations of the ``loads`` that hold the rigid motions in the waves 0 and 1, and their stiffness.

        The last six loads are those of the rigid motions.
        """
        first, second = np.zeros((loads, 2)), np.zeros((loads, 2), complex)
        first[-6:-4] = np.eye(2)
        second[-4:] = np.kron(np.eye(2), [[1.0], [1j * self._sign]])
        return [first, second], stiffness

    def functionals(self) -> sp.csr_array:
        """Loads on a sector: tractions on its part of each lug, then those of the rigid motions.

        Lugs at the same place relative to the teeth appear once.
        """
        return sp.csr_array(sp.hstack([*(work for lug in self._on_lugs for work in lug.values()), self._motions]))

    @cached_property
    def _places(self) -> tuple[list[float], list[tuple[int, int]]]:
        """Distinct angles of lugs from the nearest tooth, and for each lug the index of its angle and its tooth."""
        body, places, found = self.section.body, [], []
        pitch = abs(body.pitch_angle)
        for angle in body.lugs.angles if body.lugs else ():
            tooth = round(angle / pitch)
            place = round(angle - tooth * pitch, 12)
            if place not in places:
                places.append(place)
            found.append((places.index(place), tooth))
        return places, found

    @property
    def lug_loads(self) -> int:
        """Largest number of loads of the lugs on a sector."""
        body = self.section.body
        if body.lugs is None:
            return 0
        arc = body.lugs.length / abs(self.section.held_radius) + abs(self._turn(np.array(self.axis.breaks[-1])))
        return EACH * len(self._places[0]) * (2 + int(arc / abs(body.pitch_angle)))

    @cached_property
    def _on_lugs(self) -> list[dict[int, sp.csr_array]]:
        """Load vectors of a lug at each place in the sectors that it reaches, by the number of the sector."""
        return [self._on_lug(place) for place in self._places[0]]

    def _on_lug(self, place: float) -> dict[int, sp.csr_array]:
        """Load vectors of a lug at the angle ``place`` from tooth 0 in the sectors that it reaches."""
        body, b = self.section.body, self.axis.breaks[-1]
        assert body.lugs is not None
        pitch, length = abs(body.pitch_angle), body.lugs.length
        x, w = gauss(_POINTS)
        x = ((np.arange(_PIECES)[:, None] + x) / _PIECES).ravel()
        eta, weight = gauss(_STATIONS)
        along, y = (each.ravel() for each in np.meshgrid(x, eta))
        area = np.outer(weight, np.tile(w / _PIECES, _PIECES)).ravel() * math.sqrt(length * b)
        arc = place + (along - 0.5) * length / abs(self.section.held_radius) - self._turn(b * y)
        shape = (legendre_functions(ALONG, along)[:, :, None] * legendre_functions(ACROSS, y)[:, None, :]).reshape(
            len(y), -1
        )
        field = np.einsum("p,cf,pk->pcfk", area, np.eye(3)[[1, 0, 2]].T, shape).reshape(len(y), 3, EACH)
        sector = np.round(arc / pitch).astype(int)
        return {
            j: self._work(arc[at] - j * pitch, b * y[at], field[at])
            for j, at in ((j, sector == j) for j in np.unique(sector).tolist())
        }

    def anchors(self, waves: NDArray, loads: int, stiffness: float) -> LugReduction:
        """Reduction of the compliance of the teeth by the lugs.

        ``waves`` (wave, load, load) is the compliance of ``wave_numbers`` between the loads of flanks, lugs and rigid
        motions; the first ``loads`` belong to the flanks. ``stiffness`` is that of the springs against rigid motions.
        """
        lugs, z, sign = self.section.body.lugs, abs(self.section.body.gear.teeth), self._sign
        assert lugs is not None
        first = loads + EACH * np.cumsum([0, *(len(lug) for lug in self._on_lugs)])
        parts = [
            (slice(number * EACH, (number + 1) * EACH), tooth + j, first[place] + i * EACH + np.arange(EACH))
            for number, (place, tooth) in enumerate(self._places[1])
            for i, j in enumerate(self._on_lugs[place])
        ]
        count, weights = len(lugs.angles) * EACH + 6, tooth_weights(z, np.arange(z))
        own, reach = np.zeros((count, count)), np.zeros((z, loads, count))
        of_teeth = np.real(np.tensordot(weights, waves[:, :loads], 1))
        for lug, tooth, at in parts:
            reach[:, :, lug] += np.roll(of_teeth[:, :, at], tooth, axis=0)
            for other, mate, there in parts:
                own[lug, other] += np.real(np.tensordot(weights[(tooth - mate) % z], waves[:, at[:, None], there], 1))
        held = np.zeros((2, waves.shape[1], 6), complex)
        held[0, [-6, -5], [0, 1]] = math.sqrt(z)
        for i in (2, 4):  # cosine and sine of the waves ±1
            held[1, i - 6, [i, i + 1]] = np.array([1, 1j]) * math.sqrt(z / 2)
            held[1, i - 5, [i, i + 1]] = np.array([1j, -1]) * sign * math.sqrt(z / 2)
        moved = multiplicity(z)[:2, None, None] / z * (waves[:2] @ held)
        turn = np.exp(2j * math.pi / z * np.outer(np.arange(z), [0, 1]))
        reach[..., -6:] = np.real(np.tensordot(turn, moved[:, :loads], 1))
        for lug, tooth, at in parts:
            own[lug, -6:] += np.real(np.tensordot(turn[tooth % z], moved[:, at], 1))
        own[-6:, :-6] = own[:-6, -6:].T
        own[-6:, -6:] = np.sum(np.conj(np.swapaxes(held, 1, 2)) @ moved, axis=0).real
        return LugReduction(reach=reach, own=own + np.diag(np.append(lugs.yields, np.full(6, -1 / stiffness))))
