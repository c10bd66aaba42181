"""Random pitch errors: within their tolerances, the same in all commands, and sidebands of the order of the gear."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import hunting_cycle, robust, simulate
from gearbench.effects.random_pitch import DrawnPitch
from gearbench.errors import InputError
from gearbench.geometry.pair import Member, Pair
from gearbench.scene_file import parse_scene
from gearbench.tolerances import gear_tolerances
from tests.test_planetary import tables

PAIR = Pair(normal_module=2.0, face_width=20.0, centre_distance=50.0, pinion=Member(teeth=20), wheel=Member(teeth=30))


def made(**effects):
    pair = {"normal_module": 2.0, "face_width": 20.0, "centre_distance": 50.0}
    pair |= {"pinion": {"teeth": 20}, "wheel": {"teeth": 30}}
    effects = {"tooth_bending": {}, "hertz": {}, **effects}
    return parse_scene({"pair": pair, "load": {"torque": 50.0}, "effects": effects, "resolution": {"positions": 8}})


def test_pitches_and_their_sums_stay_within_the_class_and_use_it():
    gear, pitch, ranges, steps = PAIR.gears[1], [], [], []
    f_pt, F_p = (getattr(gear_tolerances(gear, 6), f"{name}_pitch") for name in ("single", "cumulative"))
    for seed in range(300):
        deviation = np.array(DrawnPitch(iso_class=6, seed=seed).deviations(gear))
        single = deviation - np.roll(deviation, 1)
        pitch.append(np.abs(single).max())
        ranges.append(np.ptp(deviation))
        alone = np.array(DrawnPitch(single_pitch=f_pt, seed=seed).deviations(gear))
        steps.append(np.concatenate([alone, [np.abs(alone - np.roll(alone, 1)).max()]]))
    assert f_pt * 0.9 < max(pitch) <= f_pt * (1 + 1e-12)
    assert F_p * 0.9 < max(ranges) <= F_p * (1 + 1e-12)
    assert np.std(np.array(steps)[:, :-1]) == pytest.approx(f_pt / 6, rel=0.03)  # 3 σ = f_pt/2, cut
    assert np.array(steps)[:, -1].max() <= f_pt


def test_a_seed_is_a_gear_and_other_seeds_are_others():
    one, again, other = (made(random_pitch={"pinion": {"iso_class": 7, "seed": seed}}) for seed in (4, 4, 5))
    own, same, different = (simulate(each)["transmission_error"].values for each in (one, again, other))
    assert_allclose(same, own, rtol=0, atol=0)
    assert np.abs(different - own).max() > 0.1
    # as the same list of deviations
    given = one.effect("random_pitch").pinion.deviations(one.pair.gears[0])
    assert_allclose(simulate(made(pitch_errors={"pinion": list(given)}))["transmission_error"], own, rtol=1e-12)


def test_side_bands_are_orders_of_the_gear_and_its_eccentricity_is_the_largest():
    found = hunting_cycle(made(random_pitch={"pinion": {"iso_class": 6, "seed": 1}}))
    order, amplitude = found["pinion_order"].values, found["transmission_error_order_amplitude"].values
    own = np.isclose(order, np.round(order))
    assert amplitude[~own].max() < 1e-9
    assert order[amplitude.argmax()] == pytest.approx(1.0)
    assert amplitude[np.isin(np.round(order), [19, 21]) & own].min() > 1e-3


def test_a_sample_is_the_simulation_of_teeth_with_its_errors():
    errors = {"iso_class": 6, "single_pitch": {}}
    found = robust(made(manufacturing_errors=errors), samples=8, seed=2)
    f_pt = gear_tolerances(PAIR.gears[0], 6).single_pitch
    drawn = found["error"].values
    assert np.abs(drawn).max() <= max(f_pt, gear_tolerances(PAIR.gears[1], 6).single_pitch) / 2
    for sample in range(3):
        lists = {"pinion": [0.0] * 20, "wheel": [0.0] * 30}
        for name, value in zip(found["error_name"].values.tolist(), drawn[sample], strict=True):
            gear, _, pair = name.removeprefix("single_pitch_").partition("_tooth")
            lists[gear][-int(pair)] = float(value)  # pair k is that of the teeth k before the first ones
        alone = simulate(made(pitch_errors=lists))
        for name in ("transmission_error_rms", "transmission_error_mean"):
            assert_allclose(found[name][sample], alone[name], rtol=1e-4)


def test_sets_draw_them_for_every_mesh_and_planets_are_different_gears():
    more = {"hertz": {}, "manufacturing_errors": {"iso_class": 6, "single_pitch": {}}}
    found = robust(parse_scene(tables(planets=3, effects=more, phases=2)), samples=4)
    assert "single_pitch planet 2, driving flank, tooth+0 of planet 2 to ring" in found["error_name"].values
    assert float(found["mesh_load_factor"].max()) > 1.01
    given = tables(planets=3, phases=2)
    given["planetary"]["planet"]["random_pitch"] = {"iso_class": 6, "seed": 7}
    own = [mesh.effect("random_pitch").wheel for mesh in list(parse_scene(given).meshes.values())[:3]]
    assert [each.seed for each in own] == [7, 8, 9]


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({}, "effects.random_pitch.pinion"),
        ({"pinion": {}}, "effects.random_pitch.pinion.single_pitch"),
        ({"pinion": {"iso_class": 6, "seed": -1}}, "effects.random_pitch.pinion.seed"),
        ({"pinion": {"iso_class": 6}, "pinion_tooth": 20}, "effects.random_pitch.pinion_tooth"),
    ],
)
def test_faults(table, key):
    with pytest.raises(InputError) as caught:
        made(random_pitch=table)
    assert caught.value.key == key
