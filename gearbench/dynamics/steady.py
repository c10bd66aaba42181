"""Steady motion of all meshes: orders of each mesh frequency, and combinations of two mesh frequencies.

A group is a set of meshes that are solved together, a row one relative motion of a mesh (``model``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.balance import complex_orders, convolution, generalised_conjugate_residuals, real, solve
from gearbench.dynamics.model import LinearModel

#: A combination is kept if its force reaches this share of the largest order of a mesh force at a sampled speed.
SMALLEST_SHARE = 1e-2
#: Maximum number of combinations, and number of sampled speeds.
MOST_COMBINATIONS, SAMPLED_SPEEDS = 80, 25
#: Residual, relative to the first guess of the motion, at which the meshes are in balance; maximum number of steps.
SETTLED, STEPS = 1e-2, 12


@dataclass(frozen=True, kw_only=True)
class Steady:
    """Steady excitation of the modes at each speed.

    Parameters
    ----------
    multiples
        Orders as multiples of the frequencies of the groups (order, frequency): zero first, then the orders kept of
        each group, then combinations. Negative orders are the conjugates and are not listed.
    omega
        Frequency of each order (speed, order) [rad/s]; a difference of two frequencies may be negative.
    equivalent_force
        Mesh forces minus the forces of the mean stiffnesses, f − K̄ x (speed, row, order) [N]; order zero holds the
        change from the quasi-static state.
    residual
        Residual of the balance of several frequencies, relative to the first guess of the motion (speed,).
    """

    multiples: NDArray
    omega: NDArray
    equivalent_force: NDArray
    residual: NDArray


def steady(model: LinearModel, speeds: NDArray, harmonics: int) -> Steady:
    """Balance all meshes: first each mesh frequency by itself, then all frequencies together.

    The varying stiffness of a mesh also acts on motions that other meshes excite. Order n of one frequency and order m
    of another thus make combinations n ω_1 ± m ω_2. The balance is (D5) of ``docs/theory.md``.
    """
    groups, kept = model.groups, [group.orders(harmonics) for group in model.groups]
    # the orders of group g are at first[g] … first[g + 1] − 1; at 0 is order zero, which all groups share
    first = np.cumsum([1, *(len(orders) - 1 for orders in kept)])
    multiples = np.zeros((first[-1], len(groups)), dtype=int)
    equivalent_force = np.zeros((len(speeds), len(model.stiffness), len(multiples)), dtype=complex)
    # quasi-static motions x_s, and the forces p_s = f_s − K̄ x_s; order zero stays 0
    x_s, p_s = np.zeros((2, *equivalent_force.shape[1:]), dtype=complex)
    for g, group in enumerate(groups):
        rows, group_orders = model.rows_of(group.meshes), slice(first[g], first[g + 1])
        excitation, mean = model.excitation(group, harmonics), model.stiffness_of(group.meshes)
        x, f = solve(excitation, model.receptances(group, speeds, kept[g]), mean)
        p = excitation.force - mean @ excitation.motion
        multiples[group_orders, g] = kept[g][1:]
        x_s[rows, group_orders], p_s[rows, group_orders] = excitation.motion[:, 1:], p[:, 1:]
        equivalent_force[:, rows, group_orders] = (f - mean @ x)[..., 1:]
        equivalent_force[:, rows, 0] = (f - mean @ x - p)[..., 0]
    omega = _frequencies(model, speeds) @ multiples.T
    alone = Steady(multiples=multiples, omega=omega, equivalent_force=equivalent_force, residual=np.zeros(len(speeds)))
    return alone if len(groups) == 1 else _solve_together(model, speeds, alone, x_s, p_s)


def _solve_together(model: LinearModel, speeds: NDArray, alone: Steady, x_s: NDArray, p_s: NDArray) -> Steady:
    """Solve the balance y + ĥ V y = −x_s − ĥ p_s of all orders at once, for y = x − x_s, with V y = (K − K̄) y.

    The first guess ``alone`` balances each frequency by itself, so a few steps are enough.
    """
    all_rows, H = np.arange(len(model.stiffness)), int(alone.multiples.max())
    x = _motion(model.modes.mesh_receptance(alone.omega, all_rows), alone.equivalent_force)
    multiples = np.concatenate([alone.multiples, _combinations(model, alone, x)])
    omega = _frequencies(model, speeds) @ multiples.T
    padding = [(0, 0), (0, len(multiples) - len(alone.multiples))]
    x_s, p_s = np.pad(x_s, padding), np.pad(p_s, padding)
    h, varying = model.modes.mesh_receptance(omega, all_rows), _varying_stiffness(model, multiples, H)
    y = np.pad(x, [(0, 0), *padding]) - x_s
    remainder = _motion(h, p_s + varying(y)) - x_s - y
    product, size = partial(_product, model), _product(model, y, y)
    y, remainder = generalised_conjugate_residuals(
        lambda step: step - _motion(h, varying(step)), y, remainder, product, SETTLED**2 * size, STEPS
    )
    residual = np.sqrt(product(remainder, remainder) / size)
    return Steady(multiples=multiples, omega=omega, equivalent_force=p_s + varying(y), residual=residual.ravel())


def _frequencies(model: LinearModel, speeds: NDArray) -> NDArray:
    """Mesh frequency of each group (speed, frequency) [rad/s]."""
    return np.stack([model.omega(group, speeds) for group in model.groups], axis=-1)


def _motion(h: NDArray, equivalent_force: NDArray) -> NDArray:
    """Motion −ĥ p under the mesh forces p, (D4) of docs/theory.md (speed, row, order)."""
    return -np.einsum("snij,sjn->sin", h, equivalent_force, optimize=True)


def _product(model: LinearModel, a: NDArray, b: NDArray) -> NDArray:
    """Inner product of two motions, weighted with the diagonal of the mean stiffness (speed, 1, 1)."""
    return np.einsum("sin,i,sin->s", a.conj(), np.diag(model.stiffness), b).real[:, None, None]


def _varying_stiffness(model: LinearModel, multiples: NDArray, harmonics: int) -> Callable[[NDArray], NDArray]:
    """Function from y to V y = (K − K̄) y, both (speed, row, order), at the orders ``multiples``."""
    parts, N = [], 2 * len(multiples) - 1
    for g, group in enumerate(model.groups):
        rows = model.rows_of(group.meshes)
        K = convolution(model.excitation(group, harmonics).stiffness, multiples, g)
        K -= model.stiffness_of(group.meshes)[..., None, None] * np.eye(N)
        parts.append((rows, np.moveaxis(K, 2, 1).reshape(len(rows) * N, -1).T))

    def apply(y: NDArray) -> NDArray:
        out = np.empty_like(y)
        for rows, V in parts:
            varied = (real(y[:, rows]).reshape(len(y), -1) @ V).reshape(len(y), len(rows), N)
            out[:, rows] = complex_orders(varied)
        return out

    return apply


def _combinations(model: LinearModel, alone: Steady, x: NDArray) -> NDArray:
    """Combinations of two orders (combination, frequency) with the largest estimated force, largest first.

    The varying stiffness of a mesh excites a combination through the motions x (speed, row, order) that the other
    frequency causes in this mesh. The force is estimated at some of the speeds.
    """
    sampled = np.unique(np.linspace(0, len(x) - 1, SAMPLED_SPEEDS).round().astype(int))
    x, H, G = x[sampled], int(alone.multiples.max()), len(model.groups)
    approach_rows = np.arange(len(model.names)) * model.rows_per_mesh
    mesh_force = alone.equivalent_force[sampled] + np.einsum("ij,sjn->sin", model.stiffness, x)
    largest = np.abs(mesh_force[:, approach_rows]).max(axis=(1, 2))
    # several groups have one mesh frequency each, thus H orders: order n of group g is at H g + n
    first_order_omega, k = alone.omega[sampled][:, 1 : 1 + G * H : H], np.diag(model.stiffness)[approach_rows]
    n, m = (part.ravel() for part in np.meshgrid(np.arange(1, H + 1), np.r_[-H:0, 1 : H + 1], indexing="ij"))
    candidates, shares = [], []
    for a, b in combinations(range(G), 2):
        multiples = np.zeros((len(n), G), dtype=int)
        multiples[:, a], multiples[:, b] = n, m
        equivalent_force = np.zeros((len(sampled), len(approach_rows), len(n)))
        for excited, order, other, other_order in ((a, n, b, np.abs(m)), (b, np.abs(m), a, n)):
            group = model.groups[excited]
            K = np.abs(model.excitation(group, H).stiffness[:: model.rows_per_mesh, :, order])
            equivalent_force[:, group.meshes] = np.einsum("ijc,sjc->sic", K, np.abs(x[:, model.rows_of(group.meshes)])[..., H * other + other_order])  # fmt: skip  # noqa: E501
        # the modes amplify a combination like any order
        h = model.modes.mesh_receptance(first_order_omega @ multiples.T, approach_rows)
        transfer = np.eye(len(approach_rows)) - k[:, None] * h
        force = np.abs(transfer @ np.moveaxis(equivalent_force, 1, 2)[..., None])[..., 0]
        candidates.append(multiples)
        shares.append((force.max(axis=-1) / largest[:, None]).max(axis=0))
    multiples, size = np.concatenate(candidates), np.concatenate(shares)
    return multiples[[c for c in np.argsort(-size)[:MOST_COMBINATIONS] if size[c] > SMALLEST_SHARE]]
