"""Static equilibrium of shafts in their bearings, and the compliance about this equilibrium.

W-numbers of this package are equations of docs/theory.md; here (W3) and (W4).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import GearbenchError, InputError
from gearbench.system.bearing import Bearing
from gearbench.system.shaft_model import METRE, ShaftModel
from gearbench.system.structure import Structure

#: Largest number of steps of Newton's method.
STEPS = 300
#: Residual relative to the load at convergence, and that accepted if rounding prevents further progress.
CONVERGED, ROUNDED = 1e-12, 1e-7
#: Step length [mm] of a shaft under its load while no bearing carries it.
SHORT_STEP = 0.01
#: Eigenvalue of the stiffness, scaled to a unit diagonal, below which a motion counts as unsupported.
SOFT = 1e-13
#: Words for the motions of a node in messages.
_WAYS = ("across (x)", "across (y)", "axially", "tilting about x", "tilting about y")


@dataclass(frozen=True, kw_only=True, eq=False)
class StaticState:
    """Static equilibrium of shafts in their bearings under a load. The spin of every shaft is held.

    Parameters
    ----------
    structure
        A single shaft, or the shafts connected by bodies.
    load
        Forces and moments (size,) on its motions [N, N·mm].
    start
        Motion (size,) from which Newton's method starts; by default 0.
    """

    structure: Structure
    load: NDArray
    start: NDArray | None = None

    @cached_property
    def _free(self) -> NDArray:
        """Indices of the unknown motions: all but the spins.

        A shaft without axial load, axial support and joined bodies has its first node held axially.
        """
        structure = self.structure
        free = np.ones(structure.size, dtype=bool)
        joined = {joint.shaft for body in structure.bodies for joint in body.joints}
        for number, model in structure.shafts.items():
            start, end = structure.motions(number).start, structure.motions(number).stop
            free[start + 5 : end : 6] = False
            axial = abs(self.load[start + 2 : end : 6].sum())
            unloaded = axial <= 1e-9 * np.abs(self.load[start:end]).max(initial=0.0)
            if unloaded and model.shaft.name not in joined and not any(map(_may_hold_axially, model.shaft.bearings)):
                free[start + 2] = False  # hold the first node, which carries no load
        return np.flatnonzero(free)

    @cached_property
    def motion(self) -> NDArray:
        """Motion (size,) [mm, rad] in equilibrium: the minimum of a convex energy, by Newton's method.

        Raises
        ------
        InputError
            If the bearings do not hold a shaft.
        GearbenchError
            If Newton's method finds no equilibrium.
        """
        u = np.zeros(self.structure.size) if self.start is None else self.start
        scale = float(np.abs(self.load).max(initial=0.0))
        residual, K = self._residual(u)
        for _ in range(STEPS):
            if np.abs(residual).max(initial=0.0) <= CONVERGED * scale:
                return u
            # bearings have no stiffness until they carry load: a spring on every motion limits the steps until then
            soft = not _stiffer_than(_with_unit_diagonal(K), SOFT)
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
        names = ", ".join(model.shaft.name for model in self.structure.shafts.values())
        raise GearbenchError(f"the bearings of shaft {names} have no equilibrium")

    def _residual(self, u: NDArray) -> tuple[NDArray, NDArray]:
        """Residual force and tangent stiffness of the free motions, at the motion u (size,)."""
        F, K = self._bearings(u)
        free, own = self._free, self.structure.stiffness
        return (self.load - own @ u - F)[free], (own + K)[np.ix_(free, free)]

    def _bearings(self, u: NDArray) -> tuple[NDArray, NDArray]:
        """Forces (size,) of the shafts on all bearings, and their tangent stiffness (size, size), at the motion u."""
        F, K = np.zeros(self.structure.size), np.zeros((self.structure.size,) * 2)
        for support in self.structure.supports:
            force, stiffness = support.bearing.force(support.deflection(u))
            np.add.at(F, support.index, support.rows.T @ force)
            support.add(K, stiffness)
        return F, K

    def bearings(self, shaft: int) -> list[tuple[NDArray, NDArray]]:
        """Force (5,) of a shaft on each of its bearings [N, N·mm], and their tangent stiffness (5, 5)."""
        supports = [support for support in self.structure.supports if support.shaft == shaft]
        return [support.bearing.force(support.deflection(self.motion)) for support in supports]

    def at(self, shaft: int, position: float) -> NDArray:
        """Motion (5,) of the node of a shaft at ``position`` [mm]: x, y, axial [mm], tilt about x and y [rad]."""
        first = self.structure.starts[shaft] + 6 * self.structure.shafts[shaft].node(position)
        return self.motion[first : first + 5]

    @cached_property
    def compliance(self) -> NDArray:
        """Compliance (size, size) about the equilibrium (W3); zero for the spin.

        Raises
        ------
        InputError
            If the bearings do not hold a shaft.
        """
        bearings = self._bearings(self.motion)[1]
        K = self.structure.stiffness + bearings
        self._check_support(bearings)
        free = self._free
        C = np.zeros_like(K)
        inverse = np.linalg.inv(K[np.ix_(free, free)])
        C[np.ix_(free, free)] = (inverse + inverse.T) / 2
        return C

    def _check_support(self, bearings: NDArray) -> None:
        """Refuse a shaft, or shafts connected by bodies, with an unsupported motion."""
        if self.structure.bodies:
            self._check_bodies(bearings)
            return
        (model,) = self.structure.shafts.values()
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
        way = _WAYS[int(np.argmax(np.abs(moves)))]
        carried = {b.rolling.carries for b in model.shaft.bearings if b.rolling is not None and b.rolling.angled}
        others = [b for b in model.shaft.bearings if b.rolling is None or not b.rolling.angled]
        if len(carried) == 1 and not any(map(_may_hold_axially, others)):
            allowed = "one must carry the other direction: the radial load presses inner and outer rings apart"
            key = f"system.shafts.{model.shaft.name}.bearings.rolling.carries"
            raise InputError(key, f"{carried.pop()} on all", allowed)
        raise InputError(f"system.shafts.{model.shaft.name}.bearings", f"free to move {way}", "must hold the shaft")

    def _check_bodies(self, bearings: NDArray) -> None:
        """Refuse shafts connected by bodies with an unsupported motion; the error names the part that moves most."""
        structure, free = self.structure, self._free
        K = _with_unit_diagonal((structure.stiffness + bearings)[np.ix_(free, free)])
        values, vectors = np.linalg.eigh(K)
        if values[0] > SOFT:
            return
        moves = np.zeros(structure.size)
        moves[free] = vectors[:, 0]
        for name, own in structure.own_coordinates.items():
            if np.abs(moves[own]).max(initial=0.0) >= 0.99 * np.abs(moves).max():
                raise InputError(f"system.bodies.{name}", "free to move", "add a bearing or joint that holds it")
        largest = int(np.argmax(np.abs(moves)))
        number = next(n for n in structure.shafts if structure.motions(n).start <= largest < structure.motions(n).stop)
        name, way = structure.shafts[number].shaft.name, _WAYS[(largest - structure.starts[number]) % 6]
        raise InputError(f"system.shafts.{name}.bearings", f"free to move {way}", "must hold the shaft")


def _may_hold_axially(bearing: Bearing) -> bool:
    """Whether a bearing has axial stiffness once it is loaded, here by a motion of 0.01 mm in every direction."""
    trial = np.array([0.01, 0.01, 0.01, 0.0, 0.0])
    return bool(bearing.force(trial)[1][2, 2] > 0)


def _with_unit_diagonal(A: NDArray) -> NDArray:
    """Scale the coordinates of a symmetric matrix so that its diagonal is 1."""
    d = 1 / np.sqrt(np.maximum(np.abs(np.diag(A)), 1e-300))
    return A * d[:, None] * d


def _stiffer_than(K: NDArray, least: float) -> bool:
    """Whether all eigenvalues of a symmetric matrix exceed ``least``; a Cholesky factorisation decides."""
    try:
        np.linalg.cholesky(K - least * np.eye(len(K)))
    except np.linalg.LinAlgError:
        return False
    return True


def external_load(model: ShaftModel) -> NDArray:
    """Constant loads on a shaft other than mesh forces, (size,) [N, N·mm]."""
    load = np.zeros(model.size)
    for item in model.shaft.loads:
        first = 6 * model.node(item.position)
        load[first : first + 3] += item.force
        load[first + 3 : first + 6] += np.array(item.moment) * METRE
    return load


def twist(model: ShaftModel, nodes: NDArray, reference: float) -> NDArray:
    """Torsional compliance (n, n) [rad/(N·mm)] of neighbouring ``nodes``, with one of them held (W4).

    The held node is the one closest to ``reference`` [mm], the position from which the torque comes. It is therefore an
    end of the face, unless the torque comes from within the face.
    """
    steps = [0.0, *(beam.twist() for beam in model.beams)]
    angle = np.cumsum(steps)[nodes]
    t = angle - angle[np.argmin(np.abs(model.nodes[nodes] - reference))]
    same = t[:, None] * t > 0
    return np.where(same, np.minimum(np.abs(t)[:, None], np.abs(t)), 0.0)
