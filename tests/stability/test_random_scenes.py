"""Thousands of seeded random scenes and gap vectors: solved to 1e-9, in few steps, and mirrored by their mirror."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.solver import solve
from gearbench.scene import Load, Scene
from tests.stability.measure import compare
from tests.stability.random_scenes import random_scenes, with_random_gaps
from tests.support.campaign import many
from tests.support.contact_invariants import assert_solved, mirrored, wheel_drives

SEED = 20


def run(count: int) -> None:
    for i, (scene, rng) in enumerate(random_scenes(SEED, count)):
        what = (i, scene)
        tau = np.append(rng.random(2), rng.choice(scene.pair.meshing.transition_phases))
        problem = assemble(scene, scene_lines(scene, tau))
        s = solve(problem)
        assert_solved(s, what)
        assert_solved(solve(with_random_gaps(problem, rng)), what)
        if i % 10 == 0:
            heavier = replace(scene, load=Load(torque=1.3 * scene.load.torque))
            more = solve(assemble(heavier, scene_lines(heavier, tau)))
            assert np.all(more.approach > s.approach), what
            mirrors(scene, tau[:2], what)


def mirrors(scene: Scene, tau: np.ndarray, what: object) -> None:
    """The wheel drives: the same answers at the mirrored phases."""
    if np.abs(tau[:, None] - np.array(scene.pair.meshing.transition_phases)).min() < 1e-6:
        return
    try:
        other, offset = wheel_drives(scene)
    except ValidationError:  # at a limit of the input, where rounding decides
        return
    lines, images = scene_lines(scene, tau), scene_lines(other, mirrored(scene.pair, tau))
    # where alike panels share an odd segment, its mirror image has it on the other one: discretisation errors differ
    alike = np.allclose(np.sort(lines.length.reshape(2, -1)), np.sort(images.length.reshape(2, -1)), rtol=1e-6)
    a, b = solve(assemble(scene, lines, truncation=0.0)), solve(assemble(other, images, truncation=0.0))
    # the phase is rounded: a short line's length, and so its share, to 1e-16 / length
    rtol = 1e-8 if alike else 1e-3
    assert_allclose(b.approach + offset, a.approach, rtol=rtol, atol=1e-12 * abs(offset), err_msg=str(what))


@pytest.mark.parametrize("count", [150, pytest.param(many(4000), marks=pytest.mark.slow)])
def test_random_scenes_and_gap_vectors(count):
    run(count)


@pytest.mark.parametrize("count", [8, pytest.param(many(100), marks=pytest.mark.slow)])
def test_random_scenes_keep_their_digits(count):
    """Against the whole chain in extended precision, at one phase; scenes of low order, which are quick there."""
    for scene, rng in random_scenes(SEED + 1, count):
        bending = scene.effect("tooth_bending")
        if bending is not None and bending.order is not None and np.prod(bending.order) > 9:
            continue
        tau = float(rng.random())
        if np.abs(tau - np.array(scene.pair.meshing.transition_phases)).min() < 1e-6:
            continue
        found = compare(scene, (tau,))
        assert found.least >= 10, (scene, tau, found)
