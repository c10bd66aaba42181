"""Contact of all meshes of a train together, coupled by a few rigid motions and by bodies that yield (M2, M4).

Each mesh answers with its approach δ_m and its stiffness k_m under a force F_m, as a pair does; the forces that it may
not know beforehand follow from the balance K q + Bᵀ F = f of the motions q, and from δ_m(F_m) = B_m q + g_m where it is
loaded. Newton's method: under the forces found so far every mesh is its tangent, F_m = max(0, F_m + k_m (B_m q + g_m −
δ_m)), and the q that balances these gives the next forces. Torques of parallel paths are part of the answer. What a
body yields to one mesh is a gap at the others, from the loads found so far; its mean, C F, is part of the balance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import with_field
from gearbench.contact.bodies import Bodies
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
#: The same as ``SETTLED`` where bodies yield: how loads are spread is known that well of the solution before.
SPREAD = 1e-9
#: Least part of the compliance of a mesh that is left where its body lends some.
LENT = 0.05


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

    def answer(
        self, force: NDArray, guess: Guess, field: NDArray | None = None
    ) -> tuple[NDArray, NDArray, ContactSolution]:
        """Approach δ [mm], ∂F_bt/∂δ [N/mm] and solution under forces F_bt (position,) [N].

        ``field``: one more gap, see ``with_field``.
        """
        share = force / self.nominal
        problem = self.problem if field is None else with_field(self.problem, field)
        solution = in_own_units(solve_patches(under(problem, share), guess), share)
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
    statics
        Coupling of the meshes, bodies included.
    fields
        Gaps that bodies open at each mesh, (position, pair, node) [mm]; None where there are none.
    """

    force: NDArray
    motion: NDArray
    stiffness: NDArray
    solutions: tuple[ContactSolution, ...]
    steps: int
    statics: Statics
    fields: tuple[NDArray | None, ...]


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
    elastic
        E (position, mesh, n) with E Eᵀ = C + D, compliance of bodies between meshes, and of each as far as it is lent
        [√(mm/N)]: amplitudes η of motions that springs of stiffness 1 hold.
    lent
        D, diagonal, (position, mesh) [mm/N]: with it the balance is that of a convex function. Approaches leave it out.
    """

    rows: NDArray
    stiffness: NDArray
    force: NDArray
    offset: NDArray
    elastic: NDArray | None = None
    lent: NDArray | float = 0.0

    @cached_property
    def whole(self) -> tuple[NDArray, NDArray, NDArray]:
        """B, K and f of q and η."""
        if self.elastic is None:
            return self.rows, self.stiffness, self.force
        n, motions = self.elastic.shape[-1], len(self.force)
        rows = np.broadcast_to(self.rows, (len(self.elastic), *self.rows.shape))
        stiffness = np.eye(motions + n)
        stiffness[:motions, :motions] = self.stiffness
        return np.concatenate([rows, self.elastic], axis=-1), stiffness, np.append(self.force, np.zeros(n))

    def stiffer(self, k: NDArray) -> NDArray:
        """Stiffness (…, mesh) of meshes without the compliance that is lent."""
        return k / np.maximum(1 - self.lent * k, LENT)

    def matrix(self, k: NDArray) -> NDArray:
        """K + Bᵀ k B of meshes with the stiffness k (position, mesh), (position, motion, motion)."""
        B, K, _ = self.whole
        return K + (np.swapaxes(B, -1, -2) * self.stiffer(k)[:, None]) @ B

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
        B, K, f = self.whole
        motions = q.shape[-1]
        q = np.concatenate([q, np.zeros((*q.shape[:-1], len(f) - motions))], axis=-1)
        lever = np.abs(B).reshape(-1, len(f)).max(axis=0)  # torques are forces on these
        lever[lever == 0] = 1.0
        load = np.abs(f / lever).max()

        def state(q: NDArray) -> tuple[NDArray, NDArray, NDArray]:
            F, k = response(_times(B, q) + self.offset)
            return F, k, f - q @ K - _pulled(F, B)

        F, k, rest = state(q)
        size = np.abs(rest / lever).max(axis=-1) / load
        best = q, F, size
        for _ in range(_INNER):
            left = best[2] > max(enough, _BALANCED)
            if not left.any():
                break
            step = np.zeros_like(rest)
            own = B if B.ndim == 2 else np.broadcast_to(B, (*left.shape, *B.shape[-2:]))[left]
            matrix = K + (np.swapaxes(own, -1, -2) * k[left][:, None]) @ own
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
        return best[0][..., :motions], best[1]


def _times(B: NDArray, q: NDArray) -> NDArray:
    """B q (…, mesh), B the same at all positions or (position, mesh, motion)."""
    return q @ B.T if B.ndim == 2 else (B @ q[..., None])[..., 0]


def _pulled(F: NDArray, B: NDArray) -> NDArray:
    """Bᵀ F (…, motion)."""
    return F @ B if B.ndim == 2 else (F[..., None, :] @ B)[..., 0, :]


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
    moved
        How much the answers depend on what was not known of earlier forces, in the same measure.
    """

    answer: Callable[[NDArray], tuple[NDArray, NDArray]]
    nominal: NDArray
    least: float = LEAST
    settled: float = SETTLED
    moved: Callable[[], float] = float

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
            approach, own = approach - statics.lent * at, statics.stiffer(k)
            if q is None:  # as if all were loaded
                B, _, f = statics.whole
                right = f - _pulled(own * (statics.offset - approach) + at, B)
                q = np.linalg.solve(statics.matrix(k), right[..., None])[..., : len(statics.force), 0]
            q, found = statics.balanced(partial(_tangents, k=own, free=approach - at / own), q)
            change = np.where(force > least, found - force, np.maximum(found - at, 0.0))
            left = max(np.abs(change).max() / np.abs(found).max(), self.moved())
            if left <= (self.settled if step < STEPS - 1 else max(self.settled, ENOUGH)):
                return force, q, k * (force > 0), step + 1
            # forces that swing about where flanks begin to touch go half of the way
            next_ = np.where(change * before < 0, (force + found) / 2, found)
            # the force of a mesh close to separation is on its tangent
            force, before = np.where(next_ > least, np.minimum(next_, GROWTH * at), next_), change
        raise ConvergenceError(f"forces of the meshes not settled after {STEPS} steps: {left:.1e} of the greatest")


