"""The solid's energy derived symbolically: the oracle of the numerical section.

Straight block and screwed sector alike are curvilinear bodies p(q), q = (s, x, z). The displacement is
u = u_θ e_θ + u_R e_R + u_z e_z, with the unit vectors of the cylinder or of the edges of the block. The strain is the
symmetric part of the gradient ∂u/∂q (∂p/∂q)⁻¹; none of the strain formulas of ``gearbench.compliance.section`` is used.
The energy is the same at every angle around the axis, so the angle is set to zero after the unit vectors have been
differentiated.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy as sp

#: Across the tooth (s), along the height, along the axis.
s, x, z = sp.symbols("s x z", real=True)


def monomials(order: tuple[int, int, int]) -> list[Any]:
    """s^k x^{i+1} z^j for k, i, j below the three orders."""
    across, along, axis = order
    return [s**k * x ** (i + 1) * z**j for k in range(across) for i in range(along) for j in range(axis)]


def gradient(u: Sequence[Any], half_width: Any, root_radius: Any, screw: Any) -> Any:
    """Displacement gradient (3, 3) in the directions θ, R, z of the fields u_θ, u_R, u_z(s, x, z).

    ``root_radius`` None: a straight block of half-width e(x) (sympy); otherwise a sector of half-angle e/R at the
    radius R = r_f + x, turning by ``screw`` per unit length.
    """
    if root_radius is None:
        position = sp.Matrix([s * half_width, x, z])
        return sp.Matrix(u).jacobian([s, x, z]) * position.jacobian([s, x, z]).inv()
    phi = sp.Symbol("phi", real=True)
    R = root_radius + x
    angle = s * half_width / R + screw * z
    e_theta, e_R = sp.Matrix([sp.cos(phi), -sp.sin(phi), 0]), sp.Matrix([sp.sin(phi), sp.cos(phi), 0])
    e_z = sp.Matrix([0, 0, 1])
    position = R * e_R + z * e_z
    vector = u[0] * e_theta + u[1] * e_R + u[2] * e_z

    def along(v: Any) -> Any:
        """∂v/∂q, φ being the angle, at φ = 0."""
        return sp.Matrix.hstack(*[(v.diff(q) + v.diff(phi) * angle.diff(q)).subs(phi, 0) for q in (s, x, z)])

    return along(vector) * along(position).inv()


def stiffness(
    order: tuple[int, int, int],
    half_width: Any,
    height: Any,
    width: Any,
    E: Any,
    nu: Any,
    root_radius: Any = None,
    screw: Any = 0,
) -> Any:
    """Ritz matrix ∫ λ tr ε tr ε′ + 2μ ε:ε′ dV of u_θ, u_R, u_z in ``monomials``, integrated exactly.

    Arguments are sympy expressions or rationals. The half-width is constant or linear in x for a block, and R times a
    constant for a sector, so that every denominator is a power of one linear function of x.
    """
    functions = monomials(order)
    n = len(functions)
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    strains = []
    for field in range(3):
        for function in functions:
            u = [function if field == k else sp.Integer(0) for k in range(3)]
            grad = gradient(u, half_width, root_radius, screw)
            strains.append(((grad + grad.T) / 2).applyfunc(sp.cancel))
    matrix = sp.zeros(3 * n, 3 * n)
    for a, first in enumerate(strains):
        for b, second in enumerate(strains[: a + 1]):
            product = lam * first.trace() * second.trace()
            product += 2 * mu * sum(p * q for p, q in zip(first, second, strict=True))
            matrix[a, b] = matrix[b, a] = _integral(product * half_width, height, width)
    return matrix


def _integral(density: Any, height: Any, width: Any) -> Any:
    """∫ over s ∈ [−1, 1], z ∈ [0, width], x ∈ [0, height] of a polynomial in s, z with coefficients rational in x."""
    numerator, denominator = sp.fraction(sp.cancel(density))
    along = sp.Integer(0)
    for (i, j), coefficient in sp.Poly(numerator, s, z).terms():
        if i % 2 == 0:
            along += coefficient * sp.Rational(2, i + 1) * width ** (j + 1) / (j + 1)
    return _rational_integral(along, denominator, height)


def _rational_integral(numerator: Any, denominator: Any, height: Any) -> Any:
    """∫ over x ∈ [0, height] of a polynomial over a power of a linear function, by powers of that function."""
    root = sp.roots(sp.Poly(denominator, x))
    if not root:
        return sp.integrate(sp.expand(numerator / denominator), (x, 0, height))
    ((pole, power),) = root.items()
    t = sp.Symbol("t", positive=True)
    lead = sp.Poly(denominator, x).LC()
    total = sp.Integer(0)
    for (n,), coefficient in sp.Poly(numerator.subs(x, t + pole), t).terms():
        m = n - power + 1
        low, high = -pole, height - pole
        total += coefficient * (sp.log(high / low) if m == 0 else (high**m - low**m) / m)
    return total / lead


def deflection(matrix: Any, order: tuple[int, int, int], points: Sequence[tuple[Any, Any, Any, Any]]) -> Any:
    """Displacements at all ``points`` (field 0, 1 or 2, s, x, z) under a unit force at each, solved exactly."""
    functions = monomials(order)
    loads = sp.zeros(matrix.rows, len(points))
    for column, (field, *position) in enumerate(points):
        for row, function in enumerate(functions):
            loads[field * len(functions) + row, column] = function.subs(dict(zip((s, x, z), position, strict=True)))
    return loads.T * matrix.LUsolve(loads)
