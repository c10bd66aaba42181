"""Natural frequencies of planetary sets against Lin and Parker 1999, and Cooley and Parker 2012."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.dynamics.modes import modes
from gearbench.dynamics.train_model import kinds, rigid_bodies, train_mechanics
from gearbench.scene_file import parse_scene

#: Of each number of planets: rotational modes, translational modes, planet modes [Hz]. Three values of the row of four
#: planets are printed otherwise, 1536.6, 727.0 and 1091.0: two computations of the model have those below.
LIN_PARKER = {
    3: ((0, 1475.7, 1930.3, 2658.3, 7462.8, 11775.3), (743.2, 1102.4, 1896.0, 2276.4, 6986.3, 9647.9), ()),
    4: (
        (0, 1536.5, 1970.6, 2625.7, 7773.6, 13071.1),
        (727.3, 1091.2, 1892.8, 2342.5, 7189.9, 10437.6),
        (1808.2, 5963.8, 6981.7),
    ),
    5: (
        (0, 1567.4, 2006.1, 2614.8, 8065.4, 14253.1),
        (710.0, 1072.0, 1888.1, 2425.3, 7382.4, 11172.3),
        (1808.2, 5963.8, 6981.7),
    ),
}


def modes_of(members, *, planets, pin, alpha, mesh, positions=None):
    """Frequencies [Hz] by kind, of m [kg], I/r² [kg], and stiffness across and against turning [N/m] of each member.

    Frequencies do not depend on the sizes of the gears, only on the pressure angle.
    """
    gears = {"sun": {"teeth": 30}, "planet": {"teeth": 30}, "ring": {"teeth": -90}}
    radius = {"carrier": 60e-3} | {name: gear["teeth"] * math.cos(alpha) * 1e-3 for name, gear in gears.items()}
    own = {}
    for name, (mass, inertia, _, torsion) in members.items():
        square = radius[name] ** 2
        own[name] = {"mass": mass, "inertia": inertia * square}
        own[name] |= {"torsional_stiffness": torsion * square} if torsion else {}
    keys = {"normal_module": 2.0, "face_width": 20.0, "centre_distance": 60.0, "pressure_angle": math.degrees(alpha)}
    keys |= {f"{name}_support": 1e-6 * members[name][2] for name in ("sun", "ring", "carrier")}
    keys |= {"planets": planets, "pin_stiffness": 1e-6 * pin, "held": "ring", "dynamics": own}
    keys |= {} if positions is None else {"positions": positions}
    scene = parse_scene({"planetary": {**keys, **gears}, "load": {"torque": 100.0}, "effects": {"hertz": {}}})
    linkage = scene.train.linkage(scene.geometry)
    bodies = rigid_bodies(scene.train, linkage)
    found = modes(train_mechanics(linkage, bodies), 1e-3 * mesh * np.eye(2 * planets), 0.0)
    kind = np.array(kinds(found.bearing, bodies, linkage.carried))
    return lambda name: found.frequency[kind == name] / (2 * math.pi)


def lin_parker(planets, positions=None):
    members = {
        "sun": (0.4, 0.39, 1e8, 0.0),
        "ring": (2.35, 3.0, 1e8, 1e9),
        "carrier": (5.43, 6.29, 1e8, 0.0),
        "planet": (0.66, 0.61, 0.0, 0.0),
    }
    alpha = math.radians(24.6)
    return modes_of(members, planets=planets, positions=positions, pin=1e8, alpha=alpha, mesh=5e8)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_lin_and_parker(planets):
    found = lin_parker(planets)
    rotational, translational, of_planets = LIN_PARKER[planets]
    # printed to 0.1 Hz
    assert_allclose(found("rotational"), rotational, atol=0.06)
    assert_allclose(found("translational"), np.repeat(translational, 2), atol=0.06)
    assert_allclose(found("planet"), np.repeat(of_planets, planets - 3), atol=0.06)
    assert found("mixed").size == 0


def test_uneven_planets_mix():
    assert lin_parker(4, [0.0, 81.0, 192.0, 270.0])("mixed").size > 0


def test_cooley_and_parker():
    members = {
        "sun": (3.0, 1.75, 20e6, 20e6),
        "ring": (7.64, 8.09, 100e6, 100e6),
        "carrier": (12.0, 6.80, 50e6, 100e6),
        "planet": (1.86, 1.25, 0.0, 0.0),
    }
    found = modes_of(members, planets=4, pin=10e6, alpha=math.radians(20.0), mesh=1e8)
    unit = math.sqrt(10e6 / 1.86) / (2 * math.pi)
    assert_allclose(found("rotational") / unit, [0.9077, 1.046, 1.317, 2.013, 5.809, 8.383], rtol=6e-4)
    assert_allclose(found("translational") / unit, np.repeat([0.7199, 1.001, 1.317, 1.481, 5.153, 6.488], 2), rtol=6e-4)
    assert_allclose(found("planet") / unit, [0.9617, 4.320, 5.672], rtol=6e-4)
