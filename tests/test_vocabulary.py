"""Pairs in use with keys drawn at random from the whole vocabulary: written, read back, solved, kept, loaded."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from gearbench import open_result, read_scene, save
from gearbench.effects.registry import EFFECTS
from gearbench.errors import InputError
from gearbench.exchange.rexs import read_rexs
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.results.origin import scene_of
from gearbench.results.outputs import OUTPUTS
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate
from tests.support.paths import ROOT

FILES = sorted((ROOT / "examples" / "gears").glob("*.toml"))
SEW = ROOT / "tests" / "data" / "sew_3_stage_cylindrical_gearbox_1.0.rexs"
NAMES = [*(path.stem for path in FILES), *(f"sew stage {n}" for n in (1, 2, 3))]
#: Numbers that are −∞, not finite, where a flank touches at its base circle.
UNBOUNDED = {"specific_sliding"}
#: Effects of the flank's shape, which the coast flanks may have of their own.
SHAPES = ("crowning", "tip_relief", "end_relief", "profile_crowning", "helix_slope", "flank_twist", "profile_curve")


def base(name: str) -> Scene:
    if not name.startswith("sew"):
        return read_scene(ROOT / "examples" / "gears" / f"{name}.toml")
    return read_rexs(SEW, int(name[-1]), torque=100.0)


def member(draw: np.random.Generator, m: float, b: float) -> dict[str, Any]:
    """Keys of one gear."""
    low = float(-draw.uniform(0.02, 0.05) * m * 1e3)
    keys: dict[str, Any] = {
        "face_width": float(b * draw.uniform(1.0, 1.2)),
        "axial_offset": float(draw.uniform(-0.05, 0.05) * b),
        "thickness": {"upper": 0.5 * low, "lower": low},
        "protuberance": float(0.02 * m),
        "grinding_stock": float(0.01 * m),
        "material": {"youngs_modulus": float(draw.uniform(180, 215)), "thermal_expansion": 12.0},
        "tip_chamfer" if draw.random() < 0.5 else "tip_rounding": float(0.03 * m),
    }
    chosen = {key: value for key, value in keys.items() if draw.random() < 0.6}
    if "protuberance" not in chosen:
        chosen.pop("grinding_stock", None)
    return chosen


def measured(draw: np.random.Generator, pair: Pair, index: int, folder: Path) -> str:
    """A file of a measured flank [µm], somewhat smaller than the flank."""
    start, end = pair.meshing.active_radii[index]
    radius, face = np.linspace(start, end, 5)[1:], np.linspace(0.0, pair.gears[index].face_width, 4)
    rows = [["radius", *face], *([r, *line] for r, line in zip(radius, draw.uniform(0, 3, (4, 4)), strict=True))]
    path = folder / f"{GEARS[index]}.csv"
    path.write_text("\n".join(",".join(repr(float(v)) if v != "radius" else v for v in row) for row in rows))
    return str(path)


def relief(draw: np.random.Generator, m: float) -> dict[str, Any]:
    shape = str(draw.choice(["linear", "parabolic", "circular"]))
    return {"amount": float(draw.uniform(1, 12)), "length": float(draw.uniform(0.1, 0.35) * m), "shape": shape}


def effects(draw: np.random.Generator, scene: Scene, folder: Path) -> dict[str, Any]:
    """Tables of every effect that adds gap, and of random errors of all kinds."""
    m, b, z = scene.pair.normal_module, scene.pair.meshing.face_width, scene.pair.pinion.teeth
    some = lambda scale: float(draw.uniform(-scale, scale))  # noqa: E731
    each = draw.random() < 0.5  # a table for each gear, or one of the pair
    crowned = {"amount": abs(some(8)), "amount_at_0": abs(some(5)), "highest": 0.4 * b}
    ended = {"at_b": {"amount": abs(some(8)), "length": 0.1 * b, "shape": "parabolic"}}
    return {
        "crowning": {"pinion": {**crowned, "highest": 0.6 * b}, "wheel": {"amount": 2.0}} if each else crowned,
        "tip_relief": {"pinion": relief(draw, m), "wheel": relief(draw, m)},
        "root_relief": {**relief(draw, 0.5 * m), "gear": "wheel"},
        "end_relief": {"pinion": {"amount": 3.0, "length": 0.1 * b}, "wheel": ended} if each else ended,
        "profile_slope": {"pinion": some(4), "wheel": some(4)},
        "profile_crowning": {"pinion": abs(some(4)), "wheel": 1.0},
        "profile_curve": {"wheel": {"polynomial": [some(3), some(3), some(2)]}},
        "helix_curve": {"pinion": {"at": [0.0, 0.5 * b, b], "deviation": [abs(some(4)), 0.0, abs(some(4))]}},
        "flank_twist": {"pinion": some(5)},
        "helix_slope": {"pinion": some(6), "wheel": some(4)},
        "pitch_errors": {"pinion": [some(2) for _ in range(z)], "pinion_tooth": int(draw.integers(z))},
        "random_pitch": {"wheel": {"single_pitch": 4.0, "seed": int(draw.integers(99))}},
        "waviness": {"pinion": [{"order": 1, "amplitude": abs(some(10)), "over_face": "tilting"}],
                     "wheel": [{"order": int(draw.integers(2, 200)), "amplitude": 0.3, "phase": some(180)}]},
        "misalignment": {"inclination": some(5), "deviation": some(5)},
        "manufacturing_errors": {
            "profile_form": {"amplitude": 4.0},
            "run_out": {"amplitude": 20.0},
            "wobble": {"amplitude": 5.0, "gear": "wheel"},
            "varied": [{"key": "helix_slope.pinion", "amplitude": 3.0}],
            "tooth_thickness": {"amplitude": 10.0},
            "centre_distance": {"amplitude": 15.0},
        },
        "off_line_contact": {},
        "topography": {GEARS[index]: measured(draw, scene.pair, index, folder) for index in (0, 1)},
    }  # fmt: skip


def drawn(name: str, seed: int, folder: Path) -> dict[str, Any]:
    """The tables of a scene of one of the pairs, with about 60 % of all keys."""
    draw, scene = np.random.default_rng([seed, NAMES.index(name)]), base(name)
    tables = scene.to_mapping()
    pair, m, b = tables["pair"], scene.pair.normal_module, scene.pair.face_width
    for gear in ("pinion", "wheel"):
        pair[gear] |= member(draw, m, b)
    if "face_width" in pair["pinion"] and "face_width" in pair["wheel"]:
        pair["wheel"]["face_width"] = b
    if draw.random() < 0.6:
        pair |= {"centre_distance_upper": 25.0, "centre_distance_lower": -15.0}
    if draw.random() < 0.6:
        pair["temperature"] = {"pinion": 55.0, "wheel": 50.0, "housing": 60.0, "housing_expansion": 23.0}
    table = effects(draw, scene, folder)
    chosen = {key: value for key, value in table.items() if draw.random() < 0.6 or key == "helix_slope"}
    tables["effects"] = {"tooth_bending": {"basis": "paper"}, "hertz": {}, **chosen}
    if draw.random() < 0.5:
        tables["load"]["torque"] *= -1
        tables["coast"] = {key: effects(draw, scene, folder)[key] for key in SHAPES if draw.random() < 0.5}
        if not tables["coast"]:
            del tables["coast"]
    tables["resolution"] = {"positions": 5, "segments": 9}
    tables["operation"] = {"speed": 1200.0, "viscosity": 20.0, "lubricant_factor": 0.8}
    return tables


def on_bodies_under_loads(tables: dict[str, Any]) -> dict[str, Any]:
    """The same on solid teeth and bodies, under two torques, one of each flank."""
    torque = tables["load"]["torque"]
    tables = {key: table for key, table in tables.items() if key != "load"}
    for gear in GEARS:  # of pinions cut into their shafts the file gives no bore
        tables["pair"][gear].setdefault("bore_diameter", 4.0)
    tables["loads"] = [{"torque": torque, "weight": 2.0}, {"torque": -0.6 * torque}]
    return tables | {"effects": tables["effects"] | {"tooth_bending": {"model": "solid"}, "gear_body": {}}}


def written_read_solved_kept(tables: dict[str, Any], folder: Path) -> None:
    scene = parse_scene(tables)
    text = scene.to_toml()
    again = parse_scene(tomllib.loads(text))
    assert again == scene
    assert again.digest == scene.digest
    dataset = simulate(scene, outputs=tuple(OUTPUTS))
    there = dataset["segment_length"] > 0
    for output, (dims, _) in OUTPUTS.items():
        values = dataset[output]
        if "segment" in dims:  # NaN stands where another load has more positions or pairs
            finite = np.isfinite(values) | ((values == -np.inf) & (output in UNBOUNDED))
            assert bool((finite | ~there).all()), output
        else:  # few uniform phases hold few orders; pairs as above
            assert bool(values.notnull().any()), output
            assert not np.isinf(values).any(), output
    solved = dataset["phase_weight"] > 0
    assert np.all(np.isfinite(dataset.transmission_error.where(solved, 0.0)))
    assert np.all(dataset.mesh_stiffness.where(solved, 1.0) > 0)
    assert float(dataset.equilibrium_residual.max()) < 1e-9
    assert float(dataset.complementarity_residual.max()) < 1e-6
    save(dataset, folder / "kept.nc")
    kept = open_result(folder / "kept.nc")
    xr.testing.assert_identical(kept.transmission_error, dataset.transmission_error)
    for index in (0, 1):  # nothing but the Dataset is left
        (folder / f"{GEARS[index]}.csv").unlink()
    assert scene_of(kept) == scene


@pytest.mark.parametrize("name", ["e_drive_input", "fzg_c", "sew stage 2"])
def test_keys_at_random(name, tmp_path):
    written_read_solved_kept(drawn(name, 0, tmp_path), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_keys_at_random_of_every_pair(name, tmp_path):
    written_read_solved_kept(drawn(name, 1, tmp_path), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fzg_c", "thin_rim", "e_drive_output", "sew stage 1"])
def test_keys_at_random_on_bodies_under_loads_of_both_flanks(name, tmp_path):
    written_read_solved_kept(on_bodies_under_loads(drawn(name, 5, tmp_path)), tmp_path)


def test_keys_at_random_with_both_tips_rounded_and_contact_off_the_line(tmp_path):
    tables = drawn("e_drive_input", 4, tmp_path)
    assert "off_line_contact" in tables["effects"]
    assert all("tip_rounding" in tables["pair"][gear] for gear in ("pinion", "wheel"))
    written_read_solved_kept(tables, tmp_path)


def test_the_draws_reach_every_effect_that_adds_gap(tmp_path):
    reached = set(effects(np.random.default_rng(0), base("fzg_c"), tmp_path))
    assert reached == set(EFFECTS) - {"tooth_bending", "gear_body", "hertz"}


def test_faults_of_any_drawn_number_are_one_line(tmp_path):
    """Every number of a drawn scene far beyond what it may be: refused in a line that names a key, or harmless."""
    tables, refused = drawn("fzg_c", 3, tmp_path), 0

    def numbers(table: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        items = table.items() if isinstance(table, dict) else enumerate(table) if isinstance(table, list) else ()
        found = [(*path, key) for key, value in items if isinstance(value, float)]
        return found + [each for key, value in items for each in numbers(value, (*path, key))]

    for path in numbers(tables):
        below: Any = tables
        for key in path[:-1]:
            below = below[key]
        kept, below[path[-1]] = below[path[-1]], 1e9
        with pytest.raises(InputError) as caught:
            parse_scene(tables)
        assert caught.value.key
        assert "\n" not in str(caught.value)
        refused, below[path[-1]] = refused + 1, kept
    assert refused > 40
    parse_scene(tables)
