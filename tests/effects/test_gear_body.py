"""The gear body as an effect: refused keys, the added compliance, and results that must not change."""

from __future__ import annotations

import copy
import re
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.flank import NEGLIGIBLE
from gearbench.contact.coarse_solution import scene_lines
from gearbench.effects.base import Dense, LowRank
from gearbench.effects.gear_body import GearBody
from gearbench.effects.registry import RENAMED
from gearbench.effects.teeth import ring_flank, toothed_ring
from gearbench.effects.tooth_bending import ToothBending
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate

SPUR: dict[str, Any] = {
    "pair": {
        "normal_module": 3.0,
        "face_width": 24.0,
        "centre_distance": 90.4,
        "pinion": {"teeth": 24, "bore_diameter": 30.0},
        "wheel": {"teeth": 36, "bore_diameter": 40.0},
    },
    "load": {"torque": 150.0},
    "resolution": {"positions": 12, "segments": 7},
}
HELICAL = copy.deepcopy(SPUR)
HELICAL["pair"] |= {"helix_angle": 18.0, "centre_distance": 94.9}
TABLES = {"spur": SPUR, "helical": HELICAL}
BOTH = pytest.mark.parametrize("kind", TABLES)
SOLID = {"hertz": {}, "tooth_bending": {"model": "solid"}}


def tables(kind: str, effects: dict[str, Any], pinion: dict[str, Any] | None = None) -> dict[str, Any]:
    result = copy.deepcopy(TABLES[kind])
    result["effects"] = effects
    result["pair"]["pinion"] |= pinion or {}
    return result


#: The body below the loaded tooth only, and the whole of it.
BODIES: dict[str, dict[str, Any]] = {"own": {"coupled": False}, "coupled": {}}
OWN, COUPLED = GearBody(coupled=False), GearBody()


@cache
def scene(kind: str, body: str = "") -> Scene:
    return parse_scene(tables(kind, SOLID | ({"gear_body": BODIES[body]} if body else {})))


@cache
def simulated(kind: str, body: str = ""):
    return simulate(scene(kind, body))


