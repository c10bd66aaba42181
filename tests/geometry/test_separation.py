"""Separation of flanks: brute-force search of two surfaces, closed forms, symmetry, continuity."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.profile import Modification, profile
from gearbench.geometry.separation import REACH, Separation, separation
from tests.support.campaign import many
from tests.support.touching_surfaces import first_touch


def standard(**changes: float) -> Pair:
    """The pair of the contact benchmark: 25/40 teeth of 2 mm, sharp tips."""
    pinion = Member(teeth=25, **changes)
    return Pair(normal_module=2.0, face_width=20.0, centre_distance=65.0, pinion=pinion, wheel=Member(teeth=40))


def relieved(pair: Pair, amount: float, length: float, power: int = 1) -> tuple[Modification, ...]:
    """Tip relief of both gears [mm]."""
    return tuple(
        Modification(gear=index, amount=amount, start=gear.tip_radius - length, length=length, power=power)
        for index, gear in enumerate(pair.gears)
    )


def random_pair(rng: np.random.Generator, rounded: bool = False) -> Pair:
    """Random spur or helical pair: 14 to 90 teeth, modules of 1 to 10 mm, profile shifts, any addenda, rounded tips."""
    while True:
        z, m = rng.integers((14, 14), (60, 90)), rng.choice([1.0, 2.0, 5.0, 10.0])
        helix = rng.choice([0.0, rng.uniform(0, 30)])
        a = m * z.sum() / 2 / math.cos(math.radians(helix)) * rng.uniform(0.99, 1.02)
        tip = {"tip_rounding": m * rng.uniform(0.02, 0.06)} if rounded else {}
        members = [Member(teeth=int(n), addendum=rng.uniform(0.8, 1.15), dedendum=1.4, **tip) for n in z]
        try:
            return Pair(
                normal_module=m,
                helix_angle=helix,
                face_width=10 * m,
                centre_distance=a,
                backlash=0.01,
                pinion=members[0],
                wheel=members[1],
            )
        except InputError:
            continue


def random_modifications(pair: Pair, rng: np.random.Generator, powers: int = 1) -> tuple[Modification, ...]:
    """Random tip and root relief, linear or parabolic, also excess material, and profile curves up to ``powers``."""
    found, m = [], pair.normal_module
    for index, gear in enumerate(pair.gears):
        start, end = pair.meshing.active_radii[index]
        height, power = end - start, int(rng.integers(1, 3))
        if rng.random() < 0.6:
            length, amount = rng.uniform(0.1, 0.5) * height, rng.uniform(-1e-3, 5e-3) * m
            tip = gear.tip_radius - length
            found.append(Modification(gear=index, amount=amount, start=tip, length=length, power=power))
        if rng.random() < 0.4:
            length, amount = rng.uniform(0.1, 0.4) * height, rng.uniform(-1e-3, 4e-3) * m
            found.append(Modification(gear=index, amount=amount, start=start + length, length=-length, power=power))
        if rng.random() < 0.4:
            low, high = (math.sqrt(r**2 - gear.base_radius**2) for r in (start, end))
            for power in range(1, powers + 1):
                amount, whole = rng.uniform(-3e-3, 3e-3) * m, {"along": "roll", "one_sided": False, "power": power}
                found.append(Modification(gear=index, amount=amount, start=low, length=high - low, **whole))
    return tuple(found)


def against_search(pairs: int, seed: int, rounded: bool = False) -> NDArray:
    """Differences [mm] between separations and a search of two surfaces, at four phases for each pair."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(pairs):
        pair = random_pair(rng, rounded)
        modifications = random_modifications(pair, rng, 3 if rounded else 1)
        flanks, p = separation(pair, modifications), pair.meshing.base_pitch
        for v in rng.uniform(pair.meshing.path_start - 0.3 * p, pair.meshing.path_end + 0.3 * p, 4):
            u, gap = first_touch(pair, modifications, v)
            # no load closes a fiftieth of the module
            if gap < 0.02 * pair.normal_module and abs(u - sum(flanks.path) / 2) < 0.25 * p + np.ptp(flanks.path) / 2:
                found.append(float(flanks(np.array(u)).gap) - gap)
    return np.array(found)


@pytest.mark.parametrize(
    ("pairs", "rounded", "least"),
    [(12, False, 20), (8, True, 15), pytest.param(many(370), False, 1000, marks=pytest.mark.slow)],
    ids=["sharp", "rounded", "many"],
)
def test_separation_is_that_of_a_search_of_two_surfaces(pairs: int, rounded: bool, least: int) -> None:
    """Either rounding of the tips may touch the flank of the mate, with relief and profile curves.

    Measured: 1e-11 mm and less, a few 1e-10 mm near an interference point, where profiles curve sharply.
    """
    differences = against_search(pairs, 3, rounded)
    assert len(differences) > least
    assert_allclose(differences, 0.0, atol=1e-9)


def at(flanks: Separation, u: float) -> float:
    """Separation at one nominal coordinate [mm]."""
    return float(flanks(np.array(u)).gap)


def test_unmodified_flanks_touch_on_the_path_and_part_quadratically_beyond_it() -> None:
    """To first order in du: turned by du/r_b each, the tip is off its nominal partner by s, and the gap s²/(2ρ).

    A point of roll length ℓ moves off the line of action along its flank by ℓ du/r_b, on the mate's flank the point
    that belongs to it lies on the other side.
    """
    pair = standard()
    flanks, T = separation(pair), pair.meshing.tangent_length
    u = np.linspace(pair.meshing.path_start, pair.meshing.path_end, 50)
    assert_allclose(flanks(u).gap, 0.0, atol=1e-13)
    assert_allclose(flanks(u).rolls, [u, T - u], atol=1e-12)
    assert_allclose(flanks(u).levers, 1.0, atol=1e-14)
    for u_end, sign, k in ((pair.meshing.path_end, 1, 0), (pair.meshing.path_start, -1, 1)):
        du = 1e-3
        own = u_end if k == 0 else T - u_end
        rho = own * (T - own) / T
        s = own * du / pair.gears[k].base_radius
        # s is measured from the nominal point on its own flank; relative error of first order in du/ℓ
        assert at(flanks, u_end + sign * du) == pytest.approx(s**2 / (2 * rho), rel=1e-3)


