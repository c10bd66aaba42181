"""Trains of gears: speeds against closed forms, mesh phases against the teeth themselves, torques against statics."""

import math
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.errors import InputError
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.train import Mesh, Train


def pair(z1, z2, *, beta=0.0, x1=None, offset=0.0):
    distance = (z1 + z2) / math.cos(math.radians(beta)) + 0.4
    pinion = Member(teeth=z1, profile_shift=x1)
    wheel = Member(teeth=z2, face_width=20.0 - 2 * abs(offset), axial_offset=offset)
    return Pair(
        normal_module=2.0, helix_angle=beta, face_width=20.0, centre_distance=distance, pinion=pinion, wheel=wheel
    )


def chain(beta=0.0, angles=(0.0, 0.0), *, clockwise=True, offset=0.0):
    """Motor, idler and load: the idler is driven by one and drives the other."""
    first = pair(19, 31, beta=beta)
    second = pair(31, 26, beta=beta, x1=first.profile_shifts[1], offset=offset)
    meshes = (
        Mesh(name="in", driver="motor", driven="idler", pair=first, direction=angles[0]),
        Mesh(name="out", driver="idler", driven="load", pair=second, direction=angles[1]),
    )
    return Train(meshes=meshes, clockwise=clockwise)


def touching(train, name, gear, phase):
    """Angle [pitches] of a tooth of ``gear`` whose flank passes the point where its mesh touches at a phase.

    Amid the whole face of the gear.

    From the point in the plane and the thickness of the tooth at its radius alone, clockwise angles.
    """
    mesh = train[name]
    meshing, turn = mesh.pair.meshing, train.turn(name)
    x = train.across(name)
    y = turn * np.array([-x[1], x[0]])
    alpha, r_b = meshing.alpha_wt, meshing.gears[0].base_radius
    own, sense = mesh.gears.index(gear), turn if gear == mesh.driver else -turn
    middle = meshing.gears[own].face_width / 2 - mesh.pair.overhangs[own][0]
    u = meshing.path_start + phase * meshing.base_pitch + middle * math.tan(meshing.beta_b)
    point = r_b * (math.cos(alpha) * x - math.sin(alpha) * y) + u * (math.sin(alpha) * x + math.cos(alpha) * y)
    if own == 1:
        point = point - meshing.centre_distance * x
    body = meshing.gears[own]
    psi = float(body.involute_half_angle(np.hypot(*point)))
    # the driver's leading flank touches, the driven gear's trailing one
    tooth = math.atan2(point[1], point[0]) + (-sense * psi if own == 0 else sense * psi)
    return body.teeth * tooth / (2 * math.pi)


def whole(number):
    """How far a number is from a whole one."""
    return abs((number + 0.5) % 1.0 - 0.5)


@pytest.mark.parametrize("clockwise", [True, False])
@pytest.mark.parametrize(("beta", "offset"), [(0.0, 0.0), (17.0, 0.0), (17.0, 3.0)])
def test_phase_of_an_idler_is_that_of_its_teeth(beta, offset, clockwise):
    # with an offset the last gear is narrower than the idler: lines of the second mesh begin farther along the face
    rng = np.random.default_rng(3)
    for angles in rng.uniform(-180, 180, (10, 2)):
        train = chain(beta, angles, clockwise=clockwise, offset=offset)
        phase = train.phases()["out"]
        # the same tooth, to whole pitches, carries at both meshes; 1e-9: radii of contact within rounding
        assert whole(touching(train, "in", "idler", 0.0) - touching(train, "out", "idler", phase)) < 1e-9


def test_phases_of_the_coast_flanks_are_those_in_a_mirror():
    train = chain(17.0, (10.0, 70.0), offset=3.0)
    mirrored = chain(17.0, (-10.0, -70.0), offset=-3.0)
    assert_allclose(train.phases(coast=True)["out"], mirrored.phases()["out"], rtol=1e-12)


@pytest.mark.parametrize(("beta", "clockwise"), [(0.0, True), (15.0, True), (15.0, False)])
def test_phases_of_a_planetary_set_are_those_of_its_teeth(beta, clockwise):
    # z 21/39/−99, planets at 0, 42 and 84 of 120 places (Guo and Keller's 750 kW set): γ_s = 0, 0.35, 0.70
    angles = 2 * np.pi * np.array([0, 42, 84]) / 120
    first = pair(21, 39, beta=beta)
    a = first.centre_distance
    planet, ring = Member(teeth=39, profile_shift=first.profile_shifts[1]), Member(teeth=-99)
    second = Pair(normal_module=2.0, helix_angle=beta, face_width=20.0, centre_distance=-a, pinion=planet, wheel=ring)
    meshes = [Mesh(name=f"s{n}", driver="sun", driven=f"p{n}", pair=first, carrier="c") for n in range(3)]
    meshes += [Mesh(name=f"r{n}", driver=f"p{n}", driven="ring", pair=second, carrier="c") for n in range(3)]
    axes = {"sun": (0.0, 0.0), "ring": (0.0, 0.0)}
    axes |= {f"p{n}": (a * math.cos(x), a * math.sin(x)) for n, x in enumerate(angles)}
    train = Train(meshes=tuple(meshes), axes=axes, held=("ring",), clockwise=clockwise)
    phases = train.phases()
    train.check_assembly()
    for n in range(3):
        assert (
            whole(
                touching(train, f"s{n}", f"p{n}", phases[f"s{n}"]) - touching(train, f"r{n}", f"p{n}", phases[f"r{n}"])
            )
            < 1e-9
        )
        assert whole(touching(train, "s0", "sun", 0.0) - touching(train, f"s{n}", "sun", phases[f"s{n}"])) < 1e-9
        first_ring = touching(train, "r0", "ring", phases["r0"])
        assert whole(first_ring - touching(train, f"r{n}", "ring", phases[f"r{n}"])) < 1e-9
    # the trap: of a set seen so that it turns clockwise the phases of both meshes move by −z_s ψ together
    sense = -1 if clockwise else 1
    for side in "sr":
        moved = [(phases[f"{side}{n}"] - phases[f"{side}0"]) for n in range(3)]
        assert_allclose([whole(x - sense * y) for x, y in zip(moved, (0, 0.35, 0.70), strict=True)], 0.0, atol=1e-9)
    assert train.rates["c"] == Fraction(21, 120)
    assert train.mesh_rate("s0") == train.mesh_rate("r2") == pytest.approx(21 * 99 / 120, rel=1e-15)


