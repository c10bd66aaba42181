"""The ring against closed forms of the clamped annulus, the energy derived symbolically, bounds and limits."""

from __future__ import annotations

import math
from functools import cache

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from gearbench.compliance.bases import gauss, width_functions
from gearbench.compliance.ring import Ring, harmonic_weights
from tests.support import symbolic_solid

E, NU, R_I, R_O, WIDTH = 210e3, 0.3, 21.0, 40.0, 15.0
MU = E / (2 * (1 + NU))


def ring(order=(20, 1), **changes) -> Ring:
    values = {"inner_radius": R_I, "radius": R_O, "width": WIDTH, "screw": 0.0, "E": E, "nu": NU, "order": order}
    return Ring(**{**values, **changes})


def test_shear_along_the_axis():
    """W″ + W′/R = n²W/R², μW′(r_o) = 1: a logarithm for n = 0, R^n − r_i^{2n} R^{−n} for the others."""
    n = np.arange(7.0)
    found = ring((24, 1)).harmonics(n)[:, 2, 2] * R_O
    q = (R_I / R_O) ** (2 * n[1:])
    exact = np.append(math.log(R_O / R_I), (1 - q) / (1 + q) / n[1:]) * R_O / MU
    assert_allclose(found, exact, rtol=1e-12)


@cache
def annulus(n: float, nu: float, bore: float) -> np.ndarray:
    """Amplitudes (U, V) on the rim under unit tractions (θ, R) × e^{inθ}, E = 210 GPa, in 50 digits.

    Navier's equations in polar coordinates and plane strain have solutions R^s with s = ±n ± 1; the conditions at both
    edges give the four constants.
    """
    with mp.workdps(50):
        # powers that coincide for n = 0 and 1 are separated by a small difference
        n = mp.mpf(n) + mp.mpf(10) ** -20
        lam, mu = mp.mpf(E) * nu / ((1 + mp.mpf(nu)) * (1 - 2 * mp.mpf(nu))), mp.mpf(E) / (2 * (1 + mp.mpf(nu)))

        def stresses(s, U, V):
            trace = s * V + V - n * U
            return lam * trace + 2 * mu * s * V, lam * trace + 2 * mu * (V - n * U), mu * ((s - 1) * U + n * V)

        def equilibrium(s, U, V):
            rr, tt, tr = stresses(s, U, V)
            return s * rr - tt - n * tr, (s + 1) * tr + n * tt

        columns = []
        for s in (n + 1, n - 1, 1 - n, -n - 1):
            a, b = equilibrium(s, mp.mpf(1), mp.mpf(0)), equilibrium(s, mp.mpf(0), mp.mpf(1))
            # both equations leave the same direction: R^s is a solution
            assert abs(a[0] * b[1] - a[1] * b[0]) < mp.mpf(10) ** -40 * (abs(a[0] * b[1]) + mu**2)
            U, V = max(((b[k], -a[k]) for k in range(2)), key=lambda v: abs(v[0]) + abs(v[1]))
            rr, _, tr = stresses(s, U, V)
            inner = (mp.mpf(bore) / R_O) ** s
            columns.append((U * inner, V * inner, tr / R_O, rr / R_O, U, V))
        A = mp.matrix([[c[k] for c in columns] for k in range(4)])
        for i in range(4):  # rows and columns of one size
            A[i, :] = A[i, :] / max(abs(A[i, j]) for j in range(4))
        raw = mp.matrix([[c[k] for c in columns] for k in range(2, 4)])
        unit = [max(abs(raw[i, j]) for j in range(4)) for i in range(2)]
        result = np.zeros((2, 2))
        for load in range(2):
            right = mp.zeros(4, 1)
            right[2 + load] = 1 / unit[load]
            c = mp.lu_solve(A, right)
            for k in range(2):
                result[k, load] = float(mp.fsum(columns[j][4 + k] * c[j] for j in range(4)))
        return result


@pytest.mark.parametrize("bore", [12.0, 21.0, 36.0])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
@pytest.mark.parametrize("n", [0, 1, 2, 3, 5, 10])
def test_harmonics_of_the_plane_annulus(n, nu, bore):
    found = ring((24, 1), nu=nu, inner_radius=bore).harmonics(np.array([n]))[0, :2, :2] * R_O
    # 24 functions where the displacement may be R^{±11}
    assert_allclose(found, annulus(n, nu, bore), rtol=0, atol=1e-9 * np.abs(found).max())


