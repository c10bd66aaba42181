"""Teeth on their gear body: joint to the ring, waves around the gear, exact solutions and limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.bases import gauss, width_functions
from gearbench.compliance.gear_body import ToothedRing, wave_weights, waves_computed
from gearbench.compliance.ring import Ring, harmonic_weights
from tests.support.toothed_rings import NU, E, body, gear


# -- waves around the gear --------------------------------------------------------------------------------------------
def dense_body(b: ToothedRing) -> tuple[np.ndarray, np.ndarray]:
    """All z teeth at once: motions q (tooth, r) per unit force on the roots, complex; and Φ.

    Green's function of the rim summed over its harmonics −N … N, tractions and motions integrated over s by Gauss
    points; neither waves nor phases nor symmetry of the roots.
    """
    g, t = b.tooth.gear, b.tooth
    z, psi, count, n_s = g.teeth, float(g.half_angle(g.root_radius)), b.axis_order, t.order[0]
    S, phi = b.tooth_parts
    ring = Ring(
        inner_radius=b.bore_radius, radius=g.root_radius, width=g.face_width, screw=math.tan(g.beta) / g.pitch_radius,
        E=E, nu=NU, order=(b.order, count),
    )  # fmt: skip
    most = z * math.ceil(30.0 / psi / z) + z // 2
    n = np.arange(-most, most + 1)
    some, weights = harmonic_weights(most)
    positive = np.tensordot(weights, ring.harmonics(some), 1)
    # of negative harmonics: the conjugate field is another real solution, e^{−inθ} with −i for i
    phase = (1j ** (np.array([1, 0, 1])[:, None] + np.arange(count))).ravel()
    C = phase[:, None] * positive[np.abs(n)] * np.conj(phase)
    C = np.where(n[:, None, None] < 0, np.conj(C), C).reshape(len(n), 3, count, 3, count)
    s, w = gauss(80, -1, 1)
    P = width_functions(n_s, (s + 1) / 2)[0] / math.sqrt(2 * psi * g.root_radius)
    wave = np.einsum("sk,s,ns->nk", P, w * psi * g.root_radius, np.exp(1j * np.multiply.outer(n, s * psi)))
    B = np.zeros((z, 3, n_s, count, 3, n_s, count), dtype=complex)
    for d in range(z):
        turn = np.exp(2j * math.pi * n * d / z) / (2 * math.pi)
        B[d] = np.einsum("n,nk,nl,nfjge->fkjgle", turn, wave, np.conj(wave), C, optimize=True)
    r = len(S)
    B = B.reshape(z, r, r)
    assert_allclose(B.imag, 0, atol=1e-12 * np.abs(B).max())
    whole = np.block([[B[(i - j) % z].real for j in range(z)] for i in range(z)])
    motion = np.linalg.solve(np.eye(z * r) + whole @ np.kron(np.eye(z), S), whole)
    return motion.reshape(z, r, z, r)[:, :, 0], phi


@pytest.mark.parametrize(
    ("helix", "teeth", "bore"), [(0.0, 11, 0.6), (25.0, 12, 0.6), (-15.0, 11, 0.9), (0.0, 30, 0.9), (20.0, 31, 0.6)]
)
def test_blocks_against_all_teeth_solved_at_once(helix, teeth, bore):
    b = body(gear(helix, teeth=teeth), bore=bore, order=(3, 3, 3), along=6)
    motion, phi = dense_body(b)
    for d, block in zip(range(-2, 3), b.blocks(2), strict=True):
        # the wave ± z/2 of an even number of teeth ends with one harmonic more on one side; many waves are interpolated
        relative = 1e-4 if teeth > 20 else 1e-5 if teeth % 2 == 0 else 1e-10
        tolerance = relative * np.abs(b.blocks(0)).max()
        assert_allclose(block, phi @ motion[d % teeth] @ phi.T, rtol=0, atol=tolerance)


GEARS = pytest.mark.parametrize(("helix", "teeth"), [(0.0, 25), (20.0, 18)])


@GEARS
def test_compiled_waves_are_those_of_python(helix, teeth, monkeypatch):
    """Bodies with unequal faces have complex waves, which Python solves; it can solve real ones too."""
    b = body(gear(helix, teeth=teeth))
    compiled = b.blocks(1)
    monkeypatch.setattr(np, "isrealobj", lambda _: False)
    assert_allclose(replace(b).blocks(1), compiled, rtol=0, atol=1e-11 * compiled.max())


@pytest.mark.parametrize("teeth", [11, 12, 25, 40, 83, 500])
def test_waves_between_those_computed(teeth):
    """Interpolated waves: 2e-4 of the greatest. Long waves grow like 1/m; about z/2 they are even or odd."""
    even, odd = wave_weights(teeth)
    m, x = np.arange(1, teeth // 2 + 1), math.pi * np.arange(1, teeth // 2 + 1) / teeth
    some = waves_computed(teeth)[1:]
    for weights, values in ((even, 1 / np.sin(x)), (even, 1 + 0 * x), (odd, 1 / np.tan(x)), (odd, np.cos(x))):
        curve = np.append(3.0, values)
        found = weights @ np.append(3.0, values[some - 1])
        assert found[0] == 3.0
        assert_allclose(found[np.append(0, some)], curve[np.append(0, some)], rtol=1e-12, atol=1e-12)
        assert_allclose(found[m], values, rtol=0, atol=2e-4 * np.abs(values[4:]).max())


@pytest.mark.parametrize(("helix", "width"), [(0.0, 12.0), (25.0, 600.0)])
def test_torque_and_thrust_on_all_teeth_turn_and_shift_the_rim(helix, width):
    """Of what an even load on all teeth does, torsion and shear along the axis of the ring depend on the bore.

    τ_θ = τ r_o²/R², τ_z = t r_o/R: between two bores the teeth turn and shift by the ring of metal between them, r_b
    cos β_b and sin β_b times that along the normal. Waves around the gear die out before they reach a bore. The thrust
    also dishes the body; not a wide one.
    """
    g = gear(helix, width=width)
    r, z, b, mu = g.root_radius, g.teeth, g.face_width, E / (2 * (1 + NU))
    found = []
    for bore in (0.15, 0.3):
        block = body(g, bore=bore, order=(4, 4, 6), along=12).blocks(z // 2)  # every tooth once, z odd
        found.append(block.sum(axis=0)[0, 0] / (b * (g.tip_radius - g.form_radius)))
    torque, thrust = z * g.base_radius * math.cos(g.beta_b), z * math.sin(g.beta_b)
    turn = torque / (4 * math.pi * mu * b * r**2) * (1 / 0.15**2 - 1 / 0.3**2)
    shift = thrust / (2 * math.pi * mu * b) * math.log(0.3 / 0.15)
    exact = g.base_radius * math.cos(g.beta_b) * turn + math.sin(g.beta_b) * shift
    # the even pressure on the rim: 1.5e-4; the shift is 0.8 % of the whole, what is left of the dishing 3 % of that
    assert found[0] - found[1] == pytest.approx(exact, rel=4e-4)


# -- invariants and limits --------------------------------------------------------------------------------------------


@GEARS
def test_all_teeth_together_are_symmetric_and_positive(helix, teeth):
    b = body(gear(helix, teeth=teeth))
    C = b.blocks(teeth)
    far = teeth
    for d in range(teeth + 1):
        assert_allclose(C[far + d], C[far - d].T, rtol=0, atol=1e-15 * np.abs(C).max())
    assert_allclose(C[far + 1 : far + teeth], C[1:far], rtol=0, atol=1e-13 * np.abs(C).max())  # tooth d is tooth d − z
    whole = np.block([[C[far + i - j] for j in range(teeth)] for i in range(teeth)])
    value = np.linalg.eigvalsh(whole)
    assert value[0] > -1e-13 * value[-1]


@GEARS
def test_what_is_cut_off_does_not_count(helix, teeth, monkeypatch):
    """Higher order along R, more harmonics and more polynomials in z of the root change nothing."""
    g = gear(helix, teeth=teeth)

    def blocks(along=6):
        return body(g, along=along, order=(5, 6, 8)).blocks(1)

    C = blocks()
    size = np.linalg.norm(C[1])
    assert np.linalg.norm(blocks(along=16) - C) < 3e-4 * size
    with monkeypatch.context() as patch:
        patch.setattr("gearbench.compliance.gear_body.FINEST", 120.0)
        assert 1e-6 * size < np.linalg.norm(blocks() - C) < 3e-4 * size
    monkeypatch.setattr(ToothedRing, "axis_order", property(lambda self: self.tooth.order[2]))
    assert 1e-6 * size < np.linalg.norm(blocks() - C) < 4e-3 * size


@pytest.mark.parametrize(
    ("helix", "teeth", "width", "bore"),
    [
        (60.0, 5, 0.4, 0.999),
        (0.0, 5, 40.0, 0.1),
        (45.0, 12, 150.0, 0.02),
        (8.0, 150, 1.0, 0.98),
        (0.0, 400, 20.0, 0.999),
    ],
)
def test_odd_gears_have_a_positive_compliance(helix, teeth, width, bore):
    """With few and many teeth, discs and shafts, and rims of a thousandth of the radius."""
    b = body(gear(helix, teeth=teeth, width=width), bore=bore, along=6)
    C = b.blocks(1)
    whole = np.block([[C[1], C[0]], [C[2], C[1]]])
    value = np.linalg.eigvalsh(whole)
    assert value[0] > -1e-14 * value[-1]
    assert_allclose(whole, whole.T, rtol=0, atol=1e-14 * value[-1])
    # an even load on one tooth moves it more than its neighbour
    assert C[1, 0, 0] > 0
    assert abs(C[2, 0, 0]) < C[1, 0, 0]
