"""Every pair of keys of a scene sweeps, and every point of a sweep is what ``simulate`` gives."""

from __future__ import annotations

from dataclasses import is_dataclass

import numpy as np
import pytest

from gearbench import simulate, sweep
from gearbench.errors import InputError
from gearbench.keys import value_at
from gearbench.scene_file import EFFECT_TABLES, TABLES, parse_scene, scene_at
from gearbench.schema import keys
from tests.support.campaign import many
from tests.sweeps.test_sweep import assert_equal

#: The pair of the README.
PAIR = {
    "normal_module": 2.0, "helix_angle": 20.0, "face_width": 20.0, "centre_distance": 70.0,
    "pinion": {"teeth": 25, "bore_diameter": 25.0}, "wheel": {"teeth": 40, "bore_diameter": 40.0},
}  # fmt: skip
COMPLIANT = {"tooth_bending": {"model": "solid", "order": [3, 3, 4]}, "gear_body": {}, "hertz": {}}
RELIEVED = {
    "tip_relief": {"pinion": {"amount": 10.0, "length": 0.8}, "wheel": {"amount": 8.0, "start_roll_angle": 26.0}},
    "root_relief": {"amount": 4.0, "length": 0.5}, "crowning": {"amount": 4.0, "highest": 9.0},
    "end_relief": {"at_0": {"amount": 3.0, "length": 2.0}, "at_b": {"amount": 5.0, "length": 3.0}},
    "profile_slope": {"pinion": 2.0}, "profile_crowning": {"wheel": 3.0}, "flank_twist": {"pinion": 4.0},
    "profile_curve": {"pinion": {"polynomial": [0.0, 4.0]}}, "helix_slope": {"wheel": 5.0},
    "helix_curve": {"wheel": {"at": [0.0, 9.0, 20.0], "deviation": [2.0, 0.0, 3.0]}},
    "misalignment": {"inclination": 6.0},
    "waviness": {"pinion": [{"order": 1, "amplitude": 3.0}, {"order": 50, "amplitude": 0.5}]},
    "pitch_errors": {"pinion": [0.0, 2.0, -1.0] + 22 * [0.5]},
    "random_pitch": {"wheel": {"single_pitch": 6.0, "cumulative_pitch": 20.0}},
}  # fmt: skip
TIP = {"tip_relief": {"amount": 10.0, "length": 0.8}}
ERRORS = {
    "manufacturing_errors": {
        "iso_class": 6, "run_out": {"amplitude": 9.0}, "profile_slope": {},
        "varied": [{"key": "tip_relief.amount", "amplitude": 2.0}],
    }
}  # fmt: skip
COARSE = {"segments": 8, "gauss_points": 3}
SPUR = {**PAIR, "helix_angle": 0.0, "centre_distance": 65.2}
SCENES = {
    "helical": {"pair": PAIR, "effects": COMPLIANT | RELIEVED},
    "off the line": {"pair": PAIR, "effects": COMPLIANT | RELIEVED | {"off_line_contact": {}}},
    "tip relief alone": {"pair": PAIR, "effects": COMPLIANT | TIP},
    "spur off the line": {"pair": SPUR, "effects": COMPLIANT | TIP | {"off_line_contact": {}}},
    "errors": {"pair": PAIR, "effects": COMPLIANT | TIP | ERRORS},
}


def scene(name: str):
    tables = SCENES[name]
    return parse_scene({"load": {"torque": 100.0}, "resolution": COARSE, "operation": {"speed": 1500.0}, **tables})


def numeric_keys(table, path: str = "") -> list[str]:
    """Dotted keys of all numbers that a scene gives."""
    found = []
    if isinstance(table, tuple):
        for i, item in enumerate(table):
            here = f"{path}.{getattr(item, 'name', i)}"
            found += [here] if type(item) in (int, float) else numeric_keys(item, here)
    elif is_dataclass(table):
        for name in keys(type(table)):
            if path or name in (*TABLES, *EFFECT_TABLES):
                value, here = getattr(table, name), f"{path}.{name}".strip(".")
                found += [here] if type(value) in (int, float) else numeric_keys(value, here)
    return found


def near(value: float, rng: np.random.Generator) -> list[float]:
    """Two values close to one that a scene has; the first may be 0."""
    if isinstance(value, int):
        return [value, value + 1]
    if value == 0:
        return [0.0, 1.0]
    return [0.0 if rng.random() < 0.25 else value, value * float(rng.uniform(0.95, 1.05))]


def swept_pair(name: str, rng: np.random.Generator):
    """Two keys of a scene and two allowed values of each; None where not all points make a scene."""
    base = scene(name)
    chosen = rng.choice(numeric_keys(base), 2, replace=False).tolist()
    ranges = {key: near(value_at(base, key), rng) for key in chosen}
    try:
        for x in ranges[chosen[0]]:
            for y in ranges[chosen[1]]:
                scene_at(base, {chosen[0]: x, chosen[1]: y})
    except InputError:
        return None
    return base, ranges


def check_draw(seed: int) -> None:
    rng = np.random.default_rng(seed)
    drawn = None
    while drawn is None:
        drawn = swept_pair(rng.choice(list(SCENES)), rng)
    base, ranges = drawn
    found = sweep(base, ranges)
    for name in ("transmission_error_rms", "mesh_stiffness_mean", "transmission_error_amplitude"):
        assert np.isfinite(found[name]).all(), (name, ranges)
    at = {key: values[rng.integers(2)] for key, values in ranges.items()}
    alone = simulate(scene_at(base, at))
    point = found.sel(at)
    point = point.isel(segment=slice(alone.sizes["segment"]))
    assert_equal(point.isel(pair=np.flatnonzero(point["pair_index"].isin(alone["pair_index"]))), alone)


@pytest.mark.parametrize("seed", range(2))
def test_pairs_of_keys_drawn_at_random(seed):
    check_draw(seed)


@pytest.mark.slow
def test_many_pairs_of_keys():
    for seed in range(4, 4 + many(40)):
        check_draw(seed)
