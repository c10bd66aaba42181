"""The plate's energy derived symbolically: the oracle of the numerical stiffness.

Kinematics, strains and energy are typed once more, as in the book, and integrated exactly by sympy for thicknesses
that are constant or linear in the height. Only the list of monomials of a basis is shared
with ``gearbench.compliance.plate``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import sympy as sp

x, y, z = sp.symbols("x y z")

Basis = Literal["paper"] | tuple[int, int]


def monomials(basis: Basis) -> list[Any]:
    """Monomials that span a field: the paper's x, xy, x², or x^{i+1} y^j for i < p, j < q."""
    if isinstance(basis, str):
        return [x, x * y, x**2]
    p, q = basis
    return [x ** (i + 1) * y**j for i in range(p) for j in range(q)]


def energy_density(w: Any, theta_x: Any, theta_y: Any, h: Any, E: Any, nu: Any) -> Any:
    """Strain energy per unit area of a Reissner–Mindlin plate with deflection w and rotations θ_x, θ_y.

    Plane stress through the thickness, integrated over z from −h/2 to h/2; shear factor 5/6.
    """
    u_x, u_y = z * theta_y, -z * theta_x
    e_xx, e_yy = sp.diff(u_x, x), sp.diff(u_y, y)
    g_xy = sp.diff(u_x, y) + sp.diff(u_y, x)
    g_xz, g_yz = theta_y + sp.diff(w, x), -theta_x + sp.diff(w, y)
    G = E / (2 * (1 + nu))
    in_plane = E / (1 - nu**2) * (e_xx**2 + e_yy**2 + 2 * nu * e_xx * e_yy) / 2 + G * g_xy**2 / 2
    bending = sp.integrate(sp.expand(in_plane), (z, -h / 2, h / 2))
    return sp.expand(bending + sp.Rational(5, 6) * G * h * (g_xz**2 + g_yz**2) / 2)


def stiffness(basis: Basis, thickness: Any, height: Any, width: Any, E: Any, nu: Any) -> Any:
    """Ritz matrix ∂²U/∂a_i∂a_j of the fields w, θ_x, θ_y in ``monomials``, exact for polynomial ``thickness`` in x.

    All arguments are sympy expressions or rationals; the result is a sympy matrix.
    """
    functions = monomials(basis)
    a = sp.symbols(f"a0:{3 * len(functions)}")
    n = len(functions)
    w, theta_x, theta_y = (sum(c * f for c, f in zip(a[k * n :], functions, strict=False)) for k in range(3))
    density = energy_density(w, theta_x, theta_y, thickness, E, nu)
    poly = sp.Poly(density, x, y)
    total = sp.Integer(0)
    for (i, j), coefficient in poly.terms():
        total += coefficient * height ** (i + 1) / (i + 1) * width ** (j + 1) / (j + 1)
    quadratic = sp.Poly(sp.expand(total), *a)
    matrix = sp.zeros(3 * n, 3 * n)
    for powers, coefficient in quadratic.terms():
        involved = [i for i, power in enumerate(powers) for _ in range(power)]
        i, j = involved
        matrix[i, j] = matrix[j, i] = coefficient * (2 if i == j else 1)
    return matrix


def deflection(
    basis: Basis,
    thickness: Any,
    height: Any,
    width: Any,
    E: Any,
    nu: Any,
    points: Sequence[tuple[Any, Any]],
) -> Any:
    """Deflections w at all ``points`` under a unit force at each, solved in exact rational arithmetic."""
    matrix = stiffness(basis, thickness, height, width, E, nu)
    functions = monomials(basis)
    loads = sp.zeros(matrix.rows, len(points))
    for column, (px, py) in enumerate(points):
        for row, function in enumerate(functions):
            loads[row, column] = function.subs({x: px, y: py})
    return loads.T * matrix.LUsolve(loads)
