"""Stress on the fillet from the condensed sector: plane strain by a mesh of triangles, mirrors, sums."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fem_reference.section import Body
from gearbench.geometry.pair import Member, Pair
from gearbench.results.flank import loaded_root_stress
from gearbench.scene_file import read_scene
from gearbench.solution import solve_scene
from gearbench.strength.bending import RootBending
from tests.support.fillet_stress import FilletStress, fillet_stress
from tests.support.paths import EXAMPLES
from tests.support.strips import Strip, plane_root_stress, solve_strip


def even_load(found: FilletStress, R: float, points: int = 40) -> np.ndarray:
    """Amplitudes of a load of 1 N/mm at radius R."""
    b = found.flank.gear.face_width
    x, w = np.polynomial.legendre.leggauss(points)
    y = 0.5 * b * (1 + x)
    return found.flank.shapes(np.full(points, R - found.flank.gear.root_radius), y).T @ (0.5 * b * w)


@pytest.mark.parametrize(
    ("teeth", "shift", "number"),
    [(17, 0.0, 4), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((25, 0.3, 4), (60, 0.0, 4)))],
)
def test_the_middle_of_a_wide_gear_is_in_plane_strain(teeth, shift, number, steel):
    """Against triangles refined at the fillet and at the contact strip, load at the outer point of single contact."""
    pair = Pair(
        normal_module=1.0, face_width=20.0, centre_distance=(teeth + 43) / 2,
        pinion=Member(teeth=teeth, profile_shift=shift), wheel=Member(teeth=43, profile_shift=-shift),
    )  # fmt: skip
    gear, bending = pair.gears[0], RootBending(pair=pair, gear=0)
    body = Body(gear=gear, bore_radius=gear.root_radius - 4, teeth=5)
    strip = Strip(radius=bending.load_radius, half_width=0.05)
    exact = plane_root_stress(solve_strip(body, steel, strip, size=0.06), steel)
    found = fillet_stress(body, steel, number, (6, 1))
    n = found.flank.neighbours
    sigma = (found.flank.blocks[n] @ even_load(found, bending.load_radius)).reshape(len(found.radius), -1, 3)
    # the free ends relieve the middle of a gear 20 modules wide by little; tangential stress is the largest
    assert sigma[:, 1, 0].max() == pytest.approx(exact, rel=0.01)
    # and ISO 6336-3, method B: Y_F Y_S is σ_F over F_t/(b m); asked for: 15 %
    factor = sigma[:, 1, 0].max() / math.cos(math.radians(pair.pressure_angle))
    assert factor == pytest.approx(bending.form_factor * bending.stress_correction, rel=0.06)


@pytest.mark.parametrize(
    ("name", "index"),
    [
        ("osu_50", 0),
        pytest.param("e_drive_output", 0, marks=pytest.mark.slow),
        pytest.param("e_drive_output", 1, marks=pytest.mark.slow),
    ],
)
def test_root_stress_of_the_load_found_against_finite_elements(name, index):
    """The largest over the mesh cycle, factors of ISO 6336-3 at the height of each segment (F9), spur and helical.

    −2.5 and −2.6 % on osu_50, 6.6 and 3.6 % on e_drive_output, against level 3; level 4 is 1.2 % lower on osu_50.
    """
    scene = read_scene(EXAMPLES / "gears" / f"{name}.toml")
    pair, solved = scene.pair, solve_scene(scene)
    body = Body(gear=pair.gears[index], bore_radius=pair.members[index].bore_diameter / 2)
    found = fillet_stress(body, pair.materials[index], 3, driven=index == 1)
    exact = found.largest(solved.lines, solved.solution.force / solved.lines.lever).max()
    # form and stress correction factor of the norm are good to some percent, see above
    assert float(loaded_root_stress(solved)[index]) == pytest.approx(exact, rel=0.08)
