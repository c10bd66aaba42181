"""Rings of internal gears: closed forms of the annulus held outside, statics, limits."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.lugs import LONGEST, Lugs
from gearbench.compliance.ring import LAYER, Ring
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.gear import Gear
from gearbench.geometry.meshing import Meshing
from tests.compliance.test_ring import R_O, annulus, ring
from tests.support.toothed_rings import NU, E


@pytest.mark.parametrize("outside", [44.0, 60.0, 100.0])
@pytest.mark.parametrize("n", [0, 1, 2, 3, 5, 10])
def test_harmonics_of_the_annulus_held_outside(n, outside):
    """Tractions on the inner rim are minus the stresses; for the teeth e_θ and e_R are reversed."""
    found = ring((24, 1), inner_radius=-outside, radius=-R_O).harmonics(np.array([n]))[0, :2, :2] * R_O
    turned = np.diag([1.0, -1.0])
    exact = -turned @ annulus(n, NU, outside) @ turned
    whole = n == 0 or math.log(outside / R_O) < LAYER / n  # else what the layer of a high harmonic leaves out
    assert_allclose(found, exact, rtol=0, atol=(1e-9 if whole else 1e-4) * np.abs(found).max())
    assert np.linalg.eigvalsh(found).min() > 0


def gear(teeth: int, helix: float = 0.0, width: float = 12.0) -> Gear:
    return Gear(
        teeth=-teeth, normal_module=2.0, pressure_angle=20.0, helix_angle=helix, face_width=width,
        profile_shift=0.0, addendum=0.8, dedendum=1.25, fillet_radius=0.2, blank="pinion_cutter",
    )  # fmt: skip


def body(g: Gear, outside: float, order=(4, 4, 4), along: int = 6, nu: float = NU) -> ToothedRing:
    tooth = SolidTooth(gear=g, E=E, nu=nu, order=order, rooted=True)
    return ToothedRing(tooth=tooth, bore_radius=-outside, order=along)


@pytest.mark.slow
def test_equal_loads_on_all_teeth_turn_and_widen_the_rim():
    """Between two outsides: what the metal between them yields to the torque, and to the radial part of the loads.

    Closed forms of the annulus; ν = 0, so that the width does not matter, and teeth too small for their roots to widen.
    """
    g = gear(1201)
    z, r, b, mu = -g.teeth, g.root_radius, g.face_width, E / 2
    found = []
    for outside in (1.6, 3.0):
        block = body(g, outside * abs(r), (4, 4, 4), 10, 0.0).blocks(z // 2)
        found.append(block.sum(axis=0)[0, 0] / (b * (g.tip_radius - g.form_radius)))
    turn = z * abs(g.base_radius) / (4 * math.pi * mu * b * r**2) * (1 / 1.6**2 - 1 / 3.0**2)
    R = np.linspace(g.form_radius, g.tip_radius, 2001)
    radial = float(np.mean(np.sqrt(1 - (g.base_radius / R) ** 2)))
    near, far = (-annulus(0, 0.0, outside * R_O)[1, 1] / R_O for outside in (1.6, 3.0))
    exact = abs(g.base_radius) * turn + z * radial**2 * (far - near) / (2 * math.pi * b)
    assert found[1] - found[0] == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("helix", [0.0, 25.0])
def test_all_teeth_together_are_symmetric_and_positive_and_thin_rings_are_clamps(helix):
    g = gear(36 if helix else 41, helix)
    z = -g.teeth
    C = body(g, 1.1 * abs(g.root_radius)).blocks(z)
    for d in range(z + 1):
        assert_allclose(C[z + d], C[z - d].T, rtol=0, atol=1e-15 * np.abs(C).max())
    whole = np.block([[C[z + i - j] for j in range(z)] for i in range(z)])
    value = np.linalg.eigvalsh(whole)
    assert value[0] > -1e-12 * value[-1]
    thin = [np.linalg.norm(body(g, (1 + h) * abs(g.root_radius)).blocks(0)) for h in (1e-3, 1e-4, 1e-5)]
    assert_allclose(np.diff(np.log(thin)) / math.log(0.1), 1.0, atol=0.06)


# -- springs at the outside -------------------------------------------------------------------------------------------
def test_a_thin_free_ring_bends_like_a_curved_beam():
    """w = p r⁴/(EI (n² − 1)²) with p on the inside of the ring; the remaining error comes from its thickness."""
    n = np.array([2.0, 3.0, 4.0])
    for h in (0.02, 0.01):
        inner, outer = 100 * (1 - h / 2), 100 * (1 + h / 2)
        free = ring(
            (6, 1), inner_radius=-outer, radius=-inner, width=10.0, nu=0.0, held=False, support=(0.0, 1e-9)
        ).harmonics(n)[:, 1, 1]
        beam = 100.0**4 / (E * (100 * h) ** 3 / 12) / (n**2 - 1) ** 2
        assert_allclose(free * inner * (inner / 100), beam * (inner / 100) ** 2, rtol=0.6 * h)


def test_springs_alone_by_statics():
    """Torque and force on the rim of a ring that is so stiff that only the springs yield."""
    r_o, r_i, k = 60.0, R_O, 10.0
    found = ring((6, 1), inner_radius=-r_o, radius=-r_i, E=1e6, support=(k, k)).harmonics(np.array([0.0, 1.0])) * r_i
    # torque of a unit traction: 2π r_i² = angle · 2π r_o³ k
    assert found[0, 0, 0] == pytest.approx(r_i**3 / (r_o**3 * k), rel=5e-3)
    # a force of tractions cos θ along both directions, one half each: displacement r_i/(r_o k)
    push = np.array([1.0, -1.0]) if found[1, 0, 1] < 0 else np.array([1.0, 1.0])
    assert push @ found[1, :2, :2] @ push / 2 == pytest.approx(r_i / (r_o * k), rel=5e-3)


@pytest.mark.parametrize("helix", [0.0, pytest.param(25.0, marks=pytest.mark.slow)])
def test_lugs_that_surround_a_ring_are_springs_all_around(helix):
    """Three polynomials on each of twelve lugs resolve the displacement of the outside."""
    g, count, springs = gear(36 if helix else 41, helix, 8.0), 12, (20.0, 200.0)
    tooth = SolidTooth(gear=g, E=E, nu=NU, order=(4, 4, 4), rooted=True)
    outside = abs(g.root_radius) + 5.0
    around = Lugs(
        angles=tuple(0.1 + 2 * math.pi * np.arange(count) / count),
        length=2 * math.pi * outside / count,
        springs=springs,
    )
    on_lugs = ToothedRing(tooth=tooth, bore_radius=-outside, support=(0.0, 0.0), lugs=around).flank(9)
    held = ToothedRing(tooth=tooth, bore_radius=-outside, support=springs, order=16).flank(9)
    for i, j in ((0, 0), (1, 0), (5, 5), (9, 2)):
        assert_allclose(on_lugs.at(i, j), held.at(i, j), rtol=0, atol=1e-3 * np.abs(held.at(0, 0)).max())
    # the driven one of a pair counts its teeth the other way round
    other = replace(on_lugs, driven=True)
    assert_allclose(other.at(3, 1), on_lugs.at(-3, -1), rtol=0, atol=1e-12 * np.abs(held.at(0, 0)).max())


def test_long_rigid_lugs_all_around_hold_a_ring_firmly():
    """Three lugs of a third of the circumference, in parts; in one piece they leave it more than twice as soft."""
    g, rim = gear(41, 0.0, 8.0), 8.0
    tooth, outside = SolidTooth(gear=g, E=E, nu=NU, order=(4, 4, 4), rooted=True), abs(g.root_radius) + rim
    third = 2 * math.pi / 3
    lugs = Lugs(angles=(0.1, 0.1 + third, 0.1 + 2 * third), length=third * outside).parted(outside, LONGEST * rim)
    on_lugs = ToothedRing(tooth=tooth, bore_radius=-outside, support=(0.0, 0.0), lugs=lugs).flank(3)
    held = ToothedRing(tooth=tooth, bore_radius=-outside, order=16).flank(3)
    for i, j in ((0, 0), (1, 0), (7, 7), (14, 13)):
        softer = on_lugs.at(i, j)[0, 0] - held.at(i, j)[0, 0]
        assert abs(softer) < 2e-3 * (tooth.matrix + held.at(0, 0))[0, 0]


def test_three_lugs_hold_by_statics():
    """A stiff ring on three lugs at equal angles: a torque turns it against their tangential springs alone."""
    g = gear(41, 0.0, 8.0)
    stiff, outside = SolidTooth(gear=g, E=1e5 * E, nu=NU, order=(2, 2, 2), rooted=True), abs(g.root_radius) + 12.0
    lugs = Lugs(angles=(0.0, 2 * math.pi / 3, 4 * math.pi / 3), length=6.0, springs=(50.0, 80.0))
    flank = ToothedRing(tooth=stiff, bore_radius=-outside, support=(0.0, 0.0), lugs=lugs).flank(0)
    z, area = abs(g.teeth), g.face_width * (g.tip_radius - g.form_radius)
    torque = sum(flank.at(0, j)[0, 0] for j in range(z)) / area
    # lugs do not slide where they are long: their middle moves by R φ
    assert torque == pytest.approx(
        z * g.base_radius**2 / (3 * 80.0 * lugs.length * g.face_width * outside**2), rel=2e-3
    )


def test_turning_a_ring_by_a_tooth_moves_its_lugs_by_a_pitch():
    g = gear(41, 0.0, 8.0)
    tooth, pitch = SolidTooth(gear=g, E=E, nu=NU, order=(2, 3, 2), rooted=True), 2 * math.pi / 41
    on = [
        ToothedRing(
            tooth=tooth, bore_radius=-50.0, support=(0.0, 0.0), lugs=Lugs(angles=(a, a + 2.0, a + 4.1), length=6.0)
        )
        for a in (0.1, 0.1 - 3 * pitch)
    ]
    first, second = (body.anchors for body in on)
    assert first is not None
    assert second is not None
    for i, j in ((0, 0), (2, -1)):
        near = second.between(i, j)
        assert_allclose(first.turned(3).between(i, j), near, rtol=0, atol=1e-8 * np.abs(near).max())


# -- limits -----------------------------------------------------------------------------------------------------------
class Large(NamedTuple):
    """A cutter with more teeth than a scene allows."""

    teeth: int
    profile_shift: float = 0.0


def near_rack(sign: int, helix: float, rounding: float) -> Gear:
    """A gear of 2·10⁸ teeth, external and cut by a rack, or internal and cut by a pinion of 10⁷ teeth."""
    size = {"normal_module": 2.0, "pressure_angle": 20.0, "helix_angle": helix, "face_width": 12.0, "dedendum": 1.25}
    shape = {"profile_shift": 0.1, "addendum": 0.9, "fillet_radius": rounding}
    own = {"blank": "rack"} if sign > 0 else {"blank": "pinion_cutter", "cutter": Large(10_000_000)}
    return Gear(teeth=sign * 200_000_000, **size, **shape, **own)


@pytest.mark.parametrize(("helix", "rounding"), [(0.0, 0.2), (15.0, 1e-5)])
def test_ring_and_wheel_meet_in_the_rack(helix, rounding):
    """z₂ → ∓∞: path of contact, curvature, tooth with its fillet, its compliance, and the rim below it.

    A rack is rounded in its normal section, a cutter in its transverse one.
    """
    pinion = Gear(
        teeth=24, normal_module=2.0, pressure_angle=20.0, helix_angle=helix, face_width=12.0,
        profile_shift=0.1, addendum=0.9, dedendum=1.25, fillet_radius=0.2,
    )  # fmt: skip
    found = []
    for sign in (1, -1):
        gear = near_rack(sign, helix, rounding)
        a = pinion.pitch_radius + gear.pitch_radius + 0.2 * 2.0
        mesh = Meshing(gears=(pinion, gear), centre_distance=a, face_width=12.0)
        u = np.linspace(mesh.path_start, mesh.path_end, 7)
        tooth = SolidTooth(gear=gear, E=E, nu=NU, order=(4, 5, 4))
        x = np.linspace(0.0, gear.tooth_height, 9)
        e = (gear.root_radius + x[1:]) * gear.half_angle(gear.root_radius + x[1:])
        held = gear.root_radius - 8.0
        rim = Ring(
            inner_radius=held, radius=gear.root_radius, width=12.0, screw=math.tan(gear.beta) / gear.pitch_radius,
            E=E, nu=NU, order=(6, 3),
        ).harmonics(np.array([1e7, 1e8]))  # fmt: skip
        found.append((mesh.curvature_radius(u), e, np.diff(u), tooth.matrix, rim))
    for external, internal in zip(*found, strict=True):
        assert_allclose(internal, external, rtol=1e-6, atol=1e-6 * np.abs(external).max())