@pytest.mark.parametrize("shared", ["driver", "driven"])
def test_phase_of_a_gear_that_drives_two_or_is_driven_by_two(shared):
    one, two = pair(19, 31), pair(19, 31)
    if shared == "driver":
        two = pair(19, 26, x1=one.profile_shifts[0])
        names = ("sun", "a"), ("sun", "b")
    else:
        names = ("a", "wheel"), ("b", "wheel")
    meshes = tuple(
        Mesh(name=f"mesh {n}", driver=pq[0], driven=pq[1], pair=p, direction=angle)
        for n, (pq, p, angle) in enumerate(zip(names, (one, two), (20.0, 131.0), strict=True))
    )
    train = Train(meshes=meshes)
    gear = "sun" if shared == "driver" else "wheel"
    phase = train.phases()["mesh 1"]
    assert whole(touching(train, "mesh 0", gear, 0.0) - touching(train, "mesh 1", gear, phase)) < 1e-9
    assert train.coast == {"mesh 0": False, "mesh 1": False}


def test_speeds_of_a_chain_are_exact():
    rates = chain().rates
    assert rates == {"motor": 1, "idler": Fraction(-19, 31), "load": Fraction(19, 26)}
    assert chain().mesh_rate("out") == 19.0
    assert [chain().turn(name) for name in ("in", "out")] == [1, -1]


def test_speeds_with_a_carrier_are_those_of_willis():
    # two external gears, one circling the other: n_2 = (1 + z_1/z_2) n_c − z_1/z_2 n_1
    mesh = Mesh(driver="sun", driven="planet", pair=pair(20, 30), carrier="arm")
    with pytest.raises(InputError, match="is not determined"):
        _ = Train(meshes=(mesh,)).rates
    still = Train(meshes=(mesh,), held=("arm",))
    assert still.rates == {"sun": 1, "planet": Fraction(-2, 3), "arm": 0}
    fixed = Train(meshes=(mesh,), held=("planet",))
    assert fixed.rates["arm"] == Fraction(2, 5)  # (1 + 2/3) n_c = 2/3


def test_gears_of_one_shaft_turn_together_or_contradict():
    first, second = pair(20, 40), pair(15, 45)
    meshes = (
        Mesh(name="a", driver="1", driven="2", pair=first),
        Mesh(name="b", driver="3", driven="4", pair=second),
    )
    train = Train(meshes=meshes, shafts={"2": "middle", "3": "middle"})
    assert train.rates["4"] == Fraction(1, 6)
    assert_allclose(train.torques()["b"], 2.0)
    assert train.phases()["b"] == 0.0
    assert train.coast["b"] is False
    with pytest.raises(InputError, match="contradict"):
        _ = Train(meshes=meshes, shafts={"1": "s", "3": "s", "2": "t", "4": "t"}).rates
    with pytest.raises(InputError, match="carries both"):
        Train(meshes=meshes, shafts={"1": "s", "2": "s"})


def test_parallel_paths_are_refused_unless_a_torque_is_wished():
    first, second = pair(20, 40), pair(20, 40)
    meshes = (
        Mesh(name="a", driver="in", driven="one", pair=first),
        Mesh(name="b", driver="in", driven="two", pair=second, direction=90.0),
    )
    with pytest.raises(InputError, match="parallel"):
        Train(meshes=meshes).torques()
    assert Train(meshes=meshes).torques(preferred={"b": 0.7})["b"] == 0.7


def test_axes_of_a_ring_of_gears_must_close():
    one, two, three = pair(20, 20), pair(20, 20), pair(20, 20)
    a = one.centre_distance
    meshes = (
        Mesh(name="a", driver="1", driven="2", pair=one),
        Mesh(name="b", driver="2", driven="3", pair=two, direction=120.0),
        Mesh(name="c", driver="1", driven="3", pair=three),
    )
    places = Train(meshes=meshes).places
    assert_allclose(places["3"], [a / 2, a * math.sqrt(3) / 2])
    with pytest.raises(InputError, match="from the axis of its mate"):
        _ = Train(meshes=meshes, axes={"3": (3.0, 4.0)}).places
