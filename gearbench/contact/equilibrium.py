"""Contact of all meshes of a train together, coupled by a few rigid motions only (M2).

Each mesh answers with its approach δ_m and its stiffness k_m under a force F_m, as a pair does; the forces that it may
not know beforehand follow from the balance K q + Bᵀ F = f of the motions q, and from δ_m(F_m) = B_m q + g_m where it is
loaded. Newton's method: under the forces found so far every mesh is its tangent, F_m = max(0, F_m + k_m (B_m q + g_m −
δ_m)), and the q that balances these gives the next forces. Torques of parallel paths are part of the answer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.loads import in_own_units
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem, ContactSolution, under
from gearbench.contact.solver import ConvergenceError, Guess

#: Change of a force over the greatest at which Newton's method has ended, and steps until then at most.
SETTLED, STEPS = 1e-11, 60
#: Force over the nominal one below which a mesh is its tangent.
LEAST = 1e-9
#: A force grows by this factor at most in a step: tangents of flanks under small loads are far too compliant.
GROWTH = 8.0
#: Stiffness that parted meshes keep in the matrices of Newton's method, which alone it is for, over that under load.
PARTED = 1e-6
#: What may be out of balance over the load, inner steps until then at most, and how often one is halved.
_BALANCED, _INNER, _HALVED = 1e-13, 30, 30
#: Where rounding of flanks that just touch leaves more than ``SETTLED``: the most that is an answer.
ENOUGH = 1e-9


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

    def balanced(
        self, response: Callable[[NDArray], tuple[NDArray, NDArray]], q: NDArray, enough: float = 0.0
    ) -> tuple[NDArray, NDArray]:
        """q (…, motion) and F (…, mesh) that balance, where ``response`` gives F and ∂F/∂δ > 0 of the approaches δ.

        The gradient of a convex function vanishes: Newton's method from ``q``, halving steps that go too far.

        Raises
        ------
        ConvergenceError
            If more than ``ENOUGH`` of the load, and than ``enough``, is left.
        """
        B, K, f = self.rows, self.stiffness, self.force
        lever = np.abs(B).max(axis=0)  # torques are forces on these
        load = np.abs(f / lever).max()

        def state(q: NDArray) -> tuple[NDArray, NDArray, NDArray]:
            F, k = response(q @ B.T + self.offset)
            return F, k, f - q @ K - F @ B

        F, k, rest = state(q)
        size = np.abs(rest / lever).max(axis=-1) / load
        best = q, F, size
        for _ in range(_INNER):
            left = best[2] > max(enough, _BALANCED)
            if not left.any():
                break
            step = np.zeros_like(rest)
            matrix = K + (B.T * k[left][:, None]) @ B
            step[left] = np.linalg.solve(matrix, rest[left][..., None])[..., 0]
            slope, t, new = np.einsum("...i,...i->...", rest, step), np.ones(q.shape[:-1]), q
            for _ in range(_HALVED):
                new = q + t[..., None] * step
                F, k, rest = state(new)
                far = np.einsum("...i,...i->...", rest, step) < -0.5 * slope
                if not far.any():
                    break
                t = np.where(far, t / 2, t)
            q, size = new, np.abs(rest / lever).max(axis=-1) / load
            better = size < best[2]
            best = tuple(
                np.where(better.reshape(better.shape + (1,) * (now.ndim - better.ndim)), now, old)
                for now, old in zip((q, F, size), best, strict=True)
            )
        if best[2].max() > max(enough, ENOUGH):
            raise ConvergenceError(f"balance of the meshes not found: {best[2].max():.1e} of the load is left")
        return best[0], best[1]


def _tangents(approach: NDArray, *, k: NDArray, free: NDArray) -> tuple[NDArray, NDArray]:
    """Forces and stiffness of springs that do not pull, F = max(0, k (δ − free))."""
    s = approach - free
    return np.maximum(0.0, k * s), np.where(s > 0, k, PARTED * k)


@dataclass(frozen=True, kw_only=True, eq=False)
class Forces:
    """Search for the forces of meshes that ``answer`` with approach and stiffness (…, mesh) [mm, N/mm].

    Parameters
    ----------
    answer
        Of forces (…, mesh) [N], all positive.
    nominal
        F_bt of each mesh, (mesh,) [N].
    least
        Force over the nominal one below which a mesh is its tangent.
    settled
        Change of a force over the greatest at which the search has ended.
    """

    answer: Callable[[NDArray], tuple[NDArray, NDArray]]
    nominal: NDArray
    least: float = LEAST
    settled: float = SETTLED

    def found(
        self, statics: Statics, force: NDArray, q: NDArray | None = None
    ) -> tuple[NDArray, NDArray, NDArray, int]:
        """F, q and ∂F/∂δ in balance, and steps, from ``force`` and, where it is known, ``q``.

        Raises
        ------
        ConvergenceError
            If the forces do not settle.
        """
        least = self.least * self.nominal
        before, left = np.zeros(1), 0.0
        for step in range(STEPS):
            at = np.maximum(force, least)
            approach, k = self.answer(at)
            if q is None:  # as if all were loaded
                matrix = statics.stiffness + (statics.rows.T * k[:, None]) @ statics.rows
                right = statics.force - (k * (statics.offset - approach) + at) @ statics.rows
                q = np.linalg.solve(matrix, right[..., None])[..., 0]
            q, found = statics.balanced(partial(_tangents, k=k, free=approach - at / k), q)
            change = np.where(force > least, found - force, np.maximum(found - at, 0.0))
            left = np.abs(change).max() / np.abs(found).max()
            if left <= (self.settled if step < STEPS - 1 else max(self.settled, ENOUGH)):
                return force, q, k * (force > 0), step + 1
            # forces that swing about where flanks begin to touch go half of the way
            next_ = np.where(change * before < 0, (force + found) / 2, found)
            # the force of a mesh close to separation is on its tangent
            force, before = np.where(next_ > least, np.minimum(next_, GROWTH * at), next_), change
        raise ConvergenceError(f"forces of the meshes not settled after {STEPS} steps: {left:.1e} of the greatest")


def balance(meshes: Sequence[MeshAt], statics: Statics) -> Balance:
    """Forces of all meshes, contact of each included.

    Raises
    ------
    ConvergenceError
        If the forces do not settle, or the contact of a mesh is not solved.
    """
    nominal = np.array([mesh.nominal for mesh in meshes])
    guesses = [Guess.nothing(mesh.problem) for mesh in meshes]
    solutions: list[ContactSolution] = []

    def answer(force: NDArray) -> tuple[NDArray, NDArray]:
        answers = [mesh.answer(force[:, m], guesses[m]) for m, mesh in enumerate(meshes)]
        solutions[:] = [solution for _, _, solution in answers]
        return np.stack([x for x, _, _ in answers], axis=1), np.stack([k for _, k, _ in answers], axis=1)

    even = np.tile(nominal, (len(meshes[0].problem.gap), 1))
    force, q, k, steps = Forces(answer=answer, nominal=nominal).found(statics, even)
    alone = [np.where(loaded, 1.0, 0.0) for loaded in (force > 0).T]  # parted flanks are loaded a little
    own = (replace(a, force=a.force * one[:, None, None]) for a, one in zip(solutions, alone, strict=True))
    return Balance(force=force, motion=q, stiffness=k, solutions=tuple(own), steps=steps)
