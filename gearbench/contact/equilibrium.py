"""Contact of all meshes of a train together, coupled by a few rigid motions only (M2).

Each mesh answers with its approach δ_m and its stiffness k_m under a force F_m, as a pair does; the forces that it may
not know beforehand follow from the balance K q + Bᵀ F = f of the motions q, and from δ_m(F_m) = B_m q + g_m where it is
loaded. Newton's method: under the forces found so far every mesh is its tangent, F_m = max(0, F_m + k_m (B_m q + g_m −
δ_m)), and the q that balances these gives the next forces. Torques of parallel paths are part of the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.loads import in_own_units
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem, ContactSolution, under
from gearbench.contact.solver import ConvergenceError, Guess

#: Change of a force over the greatest at which Newton's method has ended, and steps until then at most.
SETTLED, STEPS = 1e-11, 60
#: Force over the nominal one below which a mesh is its tangent.
LEAST = 1e-6
#: A force grows by this factor at most in a step: tangents of flanks under small loads are far too compliant.
GROWTH = 8.0
#: Stiffness that parted meshes keep in the matrix of the inner steps, which alone it is for, over that under load.
_PARTED = 1e-9
_INNER = 100


@dataclass(frozen=True, kw_only=True)
class MeshAt:
    """A mesh of a train at its own phases.

    Parameters
    ----------
    problem
        Its contact as a pair, (position, …), under the force ``nominal``.
    nominal
        F_bt [N].
    cos_b
        cos β_b: F_bn = F_bt / cos β_b, δ = δ_n / cos β_b.
    """

    problem: ContactProblem
    nominal: float
    cos_b: float

    def answer(self, force: NDArray, guess: Guess) -> tuple[NDArray, NDArray, ContactSolution]:
        """Approach δ [mm], ∂F_bt/∂δ [N/mm] and solution under forces F_bt (position,) [N]."""
        share = force / self.nominal
        solution = in_own_units(solve_patches(under(self.problem, share), guess), share)
        return solution.approach / self.cos_b, solution.stiffness * self.cos_b**2, solution


@dataclass(frozen=True, kw_only=True, eq=False)
class Balance:
    """Forces and motions of a train at each position.

    Parameters
    ----------
    force
        F_bt of each mesh, (position, mesh) [N]; 0 where its flanks have parted.
    motion
        q (position, motion) [mm; rad].
    stiffness
        ∂F_bt/∂δ of each mesh, (position, mesh) [N/mm].
    solutions
        Contact of each mesh under its force; of parted ones under the least that is solved.
    steps
        Newton steps.
    """

    force: NDArray
    motion: NDArray
    stiffness: NDArray
    solutions: tuple[ContactSolution, ...]
    steps: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Statics:
    """Coupling of the meshes of a train: δ = B q + g, K q + Bᵀ F = f.

    Parameters
    ----------
    rows
        B (mesh, motion).
    stiffness
        K (motion, motion) [N/mm …].
    force
        f (motion,) [N …].
    offset
        g (mesh,) or (position, mesh) [mm]; negative: the mesh touches later.
    """

    rows: NDArray
    stiffness: NDArray
    force: NDArray
    offset: NDArray

    def motions(self, k: NDArray, free: NDArray) -> tuple[NDArray, NDArray]:
        """q (position, motion) and F (position, mesh) of springs F = max(0, k (δ − free)), (position, mesh) each.

        Raises
        ------
        ConvergenceError
            If the set of loaded springs does not converge.
        """
        B, K, f = self.rows, self.stiffness, self.force
        loaded, q = np.ones(k.shape, dtype=bool), np.zeros((len(k), B.shape[1]))
        for _ in range(_INNER):
            own = k * np.where(loaded, 1.0, _PARTED)
            matrix = K + np.einsum("mi,pm,mj->pij", B, own, B)
            s = q @ B.T + self.offset - free
            rest = f - q @ K - (loaded * k * s) @ B
            q = q + np.linalg.solve(matrix, rest[..., None])[..., 0]
            s = q @ B.T + self.offset - free
            now = s > 0
            small = np.abs(k * s) <= 1e-12 * np.abs(k * s).max(axis=1, keepdims=True)
            done = np.all((now == loaded) | small, axis=1)
            if done.all():
                return q, np.maximum(0.0, k * s)
            loaded = np.where(done[:, None], loaded, now)
        raise ConvergenceError("balance of the meshes not found: which of them are loaded")


def balance(meshes: Sequence[MeshAt], statics: Statics) -> Balance:
    """Forces of all meshes, contact of each included.

    Raises
    ------
    ConvergenceError
        If the forces do not settle, or the contact of a mesh is not solved.
    """
    count = len(meshes[0].problem.gap)
    nominal = np.array([mesh.nominal for mesh in meshes])
    guesses = [Guess.nothing(mesh.problem) for mesh in meshes]
    force, change = np.tile(nominal, (count, 1)), np.zeros(1)
    for step in range(STEPS):
        at = np.maximum(force, LEAST * nominal)
        answers = [mesh.answer(at[:, m], guesses[m]) for m, mesh in enumerate(meshes)]
        approach, k = np.stack([x for x, _, _ in answers], axis=1), np.stack([k for _, k, _ in answers], axis=1)
        q, found = statics.motions(k, approach - at / k)
        change = np.abs(np.where(force > LEAST * nominal, found - force, np.maximum(found - at, 0.0)))
        if change.max() <= SETTLED * np.abs(found).max():
            alone = [np.where(loaded, 1.0, 0.0) for loaded in (force > 0).T]  # parted flanks are loaded a little
            own = (replace(a[2], force=a[2].force * one[:, None, None]) for a, one in zip(answers, alone, strict=True))
            return Balance(force=force, motion=q, stiffness=k * (force > 0), solutions=tuple(own), steps=step + 1)
        # the force of a mesh close to separation is on its tangent
        force = np.where(found > LEAST * nominal, np.minimum(found, GROWTH * at), found)
    raise ConvergenceError(f"forces of the meshes not settled after {STEPS} steps: {change.max():.1e} N")
