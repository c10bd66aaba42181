"""The numerical plate against the energy derived symbolically and solved in rational arithmetic."""

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from gearbench.compliance.plate import PlateTooth
from tests.support import symbolic_plate as symbolic

R = sp.Rational
HEIGHT, WIDTH, E, NU = R(9, 4), R(8), R(210_000), R(3, 10)
POINTS = [(R(1, 2), R(1)), (R(3, 2), R(4)), (R(9, 4), R(8)), (R(2), R(13, 2))]
THICKNESS = {"constant": R(8, 5) + 0 * symbolic.x, "linear": R(12, 5) - R(2, 3) * symbolic.x}


def numeric_plate(kind: str, basis) -> PlateTooth:
    h = sp.lambdify(symbolic.x, THICKNESS[kind], "numpy")
    return PlateTooth(height=float(HEIGHT), width=float(WIDTH), thickness=h, E=float(E), nu=float(NU), basis=basis)


@pytest.mark.parametrize("kind", THICKNESS)
@pytest.mark.parametrize("basis", ["paper", (1, 1), (2, 2)])
def test_deflections(kind, basis):
    exact = symbolic.deflection(basis, THICKNESS[kind], HEIGHT, WIDTH, E, NU, POINTS)
    x, y = np.array([[float(c) for c in p] for p in POINTS]).T
    factor = numeric_plate(kind, basis).factor(x, y)
    # the promise: 1e-12 relative
    assert_allclose(factor @ factor.T, np.array(exact, dtype=float), rtol=1e-12)
