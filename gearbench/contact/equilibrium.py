"""Contact of all meshes of a train together, coupled by rigid motions and elastic bodies (M2 and M4 of docs/theory.md).

The contact of mesh m under a force F_m gives its approach δ_m and stiffness k_m, as for a single pair. Unknown forces
and rigid motions q follow from the balance K q + Bᵀ F = f, and from δ_m(F_m) = B_m q + g_m in every loaded mesh. K is
the stiffness of the supports, f the external load. B has a row B_m for each mesh: B_m q is the approach due to the
motions, g_m that due to the geometry.
Newton's method replaces each mesh by its tangent at the current force, F_m ← max(0, F_m + k_m (B_m q + g_m − δ_m)); the
q in balance with these tangents gives the next forces. How parallel paths share the torque follows from the solution.

An elastic body that is loaded by one mesh opens a gap in its other meshes. The shape of this gap along contact lines
follows from the current loads. Its mean is C F, with the compliance C between meshes, and is part of the balance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import with_field
from gearbench.contact.batch import on_threads
from gearbench.contact.bodies import Bodies
from gearbench.contact.loads import in_full_load_units
from gearbench.contact.patches import (
    BEFORE_LAST,
    ROUNDS,
    Round,
    first_round,
    forces_on_cells,
    last_round,
    next_round,
    solve_patches,
)
from gearbench.contact.problem import ContactProblem, ContactSolution, under_shares
from gearbench.contact.solver import ConvergenceError, Guess, law_forces, solve
from gearbench.threads import default_threads

#: Newton's method ends if no force changes by more than this share of the greatest force; maximum number of steps.
FORCE_TOLERANCE, STEPS = 1e-11, 60
#: Number of rounds on contact patches. If the forces have not settled then, each further step repeats all rounds of
#: ``solve_patches``, because ends of patches may alternate between two places.
MOST_ROUNDS = 5
#: Force, divided by the nominal force, below which the tangent replaces the contact of a mesh.
LEAST = 1e-9
#: Tolerance of the balance with tangents, divided by ``ForceSearch.tolerance``.
TANGENT_TOLERANCE = 1e-6
#: A force oscillates if it changes back by more than this share of its previous change.
SWING = 0.25
#: Factor by which a force grows at most in a step, because tangents of flanks under small loads are too compliant.
GROWTH = 8.0
#: Stiffness of separated meshes, divided by that under load; it keeps the matrices of Newton's method regular.
SEPARATED_STIFFNESS = 1e-6
#: In ``Statics.balanced``: smallest residual that is asked for, divided by the load (rounding); maximum numbers of
#: steps and of halvings of a step.
MIN_RESIDUAL, MAX_INNER_STEPS, MAX_HALVINGS = 1e-13, 30, 30
#: Maximum residual that is accepted after the last step, since flanks that just touch may leave this much by rounding.
ACCEPTED_RESIDUAL = 1e-9
#: Relative change of forces that is accepted after the last step, since the approach of a mesh may jump by 1e-5 of
#: itself where the points on its patches are distributed in another way.
ACCEPTED_CHANGE = 1e-5
#: ``FORCE_TOLERANCE`` for elastic bodies, whose gaps lag one iteration behind the load distribution.
BODY_TOLERANCE = 1e-9
#: Minimum share of the compliance of a mesh that remains without the part that is shifted to the balance.
MIN_REMAINING = 0.05


@dataclass(frozen=True, kw_only=True)
class MeshAt:
    """The contact problem of one mesh of a train, at the mesh phases of this mesh at each position of the train.

    Parameters
    ----------
    problem
        Contact problem of the pair (position, …) under the force ``nominal``.
    nominal
        Nominal force F_bt [N].
    cos_b
        cos β_b: F_bn = F_bt / cos β_b, δ = δ_n / cos β_b.
    """

    problem: ContactProblem
    nominal: float
    cos_b: float

    def under(
        self, force: NDArray, guess: Guess, field: NDArray | None = None
    ) -> tuple[NDArray, NDArray, ContactSolution]:
        """Approach δ [mm], ∂F_bt/∂δ [N/mm] and solution under forces F_bt (position,) [N].

        ``field`` is an additional gap, see ``with_field``.
        """
        share = force / self.nominal
        problem = self.problem if field is None else with_field(self.problem, field)
        solution = in_full_load_units(solve_patches(under_shares(problem, share), guess), share)
        return solution.approach / self.cos_b, solution.stiffness * self.cos_b**2, solution

    def next_round(
        self, force: NDArray, guess: Guess, field: NDArray | None, before: MeshRound | None, number: int
    ) -> MeshRound:
        """Round ``number`` of ``solve_patches`` under forces F_bt (position,) [N]; problems without cells are solved.

        ``field`` is as for ``under``. Forces and fields may differ from those of the round ``before``. Rounds from
        ``ROUNDS`` on are last rounds; after ``MOST_ROUNDS`` each call makes all rounds.
        """
        share, solution = force / self.nominal, None
        problem = under_shares(self.problem if field is None else with_field(self.problem, field), share)
        if problem.cells is None:
            solution = solve(problem, guess)
            found = Round(solution.approach, solution.stiffness, None)
        elif before is None:
            found = first_round(problem, guess)
        elif number < ROUNDS:
            found = next_round(problem, guess, before.found.patches, BEFORE_LAST[number - 1])
        elif number <= MOST_ROUNDS:
            solution, found = last_round(problem, guess, before.found)
        else:
            solution, found = solve_patches(problem, guess), before.found
            found = found._replace(approach=solution.approach, stiffness=solution.stiffness)
        if solution is None:
            points = None if found.patches is None else found.patches.problem
            exact = None if points is None else law_forces(points, guess.delta, guess.q).reshape(points.shape)
            loads = forces_on_cells(problem, guess, exact)
        else:
            solution = in_full_load_units(solution, share)
            loads = solution.force
        return MeshRound(found, share * found.approach / self.cos_b, found.stiffness * self.cos_b**2, loads, solution)


class MeshRound(NamedTuple):
    """A round of the contact of a mesh: approach δ [mm], ∂F_bt/∂δ [N/mm] and how the loads are distributed.

    ``loads`` (position, pair, segment) are the forces up to a factor. ``solution`` is checked; it is None if the round
    is not a last one and the problem has cells. ``found`` has the patches for the next round.
    """

    found: Round
    approach: NDArray
    stiffness: NDArray
    loads: NDArray
    solution: ContactSolution | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Balance:
    """Forces and motions of a train at each position.

    Parameters
    ----------
    force
        F_bt of each mesh, (position, mesh) [N]; 0 if its flanks are separated.
    motion
        q (position, motion) [mm; rad].
    stiffness
        ∂F_bt/∂δ of each mesh, (position, mesh) [N/mm].
    solutions
        Contact of each mesh under its force; forces are 0 in separated meshes.
    steps
        Number of Newton steps.
    statics
        Coupling of the meshes, bodies included.
    fields
        Gaps that bodies open in each mesh, (position, pair, node) [mm]; None for meshes without such gaps.
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
        g (mesh,) or (position, mesh) [mm]; a mesh with negative g touches later.
    between
        C (position, mesh, mesh) [mm/N]: compliance of bodies between different meshes, with a zero diagonal.
    shifted
        Diagonal D (position, mesh) [mm/N]: compliance that is shifted from the meshes to the balance, so that C + D has
        no negative eigenvalue and the balance is the minimum of a convex function.
    """

    rows: NDArray
    stiffness: NDArray
    force: NDArray
    offset: NDArray
    between: NDArray | None = None
    shifted: NDArray | float = 0.0

    @cached_property
    def with_bodies(self) -> tuple[NDArray, NDArray, NDArray]:
        """B, K and f if the unknowns are the rigid motions q and, after them, amplitudes η of the elastic bodies.

        Each η is held by a spring of stiffness 1. The approach due to η is E η, with E Eᵀ = C + D.
        """
        if self.between is None:
            return self.rows, self.stiffness, self.force
        n, motions = len(self.rows), len(self.force)
        value, vector = np.linalg.eigh(self.between + np.expand_dims(self.shifted, -1) * np.eye(n))
        elastic = vector * np.sqrt(np.maximum(value, 0.0))[:, None]
        rows = np.broadcast_to(self.rows, (len(elastic), *self.rows.shape))
        stiffness = np.eye(motions + n)
        stiffness[:motions, :motions] = self.stiffness
        return np.concatenate([rows, elastic], axis=-1), stiffness, np.append(self.force, np.zeros(n))

    def without_shifted(self, k: NDArray) -> NDArray:
        """Stiffness (…, mesh) of meshes without the compliance ``shifted`` to the balance."""
        return k / np.maximum(1 - self.shifted * k, MIN_REMAINING)

    def tangent(self, k: NDArray) -> NDArray:
        """W = (1/k + C)⁻¹ (…, mesh, mesh): tangent of all meshes together, each of the stiffness k ≥ 0.

        It is computed as √k (1 + √k C √k)⁻¹ √k, so k (…, mesh) may be 0.
        """
        root, one = np.sqrt(k)[..., None], np.eye(k.shape[-1])
        C = 0.0 if self.between is None else self.between
        return root * np.linalg.inv(one + root * C * np.swapaxes(root, -1, -2)) * np.swapaxes(root, -1, -2)

    def matrix(self, k: NDArray) -> NDArray:
        """K + Bᵀ W B (…, motion, motion) for meshes of the stiffness k (…, mesh), see ``tangent``."""
        return self.stiffness + self.rows.T @ self.tangent(k) @ self.rows

    def balanced(
        self, response: Callable[[NDArray], tuple[NDArray, NDArray]], q: NDArray, force: NDArray, tolerance: float
    ) -> tuple[NDArray, NDArray]:
        """Motions q (…, motion) and forces F (…, mesh) in balance.

        ``response`` gives F and ∂F/∂δ > 0 under approaches δ (…, mesh). The balance is the minimum of a convex
        function. Newton's method starts from the motions ``q`` and the deflections of the bodies under ``force``. It
        halves steps that go too far, and ends at the residual ``tolerance``, a share of the load.

        Raises
        ------
        ConvergenceError
            If the residual stays above both ``ACCEPTED_RESIDUAL`` and ``tolerance``.
        """
        B, K, f = self.with_bodies
        motions = q.shape[-1]
        if len(f) > motions:
            q = np.concatenate([q, -_generalised_force(force, B[..., motions:])], axis=-1)
        lever = np.abs(B).reshape(-1, len(f)).max(axis=0)  # lever arms turn torques into forces
        lever[lever == 0] = 1.0
        load = np.abs(f / lever).max()

        def state(q: NDArray) -> tuple[NDArray, NDArray, NDArray]:
            F, k = response(_times(B, q) + self.offset)
            return F, k, f - q @ K - _generalised_force(F, B)

        F, k, residual = state(q)
        size = np.abs(residual / lever).max(axis=-1) / load
        best = q, F, size
        for _ in range(MAX_INNER_STEPS):
            unsolved = best[2] > max(tolerance, MIN_RESIDUAL)
            if not unsolved.any():
                break
            step = np.zeros_like(residual)
            rows = B if B.ndim == 2 else np.broadcast_to(B, (*unsolved.shape, *B.shape[-2:]))[unsolved]
            matrix = K + (np.swapaxes(rows, -1, -2) * k[unsolved][:, None]) @ rows
            step[unsolved] = np.linalg.solve(matrix, residual[unsolved][..., None])[..., 0]
            slope, t, new = np.einsum("...i,...i->...", residual, step), np.ones(q.shape[:-1]), q
            for _ in range(MAX_HALVINGS):
                new = q + t[..., None] * step
                F, k, residual = state(new)
                # beyond the minimum the function rises more than half as steeply as it fell at the start of the step
                too_far = np.einsum("...i,...i->...", residual, step) < -0.5 * slope
                if not too_far.any():
                    break
                t = np.where(too_far, t / 2, t)
            q, size = new, np.abs(residual / lever).max(axis=-1) / load
            better = size < best[2]  # rounding may make later steps worse
            best = tuple(
                np.where(better.reshape(better.shape + (1,) * (new.ndim - better.ndim)), new, old)
                for new, old in zip((q, F, size), best, strict=True)
            )
        if best[2].max() > max(tolerance, ACCEPTED_RESIDUAL):
            raise ConvergenceError(f"no equilibrium of the meshes: residual {best[2].max():.1e} of the load")
        return best[0][..., :motions], best[1]


def _times(B: NDArray, q: NDArray) -> NDArray:
    """B q (…, mesh), with B (mesh, motion) or (position, mesh, motion)."""
    return q @ B.T if B.ndim == 2 else (B @ q[..., None])[..., 0]


def _generalised_force(F: NDArray, B: NDArray) -> NDArray:
    """Bᵀ F (…, motion), with B (mesh, motion) or (position, mesh, motion)."""
    return F @ B if B.ndim == 2 else (F[..., None, :] @ B)[..., 0, :]


def _tangents(approach: NDArray, *, k: NDArray, free: NDArray) -> tuple[NDArray, NDArray]:
    """Forces and stiffness of springs that only push, F = max(0, k (δ − free)), and touch from δ = ``free`` on."""
    s = approach - free
    return np.maximum(0.0, k * s), np.where(s > 0, k, SEPARATED_STIFFNESS * k)


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceSearch:
    """Search for the forces of the meshes.

    Parameters
    ----------
    meshes_under
        Function that gives approach [mm] and stiffness [N/mm] (…, mesh) under positive forces (…, mesh) [N].
    nominal
        F_bt of each mesh, (mesh,) [N].
    least
        Force, divided by the nominal force, below which the tangent replaces the contact of a mesh.
    tolerance
        The search ends if forces change by less than this share of the greatest force.
    gap_change
        Function that gives the remaining change of the gaps between meshes, which must also fall below ``tolerance``.
    """

    meshes_under: Callable[[NDArray], tuple[NDArray, NDArray]]
    nominal: NDArray
    least: float = LEAST
    tolerance: float = FORCE_TOLERANCE
    gap_change: Callable[[], float] = float  # without bodies nothing changes: float() is 0

    def solve(self, statics: Statics, force: NDArray) -> tuple[NDArray, NDArray, NDArray, int]:
        """F (position, mesh), q (position, motion), ∂F/∂δ (position, mesh) and number of steps; ``force`` is the start.

        Raises
        ------
        ConvergenceError
            If the forces do not converge.
        """
        least = self.least * self.nominal
        previous, relative_change = np.zeros(1), 0.0
        for step in range(STEPS):
            F = np.maximum(force, least)
            approach, k = self.meshes_under(F)
            # start the balance with tangents from the motions that it would have if all meshes stayed loaded
            total = approach + (0.0 if statics.between is None else (statics.between @ F[..., None])[..., 0])
            B, W = statics.rows, statics.tangent(k)
            right = statics.force - (F + _times(W, statics.offset - total)) @ B
            q = np.linalg.solve(statics.stiffness + B.T @ W @ B, right[..., None])[..., 0]
            loaded = F + _times(W, q @ B.T + statics.offset - total)
            approach, stiffness = approach - statics.shifted * F, statics.without_shifted(k)
            tangents = partial(_tangents, k=stiffness, free=approach - F / stiffness)
            q, new = statics.balanced(tangents, q, loaded, TANGENT_TOLERANCE * self.tolerance)
            # a force below ``least`` changes only if it rises above it
            change = np.where(force > least, new - force, np.maximum(new - F, 0.0))
            relative_change = np.abs(change).max() / np.abs(new).max()
            allowed = self.tolerance if step < STEPS - 1 else ACCEPTED_CHANGE
            settled = relative_change <= allowed
            if settled:
                relative_change = max(relative_change, self.gap_change())
            if relative_change <= allowed:
                return new, q, k * (new > 0), step + 1
            if settled:
                continue  # with the same forces, while the gaps still change
            # forces of flanks that just touch may oscillate; they take half of the step
            swings = (change * previous < 0) & (np.abs(change) > SWING * np.abs(previous))
            damped = np.where(swings, (force + new) / 2, new)
            # close to separation the tangent replaces the contact, so the growth is not limited
            force, previous = np.where(damped > least, np.minimum(damped, GROWTH * F), damped), change
        raise ConvergenceError(
            f"forces of the meshes did not converge in {STEPS} steps: relative change {relative_change:.1e}"
        )


def balance(
    meshes: Sequence[MeshAt], statics: Statics, bodies: Bodies | None = None, alike: Sequence[int] | None = None
) -> Balance:
    """Balance of a train: forces and contact of all meshes, with elastic ``bodies`` that several meshes load.

    ``alike`` gives for each mesh the number of the first mesh in the same state; by default all states differ.

    Raises
    ------
    ConvergenceError
        If the forces do not converge, or the contact of a mesh is not solved.
    """
    nominal = np.array([mesh.nominal for mesh in meshes])
    cos_b = np.array([mesh.cos_b for mesh in meshes])
    guesses = [Guess.empty(mesh.problem) for mesh in meshes]
    rounds: list[MeshRound] = []
    fields: list[NDArray | None] = [None] * len(meshes)
    next_fields: list[NDArray | None] = []
    between = np.zeros((1, len(meshes), len(meshes)))
    alike = range(len(meshes)) if alike is None else alike
    different = sorted(set(alike))
    number, last_rounds_from = -1, ROUNDS if any(mesh.problem.cells is not None for mesh in meshes) else 0

    def loads(force: NDArray) -> list[NDArray]:
        """Forces of each mesh (position, pair, segment) [N], distributed as in the last solution."""
        shares = (one.loads / one.loads.sum(axis=(1, 2), keepdims=True) for one in rounds)
        return [share * total[:, None, None] for share, total in zip(shares, (force / cos_b).T, strict=True)]

    def meshes_under(force: NDArray) -> tuple[NDArray, NDArray]:
        """``ForceSearch.meshes_under``: solve the next round of all meshes under ``force`` (position, mesh)."""
        nonlocal number
        number += 1
        if bodies is not None and rounds:
            fields[:] = next_fields or bodies.fields(loads(force))
            next_fields.clear()

        def next_round(m: int) -> MeshRound:
            before = rounds[m] if rounds else None
            return meshes[m].next_round(force[:, m], guesses[m], fields[m], before, number)

        found = dict(zip(different, on_threads(next_round, different, default_threads()), strict=True))
        rounds[:] = [found[m] for m in alike]
        approach, k = (np.stack([getattr(one, name) for one in rounds], axis=1) for name in ("approach", "stiffness"))
        return approach - (between @ force[..., None])[..., 0], k

    def gap_change() -> float:
        """Greatest change of the gaps if they are computed from the last loads, divided by the greatest approach.

        It is infinite until the first of the last rounds.
        """
        if number < last_rounds_from:
            return math.inf
        if bodies is None:
            return 0.0
        # the search goes on with the same forces, if at all
        next_fields[:] = bodies.fields([one.loads for one in rounds])
        pairs = [(a, b) for a, b in zip(next_fields, fields, strict=True) if a is not None and b is not None]
        most = max(float(np.abs(one.approach).max()) for one in rounds)
        return max((float(np.abs(a - b).max()) for a, b in pairs), default=0.0) / most

    even = np.tile(nominal, (len(meshes[0].problem.gap), 1))
    tolerance = FORCE_TOLERANCE
    if bodies is not None:
        _, k = meshes_under(even)
        between = bodies.compliance(loads(np.ones_like(even) * cos_b)) / np.multiply.outer(cos_b, cos_b)
        # D = ρ/k with −ρ the lowest eigenvalue of √k C √k; ρ < 1, because the compliance 1/k + C is positive definite
        root, tolerance = np.sqrt(k), BODY_TOLERANCE
        lowest = np.linalg.eigvalsh(root[:, :, None] * between * root[:, None])[:, :1]
        statics = replace(statics, between=between, shifted=-lowest / k)
    search = ForceSearch(meshes_under=meshes_under, nominal=nominal, tolerance=tolerance, gap_change=gap_change)
    force, q, k, steps = search.solve(statics, even)
    # the contact of separated meshes was solved under a tiny force, which is removed
    solutions = (one.solution for one in rounds if one.solution is not None)
    loaded = zip(solutions, (force > 0).T[..., None, None], strict=True)
    cleared = tuple(replace(solution, force=solution.force * mask) for solution, mask in loaded)
    parts = {"solutions": cleared, "fields": tuple(fields), "statics": statics, "steps": steps}
    return Balance(force=force, motion=q, stiffness=k, **parts)
