"""Shafts against closed forms of Timoshenko beams, to 1e-8; motions of whole shafts in bearings."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.errors import InputError
from gearbench.system.beam import Beam
from gearbench.system.bearing import Bearing
from gearbench.system.schema import Coupling, Shaft, ShaftLoad, ShaftSection
from gearbench.system.shaft_model import Face, ShaftModel
from gearbench.system.static import StaticState, external_load, twist
from gearbench.system.structure import Structure

E, NU, RHO = 210e3, 0.3, 7.85e-9
G = E / (2 * (1 + NU))
STIFF = 1e9  # N/µm: rigid beside any shaft here, soft enough to leave 1e-8 to the sums


def section(D, d=0.0):
    m2 = (d / D) ** 2
    kappa = 6 * (1 + NU) * (1 + m2) ** 2 / ((7 + 6 * NU) * (1 + m2) ** 2 + (20 + 12 * NU) * m2)
    return math.pi / 4 * (D**2 - d**2), math.pi / 64 * (D**4 - d**4), kappa


def settled(shaft):
    model = ShaftModel(shaft=shaft, faces=())
    return StaticState(structure=Structure(shafts={0: model}), load=external_load(model))


def supports(a, b):
    return (
        Bearing(position=a, radial_stiffness=STIFF, axial_stiffness=STIFF),
        Bearing(position=b, radial_stiffness=STIFF),
    )


@pytest.mark.parametrize("bore", [0.0, 12.0])
def test_cantilever_of_one_element(bore):
    L, D = 80.0, 30.0
    A, I, kappa = section(D, bore)
    beam = Beam(length=L, diameter=(D, D), bore=(bore, bore), E=E, G=G, nu=NU, density=RHO)
    F = np.linalg.inv(beam.stiffness()[6:, 6:])
    expected = np.zeros((6, 6))
    expected[0, 0] = expected[1, 1] = L**3 / (3 * E * I) + L / (kappa * G * A)
    expected[0, 4] = expected[4, 0] = L**2 / (2 * E * I)
    expected[1, 3] = expected[3, 1] = -(L**2) / (2 * E * I)
    expected[2, 2], expected[5, 5] = L / (E * A), L / (2 * G * I)
    expected[3, 3] = expected[4, 4] = L / (E * I)
    assert_allclose(F, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())


def test_cone_stretches_and_twists_as_integrated():
    L, D0, D1 = 100.0, 20.0, 40.0
    beam = Beam(length=L, diameter=(D0, D1), bore=(0.0, 0.0), E=E, G=G, nu=NU, density=RHO)
    F = np.linalg.inv(beam.stiffness()[6:, 6:])
    assert_allclose(F[2, 2], 4 * L / (math.pi * E * D0 * D1), rtol=1e-8)
    inverse_cubes = (D0**-3 - D1**-3) / (3 * (D1 - D0) / L)
    assert_allclose(F[5, 5], 32 / (math.pi * G) * inverse_cubes, rtol=1e-8)


@pytest.mark.parametrize("at", [30.0, 100.0, 160.0])
def test_stepped_shaft_between_supports(at):
    """Sections of one diameter and force anywhere: F a²b²/3EIL + F ab/κGAL below the load."""
    L, D, F = 200.0, 30.0, 1000.0
    A, I, kappa = section(D)
    pieces = tuple(ShaftSection(length=length, diameter=D) for length in (50.0, 80.0, 70.0))
    s = settled(
        Shaft(name="s", sections=pieces, bearings=supports(0.0, L), loads=(ShaftLoad(position=at, force=(F, 0, 0)),))
    )
    a, b = at, L - at
    sag = F * a**2 * b**2 / (3 * E * I * L) + F * a * b / (kappa * G * A * L)
    assert_allclose(s.at(0, at)[0], sag, rtol=1e-8 + F / (STIFF * 1e3) / sag)
    assert_allclose([f[0] for f, _ in s.bearings(0)], [F * b / L, F * a / L], rtol=1e-9)


def test_steps_of_diameter_add_their_flexibilities():
    """Overhang of two diameters: unit-load integral by pieces."""
    F, D1, D2, L1, L2 = 500.0, 40.0, 25.0, 60.0, 45.0
    A1, I1, k1 = section(D1)
    A2, I2, k2 = section(D2)
    pieces = (
        ShaftSection(length=100.0, diameter=D1),
        ShaftSection(length=L1, diameter=D1),
        ShaftSection(length=L2, diameter=D2),
    )
    tilting = Bearing(position=100.0, matrix=tuple(map(tuple, np.diag([1e12, 1e12, 1e12, 1e16, 1e16]))))
    s = settled(
        Shaft(name="s", sections=pieces, bearings=(tilting,), loads=(ShaftLoad(position=205.0, force=(0, F, 0)),))
    )
    L = L1 + L2
    bending = (L**3 - L2**3) / (3 * E * I1) + L2**3 / (3 * E * I2)
    shear = L1 / (k1 * G * A1) + L2 / (k2 * G * A2)
    assert_allclose(s.at(0, 205.0)[1], F * (bending + shear), rtol=2e-7)  # 1e-7 left by the clamping of 1e16


def test_spring_supports_move_rigidly():
    k1, k2, L, at, F = 20.0, 50.0, 400.0, 100.0, 800.0
    bearings = (
        Bearing(position=0.0, radial_stiffness=k1, axial_stiffness=7.0),
        Bearing(position=L, radial_stiffness=k2),
    )
    stiff = Shaft(
        name="s",
        sections=(ShaftSection(length=L, diameter=5000.0),),
        bearings=bearings,
        loads=(ShaftLoad(position=at, force=(F, 0.0, 210.0)),),
    )
    s = settled(stiff)
    left, right = F * (L - at) / L / (k1 * 1e3), F * at / L / (k2 * 1e3)
    assert_allclose(s.at(0, 0.0)[0], left, rtol=1e-4)  # the shaft itself: 5 m thick
    assert_allclose(s.at(0, L)[0], right, rtol=1e-4)
    assert_allclose(s.at(0, 0.0)[2], 210.0 / 7e3, rtol=1e-4)


def test_sections_move_as_in_pure_bending_tension_and_twist():
    """Such a motion is the exact solution between nodes; rows do the work of the same motion."""
    model = ShaftModel(shaft=Shaft(name="one", sections=(ShaftSection(length=100.0, diameter=20.0),)), faces=())

    def motion(z):
        zero, bend = np.zeros_like(z), 2e-5
        return np.stack([0.3 + bend * z**2 / 2, 0.2 - 1e-3 * z, 1e-4 * z, zero + 1e-3, bend * z, 2e-5 * z], axis=-1)

    z = np.linspace(0.0, 100.0, 12).reshape(3, 4)
    found = model.moved(z, motion(model.nodes).ravel())
    assert_allclose(found, motion(z), rtol=0, atol=1e-13)
    wrench = np.random.default_rng(1).normal(size=(3, 4, 6))
    work = model.rows(z, wrench) @ motion(model.nodes).ravel()
    assert_allclose(work, (wrench * found).sum(axis=-1), rtol=0, atol=1e-12)


def test_mass_of_shaft_is_that_of_its_volume():
    shaft = Shaft(name="s", sections=(ShaftSection(length=90.0, diameter=30.0, end_diameter=40.0, bore=10.0),))
    model = ShaftModel(shaft=shaft, faces=())
    rigid = np.tile(np.eye(6), (len(model.nodes), 1))[:, :3]
    volume = math.pi / 12 * 90 * (30**2 + 30 * 40 + 40**2) - math.pi / 4 * 100 * 90
    assert_allclose(rigid.T @ model.mass @ rigid, RHO * volume * np.eye(3), rtol=1e-10, atol=1e-20)


def test_first_bending_frequency_of_a_slender_free_beam():
    """(4.73004)² √(EI/ρAL⁴) for Euler's beam; L/D = 100 leaves 1e-3 to shear and rotary inertia."""
    from scipy.linalg import eigh

    L, D = 2000.0, 20.0
    A, I, _ = section(D)
    model = ShaftModel(shaft=Shaft(name="s", sections=(ShaftSection(length=L, diameter=D),)), faces=())
    assert len(model.nodes) == 41  # not a hundred, as thick as long: the mesh of a slender shaft has an end
    w = np.sqrt(np.abs(eigh(model.stiffness, model.mass, eigvals_only=True)))
    assert_allclose(w[6], 4.730040745**2 * math.sqrt(E * I / (RHO * A * L**4)), rtol=1e-3)


