"""Strip of contact on a kink of a flank: against elements of constant pressure, and on the flanks of real gears."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from fem_reference.contact.strip import slice_at
from gearbench import Scene
from gearbench.compliance.kink import kink_softening
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.law import compression
from gearbench.effects.hertz import Hertz
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load

#: 4 (ln 2 + ½): Hertz's approach in half-widths and c₁q.
HERTZ = 4 * (math.log(2) + 0.5)


def pressed(edge: NDArray, gap: NDArray) -> float:
    """Approach of two half-spaces under unit load, of constant pressures between ``edge``, lengths in half-widths."""

    def log_integral(x: NDArray) -> NDArray:
        return x * np.log(np.abs(np.where(x == 0, 1.0, x))) - x

    width, middle = np.diff(edge), (edge[1:] + edge[:-1]) / 2
    d = middle[:, None] - edge
    K = -4 * (log_integral(d[:, :-1]) - log_integral(d[:, 1:]))
    loaded, approach = gap < gap.min() + 8, 0.0
    for _ in range(60):
        n = int(loaded.sum())
        system = np.block([[K[np.ix_(loaded, loaded)], -np.ones((n, 1))], [width[loaded], np.zeros((1, 1))]])
        found = np.linalg.solve(system, np.append(-gap[loaded], 1.0))
        p = np.zeros(len(width))
        p[loaded], approach = found[:n], float(found[n])
        wrong = loaded & (p < 0)
        if not wrong.any():
            wrong = ~loaded & (K @ p + gap < approach - 1e-9)
            if not wrong.any():
                break
        loaded ^= wrong
    return approach


@pytest.mark.parametrize("k", [0.3, 1.0, 3.0])
def test_strip_on_a_kink_is_that_of_elements_of_constant_pressure(k: float) -> None:
    """Before the kink, on it and behind it. Elements of 1/150 half-widths are good to 2e-3 of what is added."""
    for s in (-0.7, 0.0, 0.3 * k, 0.5 * k, k + 0.4):
        edge = np.linspace(min(s, s - k, 0) - 1.2, max(s, s - k, 0) + 1.2, 501)
        x = (edge[1:] + edge[:-1]) / 2
        least = 0.0 if s < 0 else 4 * s**2 if s <= k else 8 * k * s - 4 * k**2
        truth = pressed(edge, 4 * (x - s) ** 2 + 8 * k * np.maximum(x, 0)) - HERTZ - least
        assert float(kink_softening(np.array(s), np.array(k))) == pytest.approx(truth, abs=1e-3)


def test_limits_of_the_strip() -> None:
    """Nothing where it does not reach the kink; alike from both sides; a blunt wedge where it sees nothing else."""
    k = np.array([0.2, 1.0, 5.0])
    for s in (-1 - 1e-9, k + 1 + 1e-9):
        assert_allclose(kink_softening(s, k), 0.0, atol=1e-12)
    assert_allclose(kink_softening(-1 + 1e-5, k), 0.0, atol=1e-4)
    s = np.linspace(-0.9, 5.9, 40)[:, None]
    assert_allclose(kink_softening(s, k), kink_softening(k - s, k), atol=1e-11)
    # wedge of the slopes ±k/2: p = (4k/π²) arcosh(L/|ξ|), L = π/(2k), D = 4 ln(2/L) + 4 (Johnson §5.2)
    k = np.array([1e3])
    value = kink_softening(k / 2, k) + HERTZ + 4 * (k / 2) ** 2
    level = 4 * (k / 2) ** 2 + 4 * np.log(2 / (math.pi / (2 * k))) + 4
    assert_allclose(value - 4 * (k / 2) ** 2, level - 4 * (k / 2) ** 2, atol=1e-3)


@pytest.mark.parametrize("gear", ["pinion", "wheel"])
@pytest.mark.parametrize("helix", [0.0, 25.0])
def test_law_at_the_start_of_a_relief_is_that_of_the_real_flanks(gear: str, helix: float) -> None:
    """Heights of both flanks over their common tangent, from the geometry of the contact finite elements.

    Spur gears press their flanks along a line, helical ones too: in the plane square to it lengths across are those
    of the transverse section, heights cos β_b times theirs.
    """
    relief = TipRelief(amount=20.0, length=0.8, gear=gear)
    pair = Pair(
        normal_module=2.0, helix_angle=helix, face_width=20.0, centre_distance=65.0 / math.cos(math.radians(helix)),
        pinion=Member(teeth=25), wheel=Member(teeth=40),
    )  # fmt: skip
    effects = (ToothBending(model="solid"), Hertz(), OffLineContact(), relief)
    scene = Scene(pair=pair, load=Load(torque=100.0), effects=effects)
    lines = scene_lines(scene, (np.arange(40) + 0.5) / 40)
    touch, q = lines.touch, lines.typical_load
    assert touch is not None
    assert lines.separation is not None
    cos_b, index = math.cos(pair.meshing.beta_b), 0 if gear == "pinion" else 1
    ((start, _),) = lines.separation.plane.profiles[index].kinks
    c = sum(1 / (math.pi * material.plane_strain_modulus) for material in pair.materials) / 2
    rho = lines.curvature_radius
    half_width = np.sqrt(8 * c * rho * q)
    away = (touch.rolls[index] ** 2 - start**2) / (2 * pair.gears[index].base_radius) / half_width
    near = (np.abs(away) < 0.8) & (lines.length > 0)
    assert near.sum() > 4
    law = Hertz().compliance(lines, {})
    tested = 0
    for position, k, segment in np.argwhere(near)[:: max(1, int(near.sum()) // 6)]:
        at = (position, k, segment)
        real = slice_at(pair, (relief,), float(lines.mesh_phase[position]), int(lines.index[k]), float(lines.y[at]))
        # at both loads for which the law is made: half of what a line carries on the mean, all on a single pair
        for load in (q, 2 * pair.meshing.transverse_contact_ratio * q):
            width = math.sqrt(8 * c * float(rho[at]) * load)
            edge = np.linspace(-2.0, 2.0, 801)
            x = (edge[1:] + edge[:-1]) / 2
            gap = (real.separation(x * width) - real.gap * real.lever) * cos_b / (c * load)
            truth = c * load * (pressed(edge, gap) - HERTZ)
            plain = load * plain_law(pair, touch.rolls[:, position, k, segment], float(rho[at]), load)
            found = float(compression(np.array(load), law.a[at], law.h[at])) - plain
            # 0.03 to 0.6 µm; the flanks have more than a parabola and a kink, their curvature changes over the strip
            assert found == pytest.approx(truth, abs=4e-6 * load / q)
        tested += 1
    assert tested >= 4


def plain_law(pair: Pair, rolls: NDArray, rho: float, q: float) -> float:
    """Weber and Banaschek's law of smooth flanks [mm²/N]."""
    each = [2 / (math.pi * material.plane_strain_modulus) for material in pair.materials]
    a_H = math.sqrt(2 * sum(each) * q * rho)
    found = 0.0
    for c, material, gear, roll in zip(each, pair.materials, pair.gears, rolls, strict=True):
        t = float(gear.flank_depth(np.array(math.hypot(gear.base_radius, roll))))
        found += c * (math.log(2 * t / a_H) - material.nu / (2 * (1 - material.nu)))
    return found
