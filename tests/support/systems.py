"""Systems for tests: oscillators without gears, and pairs on shafts."""

import math

import numpy as np
import tomli_w

from gearbench.dynamics.balance import Excitation
from gearbench.scene_file import parse_scene, read_scene
from gearbench.system.mechanics import Mechanics

#: Stiffness of a support that does not yield [N/µm].
RIGID = 1e9


def wheels(mass, meshes=1):
    """Two rigid wheels of twice the ``mass``; their relative motion is that of one body with ``mass``."""
    return Mechanics(
        mass=np.diag([2 * mass, 2 * mass]),
        stiffness=np.zeros((2, 2)),
        damping=(np.zeros((0, 2)), np.zeros(0)),
        mesh=np.tile([-1.0, 1.0], (meshes, 1)),
        rotation=np.tile([-1.0, 1.0], (meshes, 1)),
        bearing=np.zeros((0, 3, 2)),
        bearing_names=(),
    )


def excitation(k_mean, k_orders, x_orders, force, harmonics):
    """Excitation by one mesh, from the first orders of its stiffness and motion."""
    k, x = np.zeros((1, 1, 2 * harmonics + 1), complex), np.zeros((1, harmonics + 1), complex)
    k[..., 0], k[0, 0, 1 : len(k_orders) + 1] = k_mean, k_orders
    x[0, : len(x_orders)] = x_orders
    return Excitation(stiffness=k, motion=x, force=np.eye(1, harmonics + 1) * force)


def series(orders, omega, t):
    """Values Σ ŷ_n e^{inωt} at times t, from the orders 0 … H."""
    n = np.arange(1, len(orders))
    return orders[0].real + 2 * (np.exp(1j * omega * np.multiply.outer(t, n)) @ orders[1:]).real


def spur_scene(system=None, *, helix=0.0, width=40.0, torque=300.0, effects=None, **resolution):
    """Pair with z = 25/40 and m = 3 on a linear contact law, so that only shafts cause variation over the face."""
    tables = {
        "pair": {
            "normal_module": 3.0,
            "helix_angle": helix,
            "face_width": width,
            "centre_distance": 3 * 65 / 2 / math.cos(math.radians(helix)),
            "pinion": {"teeth": 25},
            "wheel": {"teeth": 40},
        },
        "load": {"torque": torque},
        "effects": effects or {"hertz": {"law": "yang_sun"}},
        "resolution": resolution or {"segments": 40, "gauss_points": 4},
    }
    return parse_scene(tables if system is None else tables | {"system": system})


def shafts(pinion=None, wheel=None, **system):
    """Pinion between two bearings, wheel on a rigid shaft; ``pinion`` and ``wheel`` change keys of the two shafts."""
    support = {"radial_stiffness": RIGID, "axial_stiffness": RIGID}
    first = {
        "name": "input",
        "sections": [{"length": 200.0, "diameter": 40.0}],
        "gears": [{"gear": "pinion", "position": 70.0}],
        "bearings": [{"position": 0.0, **support}, {"position": 200.0, **support}],
        "coupling": {"position": 0.0},
    }
    second = {
        "name": "output",
        "sections": [{"length": 100.0, "diameter": 4000.0}],
        "gears": [{"gear": "wheel", "position": 50.0}],
        "bearings": [{"position": 0.0, **support}, {"position": 100.0, **support}],
        "coupling": {"position": 0.0},
    }
    return {"shafts": [first | (pinion or {}), second | (wheel or {})], **system}


def two_stages(folder, first, second, diameter=50.0):
    """Scene of two pairs behind one another, on three shafts of one ``diameter``; its files are in ``folder``."""
    places = {"radial_stiffness": 300.0, "axial_stiffness": 150.0}
    ends = [{"position": position, **places} for position in (0.0, 160.0)]
    shafts = [
        {"name": "in", "gears": [{"gear": "pinion", "position": 40.0}], "coupling": {"position": 0.0, "inertia": 0.01}},
        {
            "name": "between",
            "gears": [{"gear": "wheel", "position": 40.0}, {"mesh": "second", "gear": "pinion", "position": 110.0}],
        },
        {
            "name": "out",
            "gears": [{"mesh": "second", "gear": "wheel", "position": 110.0}],
            "coupling": {"position": 160.0, "inertia": 0.2},
        },
    ]
    beam = {"sections": [{"length": 160.0, "diameter": diameter}], "bearings": ends}
    system = {
        "damping_ratio": 0.04,
        "meshes": [{"name": "second", "scene": "second.toml"}],
        "shafts": [beam | shaft for shaft in shafts],
    }
    (folder / "second.toml").write_text(second.to_toml())
    path = folder / "gearbox.toml"
    path.write_text(tomli_w.dumps(first.to_mapping() | {"system": system}))
    return read_scene(path)
