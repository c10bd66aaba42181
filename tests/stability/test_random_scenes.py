"""Thousands of seeded random scenes and gap vectors: solved to 1e-9, in few steps, and mirrored by their mirror."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.problem import ContactSolution
from gearbench.contact.solver import solve
from gearbench.scene import Load, Scene
from tests.stability.measure import compare
from tests.stability.random_scenes import random_scenes, with_random_gaps
from tests.support.campaign import many

#: Newton steps that no scene may need.
STEPS = 40
SEED = 20


@dataclass
class Record:
    """What was seen over a run."""

    solved: int = 0
    steps: int = 0
    equilibrium: float = 0.0
    complementarity: float = 0.0

    def take(self, s: ContactSolution, what: object) -> None:
        """Check one solution and keep its worst figures."""
        for values in (s.force, s.approach, s.stiffness):
            assert np.all(np.isfinite(values)), what
        assert s.force.min() >= 0, what
        assert s.stiffness.min() > 0, what
        self.solved += s.approach.size
        self.steps = max(self.steps, int(s.iterations.max()))
        self.equilibrium = max(self.equilibrium, float(s.equilibrium.max()))
        self.complementarity = max(self.complementarity, float(s.complementarity.max()))
        assert self.equilibrium <= 1e-9, what
        assert self.complementarity <= 1e-9, what
        assert self.steps <= STEPS, what


def run(count: int, record: Record) -> None:
    for i, (scene, rng) in enumerate(random_scenes(SEED, count)):
        what = (i, scene)
        tau = np.append(rng.random(2), rng.choice(scene.pair.meshing.transition_phases))
        problem = assemble(scene, scene_lines(scene, tau))
        s = solve(problem)
        record.take(s, what)
        record.take(solve(with_random_gaps(problem, rng)), what)
        if i % 10 == 0:
            more = solve(assemble(*_at(replace(scene, load=Load(torque=1.3 * scene.load.torque)), tau)))
            assert np.all(more.approach > s.approach), what
            mirrors(scene, tau[:2], what)


def _at(scene: Scene, tau: np.ndarray) -> tuple:
    return scene, scene_lines(scene, tau)


def mirrors(scene: Scene, tau: np.ndarray, what: object) -> None:
    """The wheel drives: the same answers at the mirrored phases."""
    pair, effects = scene.pair, []
    if np.abs(tau[:, None] - np.array(pair.meshing.transition_phases)).min() < 1e-6:
        return
    offset = 0.0
    for effect in scene.effects:
        if effect.name == "helix_slope":
            offset += 1e-3 * (effect.pinion + effect.wheel)
            effect = replace(effect, pinion=-effect.wheel, wheel=-effect.pinion)
        effects.append(effect)
    torque = scene.load.torque * pair.wheel.teeth / pair.pinion.teeth
    try:
        other = replace(scene, pair=pair.swapped(), effects=tuple(effects), load=Load(torque=torque))
    except ValidationError:  # at a limit of the input, where rounding decides
        return
    turned = (pair.meshing.transverse_contact_ratio - pair.meshing.overlap_ratio - tau) % 1.0
    (mine, lines), (mirrored, images) = _at(scene, tau), _at(other, turned)
    # where alike panels share an odd segment, its mirror image has it on the other one: discretisation errors differ
    alike = np.allclose(np.sort(lines.length.reshape(2, -1)), np.sort(images.length.reshape(2, -1)), rtol=1e-6)
    a, b = solve(assemble(mine, lines, truncation=0.0)), solve(assemble(mirrored, images, truncation=0.0))
    # the phase is rounded: a short line's length, and so its share, to 1e-16 / length
    rtol = 1e-8 if alike else 1e-3
    assert_allclose(b.approach + offset, a.approach, rtol=rtol, atol=1e-12 * abs(offset), err_msg=str(what))


@pytest.mark.parametrize("count", [150, pytest.param(many(4000), marks=pytest.mark.slow)])
def test_random_scenes_and_gap_vectors(count):
    record = Record()
    run(count, record)
    assert record.solved == count * 3 * 2
    print(record)


@pytest.mark.parametrize("count", [8, pytest.param(many(100), marks=pytest.mark.slow)])
def test_random_scenes_keep_their_digits(count):
    """Against the whole chain in extended precision, at one phase; scenes of low order, which are quick there."""
    worst = 17.0
    for scene, rng in random_scenes(SEED + 1, count):
        bending = scene.effect("tooth_bending")
        if bending is not None and bending.order is not None and np.prod(bending.order) > 9:
            continue
        tau = float(rng.random())
        if np.abs(tau - np.array(scene.pair.meshing.transition_phases)).min() < 1e-6:
            continue
        found = compare(scene, (tau,))
        worst = min(worst, found.least)
        assert found.least >= 10, (scene, tau, found)
    print(f"worst: {worst:.1f} digits")