@pytest.mark.parametrize("n", [20, 60, 300, 2000])
def test_layer_of_high_harmonics_costs_little(n):
    """Clamping at 7 r/n below the rim, where (1 + 7)² e^−14 of the energy is left, makes the ring 5e-5 stiffer."""
    found = ring().harmonics(np.array([n]))[0, :2, :2] * R_O
    exact = annulus(n, NU, R_I)
    assert_allclose(found, exact, rtol=0, atol=1.2e-4 * exact.max())
    assert np.linalg.eigvalsh(exact - found).min() > 0


@pytest.mark.parametrize("bore", [0.95, 0.6, 0.2, 0.05])
def test_six_functions_are_enough_at_any_bore(bore):
    """The default order of gear bodies is accurate to 5e-4 of the greatest compliance, from thin rims to shafts."""
    n = np.array([0, 1, 2, 3, 5, 8, 12, 20, 40])
    found = ring((6, 1), inner_radius=bore * R_O).harmonics(n)[:, :2, :2] * R_O
    for k, harmonic in zip(n, found, strict=True):
        exact = annulus(int(k), NU, bore * R_O)
        assert_allclose(harmonic, exact, rtol=0, atol=5e-4 * exact.max())


def test_short_waves_see_a_half_plane():
    """n ĉ_n tends to the compliance of the half-plane: 2(1−ν²)/E, coupling (1−2ν)(1+ν)/E, along the axis 1/μ."""
    direct, coupling = 2 * (1 - NU**2) / E, -(1 - 2 * NU) * (1 + NU) / E
    limit = np.array([[direct, coupling, 0], [coupling, direct, 0], [0, 0, 1 / MU]])
    n = np.array([200.0, 800.0])
    error = np.abs(n[:, None, None] * ring().harmonics(n) - limit).max(axis=(1, 2)) / direct
    assert error[0] < 8e-3  # of the order 1/n: the rim is curved
    assert error[1] < 0.3 * error[0]


# -- along the axis ---------------------------------------------------------------------------------------------------
@cache
def strains():
    """Strains (ε_θθ ε_RR ε_zz γ_θR γ_θz γ_Rz) from the symbolic gradient, linear in u_c and its derivatives.

    With e = R the coordinate s is the angle, counted from the screw.
    """
    s, x, z = symbolic_solid.s, symbolic_solid.x, symbolic_solid.z
    root, screw = sp.symbols("root screw", positive=True)
    fields = [sp.Function(f"u{c}")(s, x, z) for c in range(3)]
    gradient = symbolic_solid.gradient(fields, root + x, root, screw)
    symbols, values = [], []
    for c, u in enumerate(fields):
        for k, q in enumerate((s, x, z)):
            symbols.append(sp.Symbol(f"d{c}{k}"))
            values.append((u.diff(q), symbols[-1]))
    values += [(u, sp.Symbol(f"v{c}")) for c, u in enumerate(fields)]
    symbols += [sp.Symbol(f"v{c}") for c in range(3)]
    e = (gradient + gradient.T).subs(values)
    parts = sp.Matrix([e[0, 0] / 2, e[1, 1] / 2, e[2, 2] / 2, e[0, 1], e[0, 2], e[1, 2]])
    matrix = parts.jacobian(sp.Matrix(symbols)).subs({s: 0, z: 0})
    assert sp.simplify(parts - parts.jacobian(sp.Matrix(symbols)) * sp.Matrix(symbols)) == sp.zeros(6, 1)
    return sp.lambdify((x, root, screw), matrix, "numpy")


