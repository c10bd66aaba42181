"""Digits of the solid tooth, of the compression below the flank and of the gear body against extended precision."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.compliance.local import compression, half_space_compression
from gearbench.compliance.ring import Ring
from gearbench.compliance.solid_tooth import SolidTooth
from tests.stability.catalogue import CASES
from tests.stability.extended import local, ring
from tests.stability.extended.balls import ball, number, working
from tests.stability.extended.geometry import geometry
from tests.stability.extended.numbers import digits
from tests.stability.measure import compare_body, compare_solid
from tests.stability.models import BODIES, SOLIDS, body_pair


def every(cases):
    return pytest.mark.parametrize(
        "case", [pytest.param(c, id=c.name, marks=[pytest.mark.slow] if c.slow else []) for c in cases.values()]
    )


@every(SOLIDS)
def test_solid_keeps_its_digits(case):
    scene, compliance = compare_solid(case)
    assert min(scene.least, compliance) >= case.digits, (scene, compliance)


@every(BODIES)
def test_body_keeps_its_digits(case):
    assert compare_body(case) >= case.digits


RINGS = {
    "spur": (20.0, 40.0, 20.0, 0.0, 0.3, (3, 3), 14),
    "helical": (20.0, 40.0, 20.0, 0.01, 0.3, (3, 3), 14),
    # R over a factor of twenty
    "small bore": (2.0, 40.0, 20.0, 0.01, 0.3, (4, 2), 11),
    "thin rim": (39.0, 40.0, 20.0, 0.01, 0.3, (4, 2), 13),
    "wide": (20.0, 40.0, 400.0, 0.01, 0.3, (3, 3), 13),
    "nearly incompressible": (20.0, 40.0, 20.0, 0.01, 0.499, (4, 2), 11),
}


@pytest.mark.parametrize("name", RINGS)
def test_ring_keeps_its_digits(name):
    """Complex amplitudes of e^{inθ}, in the phases i^j, i for θ and z, in which those of the model are real."""
    *sizes, order, least = RINGS[name]
    inner, radius, width, screw, nu = sizes
    fast = Ring(inner_radius=inner, radius=radius, width=width, screw=screw, E=2e5, nu=nu, order=order)
    q = order[1]
    phase = np.array([1j ** (j + (field != 1)) for field in range(3) for j in range(q)])
    harmonics = (0, 1, 200)
    found = fast.harmonics(np.array(harmonics, dtype=float))
    with working():
        slow = ring.Ring(*(ball(x) for x in (inner, radius, width, screw, 2e5, nu)), order)
        for n, matrix in zip(harmonics, found, strict=True):
            turned = phase[:, None] * matrix * phase.conj()
            exact = slow.harmonic(n)
            largest = max(abs(number(exact[i, i].real)) for i in range(3 * q))
            for part in ("real", "imag"):
                values = getattr(turned, part)
                for i in range(3 * q):
                    for j in range(3 * q):
                        true = number(getattr(exact[i, j], part))
                        assert digits(values[i, j], true, largest) >= least, (n, i, j)


def test_compression_kernel_keeps_its_digits():
    rng = np.random.default_rng(2)
    k = np.concatenate([[0.0], 10 ** rng.uniform(-3, 1.5, 40)])
    scale = 2 * (1 - 0.3**2) / (np.pi * 2e5)  # far from the load its terms cancel, but count for nothing
    r, t = 10 ** rng.uniform(-4, 1, 41), 10 ** rng.uniform(-1, 1, 41)
    with working():  # at 40 digits the balls of K₀ at large arguments are wide
        for a, b, c in zip(k, r, t, strict=True):
            if a * b > 300:
                continue
            found = compression(2e5, 0.3, np.array([a]), np.array(b), np.array(c))[0]
            exact = number(local.kernel(ball(a), ball(b), ball(c), ball(2e5), ball(0.3)))
            assert digits(found, exact, scale) >= 14, (a, b, c)


LOCAL = ("no gap at all, yang_sun", "b/m = 0.5", "b/m = 100", "β = 45°", "teeth nearly pointed")


@pytest.mark.parametrize("name", LOCAL)
def test_compression_of_the_flank_is_integrated_to_seven_digits(name):
    pair = CASES[name].build().pair
    E, nu = pair.material.E, pair.material.nu
    for k, gear in enumerate(pair.gears):
        with working():
            exact = local.compression(geometry(pair).gears[k], pair.face_width, E, nu, 5, 6)
        found = half_space_compression(gear, E, nu, (5, 6))
        assert np.abs(found - exact).max() <= 1e-7 * exact.max()


ORDERS = [(2, 3, 5), (4, 6, 6), (6, 10, 9)]


@pytest.mark.parametrize("beta", [0.0, 25.0])
def test_high_orders_of_the_solid(beta):
    """Nested spaces: the compliance of the flank grows with each, as a quadratic form; K keeps well conditioned."""
    gear = body_pair(teeth=20, beta=beta, width=5.0).gears[0]
    before = np.zeros((15, 15))
    for order in ORDERS:
        tooth = SolidTooth(gear=gear, E=2e5, nu=0.3, order=order, measured_at="flank", heights=3)
        C = tooth.matrix
        assert np.all(np.isfinite(C))
        assert np.linalg.eigvalsh(C).min() > 0
        assert np.linalg.eigvalsh(C - before).min() >= -1e-12 * np.abs(C).max()
        assert tooth.condition < 1e7
        before = C
