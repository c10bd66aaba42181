"""The truncated factor of coupled pairs against the whole one: the bound (C8), and the answers."""

import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.problem import TRUNCATION, gram, stiffness_of_law, truncated_root
from gearbench.contact.solver import solve
from gearbench.scene_file import parse_scene

ELECTRIC_AXLE = """
[pair]
normal_module = 1.8
pressure_angle = 17.5
helix_angle = 27.0
face_width = 30.0
centre_distance = 109.446
pinion = { teeth = 25, addendum = 1.15, dedendum = 1.5, bore_diameter = 22.0, profile_shift = 0.25 }
wheel = { teeth = 83, addendum = 1.15, dedendum = 1.5, bore_diameter = 70.0, profile_shift = -0.05 }
[load]
torque = 130.0
[effects.tooth_bending]
model = "solid"
[effects.gear_body]
[effects.hertz]
[effects.crowning]
amount = 3.0
"""


def compliances(truncation: float, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random smooth compliances, what a factor of them leaves out, and the law's compliance beside them."""
    rng = np.random.default_rng(2)
    whole = gram(rng.standard_normal((3, 12, 12)) * 10.0 ** -np.arange(12))
    L = truncated_root(whole, stiffness, truncation)
    return whole, whole - gram(L), 1 / stiffness


@pytest.mark.parametrize("truncation", [1e-2, 1e-4, 1e-6])
def test_what_is_left_out_is_less_than_the_fraction_of_the_law(truncation):
    stiffness = np.random.default_rng(3).uniform(0.1, 10.0, (3, 12))
    _, rest, law = compliances(truncation, stiffness)
    scaled = rest / np.sqrt(law[:, :, None] * law[:, None])
    value = np.linalg.eigvalsh(scaled)
    assert value.min() > -1e-13
    trace = value.sum(axis=1)
    assert np.all(trace <= truncation)
    assert np.all(trace > 1e-4 * truncation), "more columns than were asked for"


def test_electric_axle_is_within_the_bound():
    scene = parse_scene(tomllib.loads(ELECTRIC_AXLE))
    lines = scene_lines(scene, np.array([0.1, 0.6]))
    truncated, whole = assemble(scene, lines), assemble(scene, lines, truncation=0.0)
    assert truncated.factor.shape[2] < 0.9 * whole.factor.shape[2]
    assert np.all(stiffness_of_law(truncated)[truncated.active] > 0)
    found, expected = solve(truncated), solve(whole)
    assert_allclose(found.approach, expected.approach, rtol=0.02 * TRUNCATION)
    assert_allclose(found.stiffness, expected.stiffness, rtol=0.02 * TRUNCATION)
