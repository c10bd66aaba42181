"""Shafts at rest under their loads: the point where bearings settle, and the compliance about it (W3), (W4)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import GearbenchError, InputError
from gearbench.system.shaft_model import METRE, ShaftModel

#: Steps of Newton's method; residual over the load at which bearings have settled, and what rounding may leave of it.
STEPS, SETTLED, ROUNDED = 300, 1e-12, 1e-7
#: Length [mm] that the load moves a shaft by while its bearings carry nothing.
SHORT_STEP = 0.01


@dataclass(frozen=True, kw_only=True)
class Settled:
    """A shaft in its bearings under a load; the spin of the shaft is left out (it is held).

    Parameters
    ----------
    model
        The shaft.
    load
        Forces and moments (size,) on its nodes [N, N·mm].
    """

    model: ShaftModel
    load: NDArray

    @cached_property
    def _free(self) -> NDArray:
        """Motions that are solved for: all but the spin, and the axial one where nothing holds or pushes it."""
        size = self.model.size
        free = np.arange(size) % 6 != 5
        axial = np.arange(2, size, 6)
        total = abs(self.load[axial].sum())
        unloaded = total <= 1e-9 * np.abs(self.load).max(initial=0.0)
        if unloaded and not any(self._may_hold_axially(k) for k in range(len(self.model.shaft.bearings))):
            free[2] = False  # the first node is held: nothing presses on it
        return np.flatnonzero(free)

    def _may_hold_axially(self, number: int) -> bool:
        bearing = self.model.shaft.bearings[number]
        trial = np.array([0.01, 0.01, 0.01, 0.0, 0.0])
        return bool(bearing.force(trial)[1][2, 2] > 0)

    @cached_property
    def motion(self) -> NDArray:
        """Motion (size,) of the nodes [mm, rad]: the least of a convex energy, by Newton's method."""
        u, scale = np.zeros(self.model.size), float(np.abs(self.load).max(initial=0.0))
        residual, K = self._residual(u)
        for _ in range(STEPS):
            if np.abs(residual).max(initial=0.0) <= SETTLED * scale:
                return u
            # bearings that carry nothing yet have no stiffness: steps of a few µm until they do
            soft = np.linalg.eigvalsh(_balanced(K))[0] < 1e-13
            step = np.linalg.solve(K + soft * scale / SHORT_STEP * np.eye(len(K)), residual)
            trial = u.copy()
            trial[self._free] += step
            new, K_new = self._residual(trial)
            halvings = 0
            while not soft and new @ step < -abs(residual @ step) and halvings < 60:
                halvings += 1
                trial[self._free] -= step * 0.5**halvings
                new, K_new = self._residual(trial)
            if np.array_equal(trial, u):
                break
            if not soft and np.abs(new).max() >= np.abs(residual).max() and np.abs(residual).max() <= ROUNDED * scale:
                return u
            u, residual, K = trial, new, K_new
        self._check_support(self._bearings(u)[1])
        raise GearbenchError(f"the bearings of shaft {self.model.shaft.name} find no balance")

    def _residual(self, u: NDArray) -> tuple[NDArray, NDArray]:
        """Load that nothing balances, and the tangent stiffness, of the free motions."""
        F, K = self._bearings(u)
        free = self._free
        return (self.load - self.model.stiffness @ u - F)[free], (self.model.stiffness + K)[np.ix_(free, free)]

    def _bearings(self, u: NDArray) -> tuple[NDArray, NDArray]:
        F, K = np.zeros(self.model.size), np.zeros((self.model.size,) * 2)
        for bearing in self.model.shaft.bearings:
            at = 6 * self.model.node(bearing.position)
            five = slice(at, at + 5)
            force, stiffness = bearing.force(u[five])
            F[five] += force
            K[five, five] += stiffness
        return F, K

    @cached_property
    def bearing_stiffness(self) -> tuple[NDArray, ...]:
        """Stiffness (5, 5) of each bearing at this point."""
        return tuple(bearing.force(self.at(bearing.position))[1] for bearing in self.model.shaft.bearings)

    @property
    def bearing_force(self) -> tuple[NDArray, ...]:
        """Force (5,) of the shaft on each bearing [N, N·mm]."""
        return tuple(bearing.force(self.at(bearing.position))[0] for bearing in self.model.shaft.bearings)

    def at(self, position: float) -> NDArray:
        """Motion (5,) of the node at a position."""
        at = 6 * self.model.node(position)
        return self.motion[at : at + 5]

    @cached_property
    def compliance(self) -> NDArray:
        """Motions per load (size, size) about this point; zero for the spin (W3).

        Raises
        ------
        InputError
            If the bearings leave the shaft a motion that its load would start.
        """
        K = self.model.stiffness + self._bearings(self.motion)[1]
        self._check_support(self._bearings(self.motion)[1])
        free = self._free
        C = np.zeros_like(K)
        inverse = np.linalg.inv(K[np.ix_(free, free)])
        C[np.ix_(free, free)] = (inverse + inverse.T) / 2
        return C

    def _check_support(self, bearings: NDArray) -> None:
        """Refuse a shaft that moves as a rigid body without resistance."""
        model = self.model
        z = model.nodes
        middle, reach = z.mean(), max(np.ptp(z) / 2, 1e-9)
        rigid = np.zeros((len(z), 6, 5))
        rigid[:, range(5), range(5)] = 1.0
        rigid[:, 0, 4], rigid[:, 1, 3] = z - middle, -(z - middle)
        R = rigid.reshape(-1, 5) / np.array([1, 1, 1, reach, reach])
        held = np.array([2]) if 2 not in self._free else np.array([], dtype=int)
        keep = np.setdiff1d(np.arange(5), held)
        K = (R.T @ bearings @ R)[np.ix_(keep, keep)]
        values, vectors = np.linalg.eigh(K)
        if values[0] > 1e-12 * max(values[-1], 1e-300):
            return
        moves = np.zeros(5)
        moves[keep] = vectors[:, 0]
        names = ("across (x)", "across (y)", "axially", "tilting about x", "tilting about y")
        way = names[int(np.argmax(np.abs(moves)))]
        raise InputError(f"system.shafts.{model.shaft.name}.bearings", f"free to move {way}", "must hold the shaft")


def _balanced(A: NDArray) -> NDArray:
    d = 1 / np.sqrt(np.maximum(np.abs(np.diag(A)), 1e-300))
    return A * d[:, None] * d


def external_load(model: ShaftModel) -> NDArray:
    """Constant loads of a shaft, besides those of its meshes, (size,) [N, N·mm]."""
    load = np.zeros(model.size)
    for item in model.shaft.loads:
        at = 6 * model.node(item.position)
        load[at : at + 3] += item.force
        load[at + 3 : at + 6] += np.array(item.moment) * METRE
    return load


def twist(model: ShaftModel, nodes: NDArray, reference: float) -> NDArray:
    """Compliance (n, n) [rad/(N·mm)] of the spin of neighbouring ``nodes``, held at one of them (W4).

    All torque of the gear passes the section nearest to ``reference`` [mm]: an end of the face, on the side where the
    torque comes from, unless it comes from within.
    """
    steps = [0.0, *(beam.twist() for beam in model.beams)]
    angle = np.cumsum(steps)[nodes]
    t = angle - angle[np.argmin(np.abs(model.nodes[nodes] - reference))]
    same = t[:, None] * t > 0
    return np.where(same, np.minimum(np.abs(t)[:, None], np.abs(t)), 0.0)
