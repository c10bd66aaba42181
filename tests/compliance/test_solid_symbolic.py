"""The numerical solid against the energy derived symbolically and solved exactly."""

import math

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from gearbench.compliance.section import ToothSection
from gearbench.compliance.solid import Solid
from tests.support import symbolic_solid

R = sp.Rational
HEIGHT, WIDTH, E, NU, ROOT = R(9, 4), R(8), R(21, 10), R(3, 10), R(20)
x = symbolic_solid.x
SHAPES = {
    "block": (R(3, 2) + 0 * x, None, R(0), (2, 2, 2)),
    "tapered block": (R(3, 2) - x / 3, None, R(0), (2, 2, 1)),
    "spur sector": ((ROOT + x) / 16, ROOT, R(0), (2, 2, 1)),
    "screwed sector": ((ROOT + x) / 16, ROOT, R(1, 15), (2, 1, 2)),
}
#: (field, s, x, z)
POINTS = [
    (0, R(1), R(9, 4), R(3)), (0, R(-1, 3), R(1), R(8)), (0, R(0), R(2), R(1)), (0, R(1), R(1, 2), R(5)),
    (1, R(1), R(2), R(1)), (1, R(0), R(9, 4), R(7)), (2, R(-1), R(2), R(5)), (2, R(1, 2), R(3, 2), R(0)),
]  # fmt: skip


def numeric(half_width, root, screw, order) -> Solid:
    values = sp.lambdify(x, half_width, "numpy")
    section = ToothSection(
        height=float(HEIGHT),
        half_width=lambda at: values(at) + 0 * at,
        root_radius=math.inf if root is None else float(root),
        screw=float(screw),
        order=order[:2],
    )
    return Solid(section=section, width=float(WIDTH), E=float(E), nu=float(NU), order=order[2])


@pytest.mark.parametrize(
    "shape", [*list(SHAPES)[1:3], *(pytest.param(s, marks=pytest.mark.slow) for s in ("block", "screwed sector"))]
)
def test_displacements_under_unit_forces(shape):
    half_width, root, screw, order = SHAPES[shape]
    matrix = symbolic_solid.stiffness(order, half_width, HEIGHT, WIDTH, E, NU, root, screw)
    matrix = matrix.applyfunc(lambda value: sp.N(value, 40))  # logarithms; everything else is rational
    exact = np.array(symbolic_solid.deflection(matrix, order, POINTS).tolist(), dtype=float)
    solid = numeric(half_width, root, screw, order)
    rows = [solid.functional(float(at), float(s), float(z), np.eye(3)[field]) for field, s, at, z in POINTS]
    # the promise, 1e-12, of the greatest: some displacements vanish by symmetry
    assert_allclose(solid.compliance(np.array(rows)), exact, rtol=1e-12, atol=1e-12 * np.abs(exact).max())