def symbolic_compliance(body: Ring, n: int, along: int) -> np.ndarray:
    """ĉ_n (3q, 3q) by Ritz with complex amplitudes: Legendre functions over the whole depth times g_j(z) e^{inθ}.

    It is in the phases of the ring (i for u_θ and u_z, i^j), in which it must be real.
    """
    q, depth = body.order[1], body.radius - body.inner_radius
    xi, wx = gauss(along + 12)
    eta, wz = gauss(q + 2)
    f, df = width_functions(along, xi)
    f, df = f * xi[:, None], (df * xi[:, None] + f) / depth
    g, dg = width_functions(q, eta)
    dg = dg / body.width
    lam = body.E * body.nu / ((1 + body.nu) * (1 - 2 * body.nu))
    mu = body.E / (2 * (1 + body.nu))
    C = np.diag([2 * mu] * 3 + [mu] * 3) + 0.0
    C[:3, :3] += lam
    e = []
    for a, x in enumerate(xi * depth):
        B = np.array(strains()(x, body.inner_radius, body.screw), dtype=float)
        value = np.einsum("i,zj->zij", f[a], g)
        parts = np.stack([1j * n * value, np.einsum("i,zj->zij", df[a], g), np.einsum("i,zj->zij", f[a], dg)])
        columns = [np.tensordot(B[:, 3 * c : 3 * c + 3], parts, 1) + np.multiply.outer(B[:, 9 + c], value)
                   for c in range(3)]  # fmt: skip
        e.append(np.stack(columns, axis=2) * np.sqrt(wx[a] * wz * depth * (body.inner_radius + x))[:, None, None, None])
    flat = np.moveaxis(np.array(e), 1, 2).reshape(-1, 6, 3 * along * q)
    K = np.einsum("pan,pam->nm", np.conj(flat), np.einsum("ab,pbm->pam", C, flat), optimize=True)
    phase = 1j ** (np.array([1, 0, 1])[:, None] + np.arange(q))
    load = np.zeros((3, along, q, 3, q), dtype=complex)
    for c in range(3):
        load[c, :, np.arange(q), c, np.arange(q)] = phase[c][:, None] * width_functions(along, np.array(1.0))[0]
    load = load.reshape(len(K), -1)
    return np.conj(load).T @ np.linalg.solve(K, load)


@pytest.mark.parametrize("screw", [0.0, 0.012, -0.012])
@pytest.mark.parametrize("n", [0, 1, 3, 7])
def test_harmonics_against_the_symbolic_strains(n, screw):
    """Independent solution: strains from the metric of the screw, complex amplitudes, other functions of R."""
    body = ring((20, 4), screw=screw)
    exact = symbolic_compliance(body, n, 18)
    assert_allclose(exact.imag, 0, atol=1e-12 * np.abs(exact).max())
    found = body.harmonics(np.array([n]))[0]
    # both converged along R to a few 1e-9
    assert_allclose(found, exact.real, rtol=0, atol=2e-8 * np.abs(found).max())


# -- invariants -------------------------------------------------------------------------------------------------------
N = np.array([0, 1, 2, 5, 14, 15, 40, 200])


def test_negative_harmonics_are_mirror_images():
    """e^{−inθ} is e^{inθ} seen from the other end of the axis; the gear body uses this for n < 0."""
    for screw in (0.0, 0.02):
        body = ring((6, 4), screw=screw)
        here, there = body.harmonics(np.array([3.0])), body.harmonics(np.array([-3.0]))
        odd = ((-1.0) ** (np.array([1, 0, 1])[:, None] + np.arange(4))).ravel()
        layer = ring((6, 4), screw=-screw).harmonics(np.array([3.0]))
        assert_allclose(there * odd[:, None] * odd, here, rtol=0, atol=1e-13 * here.max())
        # the other hand: even functions along the axis with odd ones the other way
        axis = ((-1.0) ** (np.array([0, 0, 1])[:, None] + np.arange(4))).ravel()
        assert_allclose(layer * axis[:, None] * axis, here, rtol=0, atol=1e-13 * here.max())


@pytest.mark.parametrize(("most", "screw"), [(3, 0.0), (6, 0.02), (40, 0.0), (700, 0.0), (700, 0.02)])
def test_interpolation_between_harmonics(most, screw):
    """Splines of degree five for n ĉ_n over ln n are accurate to 1e-3 of the harmonic."""
    body = ring((8, 5), screw=screw)
    n = np.unique(np.geomspace(1, most, 60).round()).astype(int)
    some, weights = harmonic_weights(most)
    found = np.tensordot(weights, body.harmonics(some), 1)
    assert len(found) == most + 1
    exact = body.harmonics(n)
    assert_allclose(found[0], body.harmonics(np.array([0]))[0], rtol=1e-12)
    error = np.abs(found[n] - exact).max(axis=(1, 2)) / exact.max(axis=(1, 2))
    assert error.max() < 1.2e-3
    assert np.linalg.eigvalsh(found).min() > 0