def test_twist_of_a_seat_is_held_where_the_torque_enters():
    D, b = 50.0, 80.0
    shaft = Shaft(name="s", sections=(ShaftSection(length=200.0, diameter=D),), coupling=Coupling(position=0.0))
    model = ShaftModel(shaft=shaft, faces=(Face(start=60.0, end=140.0),))
    nodes = np.arange(model.node(60.0), model.node(140.0) + 1)
    C = twist(model, nodes, 0.0)
    z = model.nodes[nodes] - 60.0
    assert_allclose(C, np.minimum.outer(z, z) / (G * math.pi * D**4 / 32), rtol=1e-9, atol=1e-20)
    other = twist(model, nodes, 200.0)
    assert_allclose(other, np.minimum.outer(b - z, b - z) / (G * math.pi * D**4 / 32), rtol=1e-9, atol=1e-20)


@pytest.mark.parametrize(
    ("bearings", "way"),
    [
        ((), "across"),
        ((Bearing(position=10.0, radial_stiffness=10.0, axial_stiffness=10.0),), "tilting"),
        (
            (Bearing(position=10.0, radial_stiffness=10.0), Bearing(position=90.0, radial_stiffness=10.0)),
            "axially",
        ),
    ],
)
def test_shaft_without_hold_is_refused(bearings, way):
    load = ShaftLoad(position=50.0, force=(100.0, 50.0, 20.0))
    shaft = Shaft(name="input", sections=(ShaftSection(length=100.0, diameter=30.0),), bearings=bearings, loads=(load,))
    with pytest.raises(InputError, match=rf"shafts\.input\.bearings = free to move {way}"):
        _ = settled(shaft).compliance


def test_positions_beyond_the_shaft_are_refused():
    with pytest.raises(Exception, match="0 to 100 mm"):
        Shaft(name="s", sections=(ShaftSection(length=100.0, diameter=30.0),), coupling=Coupling(position=101.0))