def balance(meshes: Sequence[MeshAt], statics: Statics, bodies: Bodies | None = None) -> Balance:
    """Forces of all meshes, contact of each included, and of ``bodies`` that yield to several of them.

    Raises
    ------
    ConvergenceError
        If the forces do not settle, or the contact of a mesh is not solved.
    """
    nominal = np.array([mesh.nominal for mesh in meshes])
    cos_b = np.array([mesh.cos_b for mesh in meshes])
    guesses = [Guess.nothing(mesh.problem) for mesh in meshes]
    solutions: list[ContactSolution] = []
    fields: list[NDArray | None] = [None] * len(meshes)
    between = np.zeros((1, len(meshes), len(meshes)))

    def loads(force: NDArray) -> list[NDArray]:
        """Forces of each mesh, distributed as in the last solution, (position, pair, segment) [N]."""
        unit = (each.force / each.force.sum(axis=(1, 2), keepdims=True) for each in solutions)
        return [own * total[:, None, None] for own, total in zip(unit, (force / cos_b).T, strict=True)]

    def answer(force: NDArray) -> tuple[NDArray, NDArray]:
        if bodies is not None and solutions:
            fields[:] = bodies.fields(loads(force))
        answers: list[tuple[NDArray, NDArray, ContactSolution]] = []
        known: dict[tuple[int, bytes, bytes], int] = {}
        for m, (mesh, F, guess, field) in enumerate(zip(meshes, force.T, guesses, fields, strict=True)):
            # planets in phase under the same force have the same contact
            twin = known.setdefault((id(mesh), F.tobytes(), b"" if field is None else field.tobytes()), m)
            if twin < m:
                guess.q[:], guess.delta[:] = guesses[twin].q, guesses[twin].delta
            answers.append(answers[twin] if twin < m else mesh.answer(F, guess, field))
        solutions[:] = [solution for _, _, solution in answers]
        approach, k = (np.stack(each, axis=1) for each in list(zip(*answers, strict=True))[:2])
        return approach - (between @ force[..., None])[..., 0], k

    def moved() -> float:
        """Change of the gaps under the last loads, relative to the approach."""
        if bodies is None:
            return 0.0
        now = bodies.fields(loads(cos_b * np.stack([each.force.sum(axis=(1, 2)) for each in solutions], axis=1)))
        pairs = [(a, b) for a, b in zip(now, fields, strict=True) if a is not None and b is not None]
        most = max(float(np.abs(each.approach).max()) for each in solutions)
        return max((float(np.abs(a - b).max()) for a, b in pairs), default=0.0) / most

    even = np.tile(nominal, (len(meshes[0].problem.gap), 1))
    settled = SETTLED
    if bodies is not None:
        answer(even)
        whole = bodies.compliance(loads(np.ones_like(even) * cos_b)) / np.multiply.outer(cos_b, cos_b)
        value, vector = np.linalg.eigh(whole)
        elastic = vector * np.sqrt(np.maximum(value, 0.0))[:, None]
        whole = elastic @ np.swapaxes(elastic, 1, 2)
        lent = np.diagonal(whole, axis1=1, axis2=2)
        between, settled = whole - lent[:, None] * np.eye(len(meshes)), SPREAD
        statics = replace(statics, elastic=elastic, lent=lent)
    search = Forces(answer=answer, nominal=nominal, settled=settled, moved=moved)
    force, q, k, steps = search.found(statics, even)
    alone = [np.where(loaded, 1.0, 0.0) for loaded in (force > 0).T]  # parted flanks are loaded a little
    own = (replace(a, force=a.force * one[:, None, None]) for a, one in zip(solutions, alone, strict=True))
    parts = {"solutions": tuple(own), "fields": tuple(fields), "statics": statics, "steps": steps}
    return Balance(force=force, motion=q, stiffness=k, **parts)
