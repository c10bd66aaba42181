"""Elasticity: weak form, patch test, closed forms, order of convergence of every element."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from numpy.testing import assert_allclose
from skfem.helpers import ddot, eye, sym_grad, trace
from skfem.quadrature import get_quadrature

from fem_reference.elasticity import ELEMENTS, Lame, Space, free_dofs
from fem_reference.solver import SingularSystemError, available_solver, solve
from tests.support.skfem_meshes import CURVED, STRAIGHT
from tests.support.surface_points import surface_points

STEEL = Lame.of(210e3, 0.3)
KINDS = list(ELEMENTS)


def box(kind: str, cells: tuple[int, ...], size: tuple[float, ...] | None = None):
    """Box mesh with straight cells; its faces are named x0, x1, …"""
    dim = 3 if kind.startswith(("hex", "tet")) else 2
    size = size or (1.0,) * dim
    mesh = STRAIGHT[kind].init_tensor(*(np.linspace(0, s, n + 1) for s, n in zip(size, cells[:dim], strict=True)))
    faces = {
        f"x{i}{e}": (lambda x, i=i, v=v: np.isclose(x[i], v)) for i in range(dim) for e, v in enumerate((0, size[i]))
    }
    return mesh.with_boundaries(faces)


def curve(mesh, kind: str, mapping):
    """The same mesh with (quadratic, where the element allows it) geometry moved by a mapping of the coordinates."""
    curved = CURVED[kind].from_mesh(mesh)
    return replace(curved, doflocs=mapping(curved.doflocs)).with_boundaries(mesh.boundaries)


def error_of_gradient(space: Space, u: np.ndarray, gradient) -> float:
    """Error of the gradient of the displacement (L²), by quadrature finer than the assembly's."""
    X, w = get_quadrature(space.element.refdom, ELEMENTS[space.kind].quadrature + 2)
    grad, det = space.gradients(X)
    shapes, _ = space.geometry_shapes(X)
    x = np.einsum("eai,aq->ieq", space.geometry, shapes)
    nodal = u.reshape(-1, space.dim)[space.nodes_of]
    slope = np.einsum("aei,eqaj->ijeq", nodal, grad) - gradient(x)
    return float(np.sqrt(np.sum(slope**2 * det * w)))


def weak_form(material: Lame):
    """∫ σ(u) : ε(v) dx, as written in the book."""
    lam, mu = material.lam, material.mu

    @skfem.BilinearForm
    def energy(u, v, _):
        epsilon = sym_grad(u)
        sigma = lam * eye(trace(epsilon), epsilon.shape[0]) + 2 * mu * epsilon
        return ddot(sigma, sym_grad(v))

    return energy


@pytest.mark.parametrize("kind", KINDS)
def test_stiffness_is_the_weak_form_of_the_book(kind):
    mesh = curve(box(kind, (2, 2, 2)), kind, lambda x: x + 0.05 * np.sin(3 * x[::-1]))
    space = Space(mesh, kind)
    basis = skfem.Basis(mesh, skfem.ElementVector(space.element), intorder=ELEMENTS[kind].quadrature)
    book = weak_form(STEEL).assemble(basis).tocsr()
    # scikit-fem numbers the components of a vector element entity by entity
    number = basis.dofs.element_dofs.reshape(-1, space.dim, mesh.nelements)
    order = np.empty(space.dim * space.n_nodes, dtype=int)
    for i in range(space.dim):
        order[space.dim * space.nodes_of + i] = number[:, i]
    difference = sp.triu(book[order][:, order]) - space.stiffness(STEEL)
    # two orders of summation of the same terms: rounding
    assert abs(difference).max() < 1e-13 * abs(book).max()


@pytest.mark.parametrize("kind", KINDS)
def test_observed_order_of_convergence(kind):
    """Lamé's thick cylinder on curved meshes: error of the gradient O(h²)."""
    errors, sizes = [], (3, 6) if kind == "hex20" else (6, 12)
    for n in sizes:
        space, u = solve_cylinder(kind, n)
        errors.append(error_of_gradient(space, u, lame_gradient))
    order = np.log(errors[0] / errors[1]) / np.log(sizes[1] / sizes[0])
    assert abs(order - 2) < 0.2


def quarter(x: np.ndarray) -> np.ndarray:
    """Unit square or cube to a quarter ring 1 ≤ r ≤ 2 (thickness 0.5)."""
    r, phi = 1 + x[0], 0.5 * np.pi * x[1]
    return np.array([r * np.cos(phi), r * np.sin(phi), *(0.5 * z for z in x[2:])])