@pytest.mark.parametrize("amount", [1e-4, 5e-4, 2e-3])
def test_between_both_sides_of_a_slight_relief_its_corner_touches(amount: float) -> None:
    """The corner touches on a part of the path shorter than the distance of nodes; the table has no hole there."""
    pinion, wheel = Member(teeth=25), Member(teeth=40)
    pair = Pair(normal_module=2.0, helix_angle=20.0, face_width=20.0, centre_distance=70.0, pinion=pinion, wheel=wheel)
    u = np.linspace(pair.meshing.path_start + 1e-6, pair.meshing.path_end - 1e-6, 20_001)
    gap = separation(pair, relieved(pair, amount, 0.8))(u).gap
    assert gap.max() < 1.1 * amount
    assert np.abs(np.diff(gap)).max() < 2 * amount / 0.8 * (u[1] - u[0])


def test_the_corner_of_a_relief_begins_and_ceases_to_touch_at_two_positions() -> None:
    pair = standard()
    flanks = separation(pair, relieved(pair, 0.02, 0.8))
    _, *corners, _ = flanks.changes
    assert len(corners) == 4
    for gear, pair_of_ends in ((1, corners[:2]), (0, corners[2:])):
        assert_allclose(min(np.abs(np.subtract(flanks.kinks, np.mean(pair_of_ends)))), 0.0, atol=1e-12)
        assert not set(pair_of_ends) & set(flanks.kinks)
        first, last = pair_of_ends
        assert_array_equal(flanks(np.linspace(first + 1e-6, last - 1e-6, 9)).edge, gear)
        assert_array_equal(flanks(np.array([first - 1e-6, last + 1e-6])).edge, -1)


def test_rounding_is_an_arc_between_flank_and_tip_circle() -> None:
    """Its points are at its radius from the centre; the last point is on the tip circle."""
    gear = standard(tip_rounding=0.2).gears[0]
    arc = profile(gear).pieces[-1]
    roll = np.linspace(arc.low, arc.high, 30)
    e, _, _ = arc.deviation(roll)
    turn = roll / gear.base_radius
    length, r_b = roll - e, gear.base_radius
    points = np.stack([length * np.cos(turn) - r_b * np.sin(turn), length * np.sin(turn) + r_b * np.cos(turn)])
    R = np.hypot(*points)
    assert R[-1] == pytest.approx(gear.tip_radius, rel=1e-12)
    assert_allclose(arc.normal(roll[:-1])[1], 0.2, rtol=1e-6)


def test_derivatives_of_a_profile_are_those_of_its_deviation() -> None:
    """Central differences; their error is a few 1e-8."""
    pair = standard(tip_rounding=0.2)
    pieces = profile(pair.gears[0], relieved(pair, 0.02, 0.8, 2)[:1]).pieces
    for piece in pieces:
        roll, h = np.linspace(piece.low, piece.high, 9)[2:-2], 1e-5
        up, here, down = (piece.deviation(roll + d) for d in (h, 0.0, -h))
        assert_allclose(here[1], (up[0] - down[0]) / (2 * h), atol=1e-7)
        assert_allclose(here[2], (up[1] - down[1]) / (2 * h), rtol=1e-5, atol=1e-7)
        n_up, n, n_down = (piece.normal(roll + d) for d in (h, 0.0, -h))
        turns = (n_up[0] - n_down[0]) / (2 * h)
        length, r_b = roll - here[0], piece.base_radius
        assert_allclose(n[1], np.hypot(length, r_b * here[1]) / (1 + r_b * turns), rtol=1e-5)
        for value, slope in ((2, 4), (3, 5)):
            assert_allclose(n[slope], (n_up[value] - n_down[value]) / (2 * h), rtol=1e-5, atol=1e-7)


def test_table_reaches_as_far_as_it_says() -> None:
    """Beyond the ends of the table no flank touches."""
    pair = standard()
    flanks = separation(pair)
    low, high = flanks.reach(0.01)
    assert flanks.low < low < pair.meshing.path_start
    assert pair.meshing.path_end < high < flanks.high
    assert at(flanks, low) >= 0.01 - 1e-3
    assert at(flanks, high) >= 0.01 - 1e-3
    assert math.isinf(at(flanks, pair.meshing.path_end + 1.1 * REACH * pair.meshing.base_pitch))


@pytest.mark.parametrize(
    ("teeth", "addendum"), [((25, 40), 1.0), ((200, 200), 1.0), ((39, -99), 0.8), ((39, -53), 0.7)]
)
def test_table_ends_where_no_load_brings_the_flanks_together(teeth, addendum) -> None:
    """At 10 µm per mm of module, the deflection of steel teeth under 200 N/mm per mm, however slowly they part."""
    pinion, wheel = (Member(teeth=z, addendum=addendum) for z in teeth)
    flanks = separation(
        Pair(normal_module=2.0, face_width=20.0, centre_distance=float(sum(teeth)), pinion=pinion, wheel=wheel)
    )
    for end in (flanks.low, flanks.high):
        assert at(flanks, end) > 0.02
