"""Sweeps: equal to single runs at every point, and what people may do wrong in asking for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import gearbench.contact.assemble
from gearbench import read_scene, robust, simulate, sweep
from gearbench.contact.loads import under_force
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem
from gearbench.errors import InputError
from gearbench.results.outputs import DEFAULT_OUTPUTS
from gearbench.results.points import Point, join_points
from gearbench.scene import Load, Resolution, Scene
from gearbench.scene_file import parse_scene
from gearbench.solution import dataset, solve_scene
from gearbench.sweeps import loads, run
from gearbench.sweeps.ranges import parse_range, parse_setting
from tests.support.paths import ROOT

AMOUNT = "effects.tip_relief.amount"
#: How the contact was solved, not what came out.
FLOORS = {
    f"{curve}_{of}_noise_floor"
    for curve in ("transmission_error", "mesh_stiffness")
    for of in ("amplitude", "peak_to_peak")
}
HOW = {"newton_steps", "equilibrium_residual", "complementarity_residual", "minimum_force"} | FLOORS


def example(name: str = "case2") -> Scene:
    return read_scene(ROOT / "examples" / f"{name}.toml")


def with_tables(scene: Scene, **effects: dict) -> Scene:
    tables = scene.to_mapping()
    return parse_scene({**tables, "effects": {**tables["effects"], **effects}})


def single_run(scene: Scene):
    """Dataset of ``simulate`` with the default outputs."""
    return dataset(solve_scene(scene), DEFAULT_OUTPUTS, 0.0)


def assert_equal(point, single):
    for name in set(single.data_vars) - HOW:
        found, wanted = point[name], single[name]
        if name.endswith("_phase"):  # a phase is as accurate as its harmonic, that of a negligible one arbitrary
            found, wanted = (x[name.replace("_phase", "_amplitude")] * np.exp(1j * x[name]) for x in (point, single))
        if "position" in found.dims:
            found = found.isel(position=slice(single.sizes["position"]))
        # rounding of the solver, relative to the largest value
        np.testing.assert_allclose(found.values, wanted.values, rtol=0, atol=1e-12 * abs(wanted.values).max())


RELIEVED = with_tables(example(), tip_relief={"amount": 20.0, "length": 0.6}, crowning={"amount": 8.0})


#: At phases that all loads share, as it gives them.
UNIFORM = replace(RELIEVED, resolution=Resolution(positions=24))


@pytest.mark.parametrize(
    "scene", [example("case1"), RELIEVED, UNIFORM], ids=["spur", "relieved helical", "the same at given phases"]
)
def test_torques_equal_single_runs(scene):
    torques = [0.02 * scene.load.torque, 0.3 * scene.load.torque, scene.load.torque, 3 * scene.load.torque]
    dataset = sweep(scene, torque=torques, threads=2)
    assert dataset.attrs["complete"] == 1
    assert dataset["line_load"].dims == ("torque", "position", "pair", "segment")
    for torque in torques:
        single = single_run(replace(scene, load=Load(torque=torque)))
        assert_equal(dataset.sel(torque=torque), single)


@pytest.mark.parametrize("off_line", [False, True], ids=["on the line", "off the line"])
def test_many_torques_of_wide_helical_pairs_on_their_bodies_equal_single_runs(off_line):
    """Every torque starts from the previous solutions on cells and patches, while flanks part and patches change."""
    scene = read_scene(ROOT / "examples" / "gears" / "large_wheel.toml")
    scene = scene if off_line else scene.without("off_line_contact")
    scene = replace(scene, resolution=Resolution(positions=24))
    torques = scene.load.torque * np.linspace(0.1, 1.6, 4 if off_line else 9)
    dataset = sweep(scene, torque=torques, threads=1)
    for torque in torques[::3]:
        point, single = dataset.sel(torque=torque), single_run(replace(scene, load=Load(torque=torque)))
        assert_equal(point, single[["transmission_error", "mesh_stiffness", "line_load"]])


@pytest.mark.parametrize(
    ("name", "effects", "amounts"), [("case2", {}, [0.0, 20.0]), ("case1", {"off_line_contact": {}}, [5.0, 10.0])]
)
def test_phases_may_follow_the_torque_at_some_points_of_another_key(name, effects, amounts):
    """Torques share their phases without relief, but have different phases with relief and off the line of action."""
    scene = with_tables(example(name), tip_relief={"amount": 10.0, "length": 0.6}, **effects)
    torques = [0.5 * scene.load.torque, scene.load.torque]
    loads = scene.to_mapping() | {"loads": [{"torque": torque} for torque in torques]}
    del loads["load"]
    for found in (sweep(scene, {AMOUNT: amounts}, torque=torques), sweep(parse_scene(loads), {AMOUNT: amounts})):
        for amount in amounts:
            at = with_tables(scene, tip_relief={"amount": amount, "length": 0.6})
            for torque in torques:
                alone = simulate(replace(at, load=Load(torque=torque)))
                assert_equal(found.sel({AMOUNT: amount}).sel(torque=torque), alone)


@pytest.mark.parametrize("largest", [loads.LARGEST, 1e5], ids=["at once", "a few at a time"])
def test_torques_with_phases_of_their_own_are_assembled_together(monkeypatch, largest):
    calls, finer = [], []

    def counting(phases):
        def counted(scene, lines, *effects):
            phases.append(lines.mesh_phase)
            return gearbench.contact.assemble.assemble(scene, lines, *effects)

        return counted

    monkeypatch.setattr(loads, "assemble", counting(calls))
    monkeypatch.setattr("gearbench.results.solved.assemble", counting(finer))  # for the noise floors
    monkeypatch.setattr(loads, "LARGEST", largest)
    scene, torques = RELIEVED, RELIEVED.load.torque * np.array([-1.0, -0.4, 0.1, 0.4, 0.7, 1.0])
    found = sweep(scene, torque=torques)
    assert len(calls) == len(finer) == (2 if largest > 1e6 else 6)  # drive flanks and coast flanks are others
    count = (found["phase_weight"] > 0).sum("position")
    assert count.min() < count.max()
    assert "phase_weight 0" in found.attrs["missing"]
    if largest > 1e6:  # phases that several torques have are assembled once
        assert len(calls[1]) < int(count[2:].sum())
    none = found["phase_weight"] == 0
    assert np.array_equal(found["transmission_error"].isnull(), none)
    assert np.array_equal(found["line_load"].isnull().all(("pair", "segment")), none)
    for torque in torques[[0, 2, 5]]:
        point, single = found.sel(torque=torque), simulate(replace(scene, load=Load(torque=torque)))
        assert_equal(point, single)
        for name in FLOORS:  # differences of solutions have fewer digits
            np.testing.assert_allclose(point[name], single[name], rtol=1e-4)


def test_without_a_contact_law_too():
    x = np.linspace(0, 1, 25)
    root = np.linalg.cholesky(np.exp(-(np.subtract.outer(x, x) ** 2) / 0.01) + 1e-2 * np.eye(25))
    none = np.zeros((1, 25))
    alone = np.zeros(25, dtype=np.int64)
    problem = ContactProblem(
        gap=(0.7 * x)[None], a=none, h=none, sigma=none, active=none == 0, factor=root[None], block=alone, blocks=1,
        force=1.0, length_scale=1.0, shape=(1, 1, 25),
    )  # fmt: skip
    for force in (0.5, 2.0):
        solution = solve_patches(under_force(problem, force))
        P = solution.force.ravel()
        gap = root @ root.T @ P + 0.7 * x - solution.approach
        assert P.sum() == pytest.approx(force, rel=1e-12)
        np.testing.assert_allclose(np.minimum(P, gap), 0.0, atol=1e-11)
        assert 0 < np.count_nonzero(P) < 25


def test_gaps_kinks_and_gears_equal_single_runs():
    amounts, lengths, teeth = [5.0, 25.0], [0.4, 0.6], [17, 18]
    keys = {"effects.tip_relief.amount": amounts, "effects.tip_relief.length": lengths, "pair.pinion.teeth": teeth}
    dataset = sweep(RELIEVED, keys, torque=[100.0, 230.0])
    assert dataset["transmission_error_rms"].dims == (*keys, "torque")
    # the phases follow the beginning of the relief
    assert "effects.tip_relief.length" in dataset["mesh_phase"].dims
    for amount, length, z, torque in [(5.0, 0.4, 17, 100.0), (25.0, 0.6, 18, 230.0), (25.0, 0.4, 18, 100.0)]:
        point = dataset.sel(dict(zip(keys, (amount, length, z), strict=True)), drop=True).sel(torque=torque)
        tables = RELIEVED.to_mapping()
        tables["effects"]["tip_relief"] |= {"amount": amount, "length": length}
        tables["pair"]["pinion"]["teeth"] = z
        single = single_run(parse_scene({**tables, "load": {"torque": torque}}))
        present = point["pair_index"].isin(single["pair_index"])
        assert_equal(point.isel(pair=np.flatnonzero(present)), single)
        assert float(point["phase_weight"].sum()) == pytest.approx(1.0, abs=1e-14)


def test_samples_equal_robust():
    scene = example("gear55_robust")
    dataset = sweep(scene, torque=[5.0, 10.0], samples=32, seed=3)
    single = robust(replace(scene, load=Load(torque=5.0)), samples=32, seed=3)
    for name in ("transmission_error_rms", "mesh_stiffness_rms", "transmission_error_rms_mean"):
        np.testing.assert_allclose(dataset[name].sel(torque=5.0), single[name], rtol=1e-12)


def test_an_interrupted_sweep_keeps_what_is_done():
    def stop(done: int, of: int) -> None:
        assert of == 6
        if done == 4:
            raise KeyboardInterrupt

    dataset = sweep(RELIEVED, {"effects.crowning.amount": [2.0, 8.0]}, torque=[50.0, 100.0, 150.0], progress=stop)
    done = dataset["transmission_error_mean"].notnull()
    assert dataset.attrs["complete"] == 0
    assert done.values.tolist() == [[True, True, True], [True, False, False]]
    whole = sweep(RELIEVED, {"effects.crowning.amount": [2.0, 8.0]}, torque=[50.0, 100.0, 150.0])
    kept = dataset["transmission_error_mean"].where(done, whole["transmission_error_mean"])
    np.testing.assert_allclose(kept, whole["transmission_error_mean"], rtol=1e-12)


@pytest.mark.parametrize("samples", [0, 4])
def test_an_interruption_before_the_first_point_is_not_passed_over_in_silence(monkeypatch, samples):
    def interrupted(*_, **__):
        if not samples:
            raise KeyboardInterrupt
        return {}, False

    monkeypatch.setattr(run, "respond_with_usual", interrupted)
    monkeypatch.setattr(run, "solve_group", interrupted)
    with pytest.raises(KeyboardInterrupt):
        sweep(example("gear55_robust"), torque=[5.0], samples=samples)


def test_what_is_done_is_kept_now_and_then(monkeypatch):
    monkeypatch.setattr("gearbench.sweeps.run.KEEP_LEAST", 0.0)
    monkeypatch.setattr("gearbench.sweeps.run.KEEP_SHARE", 0.0)
    kept = []
    whole = sweep(RELIEVED, {"effects.crowning.amount": [2.0, 8.0]}, torque=[50.0, 100.0], keep=kept.append)
    done = [int(each["transmission_error_mean"].notnull().sum()) for each in kept]
    assert done == [1, 2, 3, 4]
    assert [each.attrs["complete"] for each in kept] == [0, 0, 0, 1]
    first = kept[2]["transmission_error"]
    # other points have more positions
    same = whole["transmission_error"].isel(position=slice(first.sizes["position"]))
    np.testing.assert_allclose(first.where(first.notnull(), same), same)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({}, "sweep = no key: must sweep at least one"),
        ({"name": [1.0]}, "sweep = name: must be a numeric key"),
        ({"effects.hertz.law": [1.0]}, "sweep = effects.hertz.law: must be a numeric key"),
        ({"torque": []}, "sweep.torque = []: must be one or more finite values"),
        ({"torque": [1.0, 1.0]}, "all different"),
        ({"torque": [0.0]}, "load.torque = 0: must not be 0"),
        ({"torque": [1.0], "load.torque": [2.0]}, "torque: is swept twice"),
        ({"effects.root_relief.amount": [1.0]}, "effects.root_relief.length = missing: is required"),
    ],
)
def test_bad_input_is_one_line(keys, message):
    with pytest.raises(InputError) as caught:
        sweep(example(), keys)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_ranges_as_people_write_them():
    assert parse_range("torque", "20:300:20") == [20.0 * n for n in range(1, 16)]
    assert parse_range("torque", "0:1:0.1")[-1] == pytest.approx(1.0)
    assert parse_range("torque", "1:2:0.3") == pytest.approx([1.0, 1.3, 1.6, 1.9])
    assert parse_setting("effects.crowning.amount=0,4") == ("effects.crowning.amount", [0.0, 4.0])


@pytest.mark.parametrize("text", ["", "20:300", "a", "1:2:0", "2:1:1", "1:inf:1", "0:1:1e-9"])
def test_what_is_no_range_is_one_line(text):
    with pytest.raises(InputError, match=r"^torque = "):
        parse_range("torque", text)


@pytest.mark.slow
def test_every_modification_has_a_torque_of_least_error_that_it_was_designed_for():
    """Claims 3 and 4 of Benatar, Handschuh, Kahraman and Talbot 2019, measured on helical pairs."""
    tables = {
        "pair": {
            "normal_module": 3.0, "helix_angle": 8.0, "face_width": 24.0, "centre_distance": 90.885,
            "pinion": {"teeth": 24}, "wheel": {"teeth": 36},
        },
        "load": {"torque": 150.0},
        "effects": {"tooth_bending": {"model": "solid"}, "hertz": {}, "tip_relief": {"amount": 20.0, "length": 1.6}},
    }  # fmt: skip
    amounts, torques = [10.0, 15.0, 20.0, 30.0], np.arange(20.0, 500.0, 8.0)
    outputs = ["transmission_error_peak_to_peak", "transmission_error_mean"]
    dataset = sweep(parse_scene(tables), {AMOUNT: amounts}, torque=torques, outputs=outputs)
    least = dataset[outputs[0]].idxmin("torque").values
    assert np.all((least > torques[0]) & (least < torques[-1]))
    # a relief is designed for the torque under which the teeth deflect in proportion to it; torques in steps of 8 N·m
    deflection = np.array([float(dataset[outputs[1]].isel({AMOUNT: i}).sel(torque=t)) for i, t in enumerate(least)])
    np.testing.assert_allclose(deflection / amounts, np.mean(deflection / amounts), rtol=0.04)
    # and every relief is the best one at its design torque
    at_its_own = dataset[outputs[0]].sel(torque=least)
    assert at_its_own.argmin(AMOUNT).values.tolist() == [0, 1, 2, 3]


WAVE, COEFFICIENT = "effects.waviness.pinion.0.amplitude", "effects.profile_curve.pinion.polynomial.1"


def test_items_of_lists_are_keys_too():
    """Keys may lead to a number of the first wave and to an item of a list of numbers, in the same sweep."""
    waves = {"pinion": [{"order": 3, "amplitude": 1.0}, {"order": 5, "amplitude": 2.0}]}
    scene = with_tables(example("case1"), waviness=waves, profile_curve={"pinion": {"polynomial": [0.0, 4.0]}})
    found = sweep(scene, {WAVE: [1.0, 6.0], COEFFICIENT: [4.0, 8.0]})
    assert found[WAVE].attrs["units"] == found[COEFFICIENT].attrs["units"] == "µm"
    waves["pinion"][0]["amplitude"] = 6.0
    one = with_tables(scene, waviness=waves, profile_curve={"pinion": {"polynomial": [0.0, 8.0]}})
    np.testing.assert_allclose(
        found["transmission_error_mean"].sel({WAVE: 6.0, COEFFICIENT: 8.0}),
        simulate(one)["transmission_error_mean"],
        rtol=1e-9,
    )
    for key, says in (
        (WAVE.replace("0", "2"), "pinion.2.amplitude = 2: must be an item of the list, counted from 0 to 1"),
        (WAVE.replace(".0", ""), "= amplitude: must be an item of the list"),
    ):
        with pytest.raises(InputError) as caught:
            sweep(scene, {key: [1.0]})
        assert says in str(caught.value)


def test_datasets_beside_each_other_are_those_that_xarray_aligns():
    """Missing positions, pairs and segments are NaN; arrays without missing values remain integers."""
    rng = np.random.default_rng(0)

    def part(positions, pairs, segments):
        coords = {"mesh_phase": (("position",), rng.random(positions)), "pair_index": (("pair",), np.array(pairs))}
        variables = {
            "line_load": (("position", "pair", "segment"), rng.random((positions, len(pairs), segments))),
            "newton_steps": (("position",), rng.integers(0, 9, positions)),
            "rescued": ((), rng.integers(0, 9)),
            "transmission_error_rms": ((), rng.random()),
        }
        return Point(coords, variables)

    def labelled(point):
        sizes = point.sizes
        numbers = {"position": np.arange(sizes["position"]), "segment": np.arange(sizes["segment"])}
        return xr.Dataset(point.variables, point.coords | numbers).set_xindex("pair_index")

    parts = [part(3, [-1, 0, 1], 2), part(5, [0, 1, 2], 2), part(4, [0], 3)]
    found = join_points([*parts, None], "torque")
    how = {"data_vars": "all", "coords": "different", "compat": "equals", "join": "outer"}
    wanted = xr.concat([labelled(each) for each in parts], "torque", **how)
    found = xr.Dataset(found.variables, found.coords)
    assert np.isnan(found["line_load"].isel(torque=3)).all()
    for name in (*parts[0].variables, "mesh_phase"):
        np.testing.assert_array_equal(found[name].isel(torque=slice(3)), wanted[name].transpose("torque", ...))
    assert join_points(parts, "torque").variables["rescued"][1].dtype.kind == "i"
    assert join_points(parts[:1] * 2, "torque").coords["mesh_phase"][0] == ("position",)