# plane strain, inner pressure p₀ = 1, outer radius free: u_r = A r + B / r
_A = 1 / (2 * (STEEL.lam + STEEL.mu) * (2**2 - 1))
_B = 2**2 / (2 * STEEL.mu * (2**2 - 1))


def lame_gradient(x: np.ndarray) -> np.ndarray:
    r2 = x[0] ** 2 + x[1] ** 2
    out = np.zeros((len(x), *x.shape))
    for i in range(2):
        for j in range(2):
            out[i, j] = (i == j) * (_A + _B / r2) - 2 * _B * x[i] * x[j] / r2**2
    return out


def solve_cylinder(kind: str, n: int) -> tuple[Space, np.ndarray]:
    """Quarter of Lamé's cylinder, symmetry planes held in their normal direction, pressure on the inner face."""
    space = Space(curve(box(kind, (n, n, max(1, n // 3))), kind, quarter), kind)
    fixed = np.zeros((space.n_nodes, space.dim), dtype=bool)
    fixed[space.boundary_nodes("x10"), 1] = True
    fixed[space.boundary_nodes("x11"), 0] = True
    for name in ("x20", "x21"):
        if space.dim == 3:
            fixed[space.boundary_nodes(name), 2] = True
    inner = surface_points(space, space.mesh.boundaries["x00"])
    normal = inner.position * (np.arange(space.dim) < 2)
    force = inner.load((normal / np.linalg.norm(normal, axis=1, keepdims=True))[:, :, None], space)
    upper = space.stiffness(STEEL)
    keep = np.flatnonzero(~fixed.ravel())
    u = np.zeros(fixed.size)
    u[keep] = solve(sp.csr_matrix(upper[keep][:, keep]), force[keep]).x[:, 0]
    return space, u


def test_cantilever_agrees_with_timoshenko():
    """Slender beam, end shear: δ = F L³/3EI + F L/(κ G A)."""
    E, nu, L, h = 210e3, 0.0, 12.0, 1.0
    space = Space(box("hex20", (24, 2, 2), (L, h, h)), "hex20")
    free = np.ones(space.n_nodes, dtype=bool)
    free[space.boundary_nodes("x00")] = False
    end = surface_points(space, space.mesh.boundaries["x01"])
    force = end.load(np.broadcast_to(np.array([0.0, 1.0, 0.0])[None, :, None], (len(end.weight), 3, 1)), space)
    dofs = free_dofs(free, 3)
    u = np.zeros((3 * space.n_nodes, 1))
    u[dofs] = solve(space.stiffness(Lame.of(E, nu), free), force[dofs]).x
    tip = float(
        np.average(end.displacement(u, np.tile([0.0, 1.0, 0.0], (len(end.weight), 1)))[:, 0], weights=end.weight)
    )
    expected = L**3 / (3 * E * h**4 / 12) + L / (5 / 6 * E / (2 * (1 + nu)) * h**2)
    # ν = 0: nothing is held back at the clamped end. Beam theory is good to a fraction of (h/L)² = 0.7 %, the mesh
    # (two quadratic cells over the height) to about as much
    assert_allclose(tip, expected, rtol=0.002)


def test_solvers_agree():
    space = Space(box("hex20", (3, 3, 3)), "hex20")
    free = np.ones(space.n_nodes, dtype=bool)
    free[space.boundary_nodes("x00")] = False
    upper = space.stiffness(STEEL, free)
    rhs = np.random.default_rng(0).standard_normal((upper.shape[0], 3))
    by_superlu = solve(upper, rhs, "splu")
    # backward stable factorisations: 1e-16 × condition number (1e4)
    assert_allclose(solve(upper, rhs).x, by_superlu.x, rtol=0, atol=1e-11 * np.abs(by_superlu.x).max())
    assert by_superlu.solver == "splu"
    assert solve(upper, rhs).solver == available_solver()


def test_a_body_that_is_not_held_is_refused():
    space = Space(box("hex20", (2, 2, 2)), "hex20")
    upper = space.stiffness(STEEL)
    upper.data[0] = -upper.data[0]  # the stiffness of a free body is singular to rounding only; make it plain
    for solver in {"splu", available_solver()}:
        with pytest.raises(SingularSystemError):
            solve(upper, np.ones((upper.shape[0], 1)), solver)