# -- what is refused --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("effects", "pinion", "message"),
    [
        ({"gear_body": {}}, {}, "effects.hertz = missing: is required by effects.gear_body: "),
        (
            {"hertz": {}}, {"bore_diameter": 70.0},  # whether its body is simulated or not
            "pair.pinion.bore_diameter = 70: must be at most 64.8417 mm, the root circle",
        ),
        (
            {"hertz": {}, "gear_body": {"model": "sainsot_velex", "coupled": False}}, {},
            'effects.gear_body.coupled = False: belongs to model = "ring"',
        ),
        (
            {"hertz": {}, "gear_body": {"model": "sainsot_velex"}}, {"bore_diameter": 6.0},
            "effects.gear_body.model = sainsot_velex: pair.pinion: M* = 5.194",
        ),
        ({"hertz": {}, "gear_body": {"model": "half_plane"}}, {}, "must be 'ring' or 'sainsot_velex'"),
        ({"hertz": {}, "gear_body": {"order": [4, 5, 5]}}, {}, "body.order = unknown key: allowed: model, coupled"),
        (
            {"hertz": {}, "gear_body": {}, "tooth_bending": {"model": "solid", "order": [1, 5, 5]}}, {},
            "effects.gear_body = effects.tooth_bending.order = [1, 5, 5]: "
            "a ring needs at least 2 functions across the tooth thickness",
        ),
        (
            {"hertz": {}, "gear_body": {"coupled": False}, "tooth_bending": {"model": "finite_elements"}}, {},
            "effects.gear_body.coupled = False: belongs to a plate or solid tooth",
        ),
        (
            {"hertz": {}, "gear_body": {"model": "sainsot_velex"}, "tooth_bending": {"model": "finite_elements"}}, {},
            "effects.gear_body.model = sainsot_velex: belongs to a plate or solid tooth",
        ),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_in_one_line(effects, pinion, message):
    with pytest.raises(InputError) as error:
        parse_scene(tables("spur", effects, pinion))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", RENAMED)
def test_old_names_of_tables_are_answered_with_the_new_ones(name):
    with pytest.raises(InputError, match=rf"^effects\.{name} = old name: write {re.escape(RENAMED[name])}"):
        parse_scene(tables("spur", SOLID | {name: {}}))


@pytest.mark.parametrize("tooth", ["plate", "solid", "finite_elements"])
@pytest.mark.parametrize("gear", ["pinion", "wheel"])
def test_bores_of_both_gears_are_needed(tooth, gear):
    name = "gear_body"
    given = tables("spur", {"hertz": {}, "tooth_bending": {"model": tooth}, name: {}})
    del given["pair"][gear]["bore_diameter"]
    with pytest.raises(InputError, match=rf"^effects\.{name} = given: needs pair\.{gear}\.bore_diameter"):
        parse_scene(given)


# -- what is added ----------------------------------------------------------------------------------------------------
def lines(kind: str) -> ContactLines:
    return scene_lines(scene(kind), np.linspace(0.02, 0.98, 9))


def pair_blocks(part: LowRank | Dense, at: ContactLines) -> np.ndarray:
    """Compliance between all segments (position, pair, segment, pair, segment); zero for absent lines."""
    if isinstance(part, Dense):
        return part.matrix.reshape(*at.shape, *at.shape[1:])
    psi = np.where(at.active[..., None, None], part.factor, 0.0)
    if part.coupled:
        return np.einsum("pkir,pljr->pkilj", psi, psi)
    return np.einsum("pkir,pkjr,kl->pkilj", psi, psi, np.eye(at.shape[1]))


@pytest.fixture
def every_direction(monkeypatch):
    """Keep all directions of the compliance, also negligible ones, so that it is exact term by term."""
    monkeypatch.setattr("gearbench.compliance.flank.NEGLIGIBLE", 0.0)


@BOTH
def test_directions_left_out_are_not_felt(kind, monkeypatch):
    """The omitted directions, below ε λ_max of C, are positive and move no point by more than ε λ_max |φ(P)| |φ(Q)|."""
    at = lines(kind)
    kept, coupled = pair_blocks(OWN.compliance(at, {}), at), simulate(scene(kind, "coupled"))
    monkeypatch.setattr("gearbench.compliance.flank.NEGLIGIBLE", 0.0)
    whole, all_coupled = pair_blocks(OWN.compliance(at, {}), at), simulate(scene(kind, "coupled"))
    most = np.zeros(at.shape)
    for index in (0, 1):
        flank = ring_flank(at.pair, index, None, 0)
        shapes = flank.shapes(at.radii[index] - flank.gear.root_radius, at.y)
        most += NEGLIGIBLE * np.linalg.eigvalsh(flank.block(0))[-1] * np.sum(shapes**2, axis=-1)
    for p, k in np.argwhere(at.active):
        missing = (whole - kept)[p, k, :, k]
        assert np.all(np.abs(missing) <= 1.000001 * np.sqrt(np.outer(most[p, k], most[p, k])))
        assert np.linalg.eigvalsh(missing)[0] > -1e-9 * whole.max()
    assert not np.array_equal(kept, whole)
    # between teeth the error is about √(0.1 ε) of the omitted part, and its sum over the segments far less
    for name, tolerance in (("transmission_error", 1e-6), ("mesh_stiffness", 1e-6), ("line_load", 5e-5)):
        exact = all_coupled[name].values
        assert_allclose(coupled[name], exact, rtol=0, atol=tolerance * np.abs(exact).max())


@BOTH
@pytest.mark.usefixtures("every_direction")
def test_foundation_is_the_part_of_the_body_below_the_loaded_tooth(kind):
    """The coupled compliance of the whole body, without its blocks between different teeth, is the uncoupled one."""
    at = lines(kind)
    own = pair_blocks(OWN.compliance(at, {}), at)
    all_teeth = pair_blocks(COUPLED.compliance(at, {}), at)
    # square roots drop eigenvalues below 1e-12 of the greatest
    k = np.arange(at.shape[1])
    assert_allclose(all_teeth[:, k, :, k], own[:, k, :, k], rtol=0, atol=1e-9 * own.max())
    others = all_teeth.copy()
    others[:, k, :, k] = 0
    assert np.abs(others).max() > 0.02 * own.max()


@BOTH
@pytest.mark.usefixtures("every_direction")
def test_neighbours_are_the_next_teeth_of_each_gear(kind):
    """Pair k + 1 is on the next tooth of the pinion and the previous tooth of the wheel; both compliances add."""
    at = lines(kind)
    pair, b = at.pair, at.pair.face_width
    found = pair_blocks(COUPLED.compliance(at, {}), at)
    bodies = [toothed_ring(pair, k, None) for k in range(2)]
    count = at.shape[1]
    blocks = [body.blocks(count - 1) for body in bodies]
    height = [r - g.root_radius for r, g in zip(at.radii, pair.gears, strict=True)]
    # the wheel is the mirror image of the modelled tooth, whose flank is loaded from the other side
    plain = [body.tooth.flank for body in bodies]
    for p, i, j in np.argwhere(at.active[:, :, None] & at.active[:, None, :]):
        x = [plain[g].shapes(height[g][p], at.y[p] if g == 0 else b - at.y[p]) for g in range(2)]
        expected = x[0][i] @ blocks[0][count - 1 + i - j] @ x[0][j].T
        expected = expected + x[1][i] @ blocks[1][count - 1 + j - i] @ x[1][j].T
        # directions of the coupling below 1e-8 of the largest compliance are dropped, up to ten of them here
        assert_allclose(found[p, i, :, j], expected, rtol=0, atol=1e-7 * found.max())


@BOTH
def test_order_is_that_of_the_tooth(kind):
    at = lines(kind)
    teeth = [{}, *({"tooth_bending": ToothBending(model="solid", order=order)} for order in ((3, 3, 3), None))]
    for effect in (OWN, COUPLED):
        alone, coarse, fine = (pair_blocks(effect.compliance(at, effects), at) for effects in teeth)
        assert np.array_equal(fine, alone)
        assert 0.6 < coarse.max() / fine.max() < 0.98
    pinion, _ = at.pair.gears
    assert toothed_ring(at.pair, 0, (3, 3, 3)).tooth.order == (3, 3, 3)
    assert toothed_ring(at.pair, 0, (3, 3, 3)).bore_radius == pytest.approx(15.0)
    assert toothed_ring(at.pair, 1, None).bore_radius == pytest.approx(20.0)
    assert [ring_flank(at.pair, index, None, 0).driven for index in (0, 1)] == [False, True]
    assert toothed_ring(at.pair, 0, None).tooth.gear == pinion


@cache
def stiffness(kind: str, body: str = "") -> np.ndarray:
    return simulated(kind, body).mesh_stiffness.values


def test_one_pair_in_contact_knows_no_neighbours():
    """In spur gears, coupling changes nothing at positions with one pair in contact, but does elsewhere."""
    count = (simulated("spur").line_load.sum("segment") > 0).sum("pair").values
    one, two = count == 1, count == 2
    assert one.sum() >= 3
    assert two.sum() >= 3
    own, coupled = stiffness("spur", "own"), stiffness("spur", "coupled")
    assert_allclose(coupled[one], own[one], rtol=1e-9)
    assert np.all(coupled[two] < 0.97 * own[two])
    ste = [simulated("spur", name).transmission_error.values for name in BODIES]
    assert_allclose(ste[1][one], ste[0][one], rtol=1e-9)


@BOTH
def test_body_makes_the_mesh_softer(kind):
    clamped, own, coupled = (stiffness(kind, m) for m in ("", "own", "coupled"))
    assert np.all(own < 0.75 * clamped)
    assert np.all(coupled < own * (1 + 1e-9))
