"""Searches over planetary sets: a set is a scene whose evaluation gives other numbers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import robust, simulate
from gearbench.errors import InputError
from gearbench.explore.stored import open_results
from gearbench.geometry.pair import Pair
from gearbench.optimisation.constraints import constrained, number
from gearbench.optimisation.derived import DERIVED
from gearbench.optimisation.numbers import OF_SET, gear_ratio, largest_root_stress, mass
from gearbench.optimisation.problem import evaluate, scene_of
from gearbench.optimisation.run import optimise
from gearbench.optimisation.select import Resonance, open_designs, select
from gearbench.optimisation.study import Limit
from gearbench.optimisation.study_file import parse_study
from gearbench.optimisation.verify import reference_study
from gearbench.scene_file import parse_scene
from gearbench.strength.bending import RootBending
from gearbench.strength.rating import GEOMETRIC
from gearbench.trains.solve import solve_train

BASE = {
    "planetary": {
        "normal_module": 2.0,
        "face_width": 20.0,
        "sun": {"bore_diameter": 20.0},
        "planet": {"teeth": 30, "bore_diameter": 15.0},
        "ring": {"outer_diameter": 230.0},
        "scatter": {"pin_tangential": 10.0},
    },
    "load": {"torque": 200.0},
    "effects": {"hertz": {"law": "yang_sun"}},
    "resolution": {"positions": 8},
}
STUDY = {
    "objectives": ["mesh_load_factor_max", "sun_force_rms_mean", "mass"],
    "base": BASE,
    "variables": {
        "planetary": {
            "sun": {"teeth": {"min": 34, "max": 38}},
            "planets": {"min": 3, "max": 4},
            "ring": {"extra_teeth": {"min": -1, "max": 1}},
        }
    },
    "constraints": {"spacing_error": {"max": 1e-9}, "transverse_contact_ratio": {"min": 1.3}},
    "algorithm": {"population": 8, "generations": 2},
    "robustness": {"samples": 16},
}


def scene(teeth=(36, 30, None), **keys):
    sun, planet, ring = teeth
    gears = {"sun": {"teeth": sun}, "planet": {"teeth": planet}, "ring": {} if ring is None else {"teeth": ring}}
    own = {name: {**BASE["planetary"][name], **gear} for name, gear in gears.items()}
    return parse_scene({**BASE, "planetary": {**BASE["planetary"], **own, **keys}})


def test_ring_and_centre_distance_follow_from_the_teeth_of_sun_and_planet():
    pairs = [mesh.pair for mesh in scene().meshes.values()]
    assert pairs[-1].gears[1].teeth == -96
    assert pairs[0].centre_distance == 2.0 * (36 + 30) / 2
    assert_allclose([x for pair in pairs for x in pair.profile_shifts], 0.0, atol=1e-12)
    # a tooth more: half of its radius goes to either mesh, 0.25 m_n
    first, *_, last = (mesh.pair for mesh in scene((36, 30, -97), helix_angle=20.0).meshes.values())
    standard = 2.0 / np.cos(np.radians(20.0)) * np.array([36 + 30, 97 - 30]) / 2
    assert_allclose([first.centre_distance, -last.centre_distance], standard.mean(), rtol=1e-14)
    assert first.profile_shifts[0] + first.profile_shifts[1] > 0


@pytest.mark.parametrize(
    ("planets", "sun", "ring", "torsion", "radial"),
    # BENCHMARKS N: in phase, sequential, counter phase (twice)
    [(4, 16, 48, 1, 0), (4, 17, 51, 0, 1), (4, 18, 54, 0, 0), (5, 18, 52, 0, 0)],
)
def test_what_adds_up_is_that_of_the_published_sets(planets, sun, ring, torsion, radial):
    whole = scene((sun, (ring - sun) // 2, -ring), planets=planets)
    found = {name: of(whole) for name, of in OF_SET.items()}
    assert_allclose([found["torsion_share"], found["radial_share"]], [torsion, radial], atol=1e-12)
    assert found["spacing_error"] == pytest.approx(0.0, abs=1e-12)


def test_uneven_planets_stand_where_they_are_published():
    whole = scene((18, 25, -68), planets=4)
    assert OF_SET["spacing_error"](whole) == pytest.approx(90 - 87.907, abs=5e-4)  # 0, 87.907, 180, 267.907°
    a, tip = 2.0 * 86 / 4, whole.pair.gears[1].tip_radius
    assert OF_SET["planet_room"](whole) == pytest.approx(2 * a * np.sin(np.radians(87.907) / 2) - 2 * tip, abs=1e-4)


def test_ratio_mass_and_stress_are_those_of_all_members():
    three, four = scene(planets=3), scene(planets=4)
    assert gear_ratio(three) == pytest.approx(1 + 96 / 36)
    assert gear_ratio(scene(held="carrier")) == pytest.approx(96 / 36)
    assert gear_ratio(scene(held="sun")) == pytest.approx(1 + 36 / 96)
    first, *_, last = three.meshes.values()
    planet = mass(four) - mass(three)
    assert mass(three) == pytest.approx(mass(first) + mass(last) + planet, rel=1e-12)
    assert planet == pytest.approx(7.85e-6 * 20.0 * np.pi * (30.0**2 - 7.5**2), rel=0.02)  # its pitch cylinder
    stress = [RootBending(pair=m.pair, gear=i).stress(m.load.torque) for m, i in ((first, 0), (first, 1), (last, 0))]
    assert largest_root_stress(three) == max(stress)


def test_limits_hold_for_every_mesh():
    whole = scene()
    ratios = [GEOMETRIC["transverse_contact_ratio"](mesh.pair) for mesh in whole.meshes.values()]
    for limit, worst in ((Limit(min=1.9), min(ratios)), (Limit(max=1.6), max(ratios))):
        assert constrained(whole, {"transverse_contact_ratio": limit})["transverse_contact_ratio"] == worst
    solved = solve_train(whole)
    assert number("contact_pressure", whole, lambda: solved) == max(
        number("contact_pressure", mesh.scene, lambda mesh=mesh: mesh) for mesh in solved.meshes.values()
    )


def test_a_design_has_the_numbers_of_robust_and_without_samples_of_simulate():
    study = parse_study({**STUDY, "constraints": {"train_transmission_error_mean": {"max": 1e3}}})
    design = (2, 1, 1)  # 36 teeth, four planets, no extra tooth
    found = dict(zip(study.statistics, evaluate(study, design).statistics, strict=True))
    whole = scene_of(study, design)
    samples = robust(whole, samples=16, responses=["sun_force_rms"])
    for name in ("mesh_load_factor", "sun_force_rms"):
        for statistic in ("mean", "std", "max"):
            assert found[f"{name}_{statistic}"] == pytest.approx(float(samples[f"{name}_{statistic}"]), rel=1e-12)
    assert found["mass"] == mass(whole)
    without = parse_study({**STUDY, "objectives": ["sun_force_amplitude_1_mean"], "robustness": {"samples": 0}})
    sequential = (1, 0, 0)  # 35 and 94 teeth, three planets
    *_, last = scene_of(without, sequential).meshes.values()
    assert last.pair.gears[1].teeth == -94
    dataset = simulate(scene_of(without, sequential), outputs=["sun_force_amplitude_1"])
    (force,) = evaluate(without, sequential).objectives(without)
    assert force == float(dataset["sun_force_amplitude_1"]) > 1.0


def test_a_search_is_stored_selected_from_and_exported(tmp_path):
    study = parse_study(STUDY)
    dataset = optimise(study, directory=tmp_path, threads=1)
    feasible = dataset["feasible"].values == 1
    teeth, planets, extra = (
        dataset[f"planetary.{name}"].values for name in ("sun.teeth", "planets", "ring.extra_teeth")
    )
    # the assembly condition, by hand
    fits = (2 * (teeth + 30) + extra) % planets == 0
    assert feasible.any()
    assert not feasible[~fits].any()
    designs = open_designs(tmp_path)
    chosen = select(designs, where=[], rank={"sun_force_rms_mean": 1.0})
    best = chosen.scene(int(chosen.numbers[0]))
    assert solve_train(parse_scene(best.to_mapping())).scene.pair == best.pair
    assert {"gear_ratio", "planet_room"} < set(designs.names)
    assert "pinion_teeth" not in designs.names
    with pytest.raises(InputError, match=r"avoid = .*is for pairs"):
        select(designs, where=[], avoid=[Resonance(frequency=(900, 1100), speed=(500, 6000))])
    with pytest.raises(InputError, match="designs of planetary sets cannot be verified"):
        reference_study(study, 0.01)
    with pytest.raises(InputError, match="holds planetary sets: the page shows fronts of pairs"):
        open_results([tmp_path])


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"objectives": ["transmission_error_rms_mean"]}, "transmission_error_rms_mean: belongs to a pair"),
        ({"objectives": ["mesh_force_mean"]}, "objectives = mesh_force_mean: belongs to a pair"),
        ({"constraints": {"pinion_teeth": {"max": 20}}}, "constraints.pinion_teeth = pinion_teeth: belongs to a pair"),
        (
            {"variables": {"pair.helix_angle": {"min": 0.0, "max": 9.0}}},
            "pair.helix_angle: is not a key of base.planetary",
        ),
        ({"base": {**BASE, "planetary": {**BASE["planetary"], "sun": {"tooth": 3}}}}, "base.planetary.sun.tooth"),
        ({"base": {**BASE, "planetary": {**BASE["planetary"], "planet": {}}}}, "base.planetary.planet.teeth = missing"),
        ({"base": {**BASE, "planetary": {**BASE["planetary"], "planets": 0}}}, "base.planetary.planets = 0"),
        ({"base": {**BASE, "loads": [{"torque": 1.0}]}}, "base.load"),
    ],
)
def test_faults_of_a_study_are_named(changes, line):
    with pytest.raises(InputError) as caught:
        parse_study({**STUDY, **changes})
    assert line in str(caught.value)


def test_numbers_of_sets_are_refused_for_a_pair():
    pair = {"normal_module": 2.0, "face_width": 20.0, "centre_distance": 66.0, "pinion": {"teeth": 25}}
    own = {"objectives": ["mesh_load_factor_mean"], "base": {"pair": {**pair, "wheel": {"teeth": 41}}}}
    variables = {"pair.helix_angle": {"min": 0.0, "max": 9.0}}
    with pytest.raises(InputError, match="mesh_load_factor_mean: belongs to a planetary set, but the base is a pair"):
        parse_study({**own, "variables": variables})


def test_a_study_may_vary_the_second_gear_of_stepped_planets():
    base = {**BASE, "planetary": {**BASE["planetary"], "planet_at_ring": {"normal_module": 1.5}}}
    key = "planetary.planet_at_ring.teeth"
    study = parse_study({**STUDY, "base": base, "variables": {**STUDY["variables"], key: {"min": 20, "max": 24}}})
    assert key in [each.name for each in study.variables]
    with pytest.raises(InputError, match=f"base.{key} = missing: is required, here or as a variable"):
        parse_study({**STUDY, "base": base})


@pytest.mark.parametrize(
    ("second", "at_sun"),
    [({}, 66), ({"normal_module": 1.5}, 88), ({"helix_angle": 20.0}, 62)],  # 66 · 2/1.5; 66 cos 20° = 62.02
)
def test_the_ring_of_stepped_planets_has_the_centre_distance_of_the_sun(second, at_sun):
    own = {"planet_at_ring": {"teeth": 24} | second, "sun": {"teeth": 36}, "ring": {"teeth": -150}}
    _, derive = DERIVED["planetary.ring.extra_teeth"]
    teeth = derive({"planetary": {**BASE["planetary"], **own}}, Pair, 1)
    assert teeth == -(at_sun + 24 + 1)
