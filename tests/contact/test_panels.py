"""Panels of the mesh cycle end at transitions of the contact and grow from load transfers; steep curves converge."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.panels import CLOSE, FIRST_PANEL, GROWTH, Transition, panel_starts
from gearbench.contact.patches import solve_patches
from gearbench.contact.phases import gauss_phases
from gearbench.contact.transitions import transitions
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.results.cycle import CycleCurve, Phases, coefficients
from tests.accuracy.test_resolution import example

PHASES = st.floats(0.0, 0.999)
CHANGES = st.lists(st.builds(Transition, PHASES, st.integers(0, 1), st.integers(-1, 1)), max_size=8)


@given(CHANGES, st.sampled_from([0.2, 0.35, 1.0]))
def test_panels_are_in_the_cycle_and_no_longer_than_allowed(transitions, longest):
    ends = panel_starts(transitions, longest)
    assert ends[0] == 0.0
    widths = np.diff([*ends, 1.0])
    assert np.all(widths > 0)
    assert widths.max() <= longest * (1 + 1e-9)


@given(CHANGES)
def test_every_change_is_an_end_or_close_to_one(transitions):
    ends = np.array([*panel_starts(transitions), 1.0])
    for transition in transitions:
        assert np.abs(ends - transition.phase).min() <= CLOSE[transition.rank] + 1e-12


@given(PHASES, st.sampled_from([1, -1]))
def test_panels_grow_from_a_load_transfer(phase, side):
    ends = panel_starts([Transition(phase, 0, side)])
    at = min(ends, key=lambda end: abs((end - phase + 0.5) % 1.0 - 0.5))
    distances = [*sorted(side * (end - at) % 1.0 for end in ends), 1.0]
    for near, far in pairwise(distances):
        assert far <= max(FIRST_PANEL, GROWTH * near) + 0.01  # of a load transfer close to 0 the panels end there


def steep(x):
    """Rises like one over the logarithm from its load transfer at 0.3."""
    t = np.maximum((x - 0.3) % 1.0, 1e-300)
    return 1 / (2 - np.log(t)) + 0.1 * np.cos(2 * np.pi * t)


def test_a_steep_curve_is_resolved_next_to_its_load_transfer_only():
    def curve(ends):
        phase, weight = gauss_phases(ends, 5)
        return Phases(phase=phase, weight=weight, size=5), steep(phase)

    exact = coefficients(*curve([*(0.3 + 0.5 ** np.arange(40)), *np.arange(20) / 20, 0.3]), 8)
    span = 0.5
    plain, grown = ([0.0, 0.3], panel_starts([Transition(0.3, 0, 1)]))
    errors = [np.abs(coefficients(*curve(ends), 8) - exact).max() / span for ends in (plain, grown)]
    assert errors[1] < 2e-3
    assert errors[0] > 4 * errors[1]


def test_the_range_of_a_curve_too_steep_for_its_panel_does_not_run_beyond_it():
    """From level 1 it drops at 0.6 by 0.6 and rises again like a root: the polynomial there does not know 0.4."""
    phase, weight = gauss_phases([0.0, 0.6, 0.64], 5)
    phases = Phases(phase=phase, weight=weight, size=5)
    early = np.where(
        (phase > 0.6) & (phase < 0.605),
        1.0,
        np.where(phase < 0.6, 1.0, 0.4 + 0.6 * np.sqrt(np.maximum(phase - 0.6, 0) / 0.4)),
    )
    assert np.ptp(early) <= CycleCurve(phases=phases, values=early).peak_to_peak <= 1.1 * np.ptp(early)


def apart(phase: float, other: float) -> float:
    """How far two phases of the periodic mesh cycle are apart."""
    return abs((phase - other + 0.5) % 1.0 - 0.5)


@pytest.mark.parametrize(("name", "torque"), [("nasa_28", 71.8), ("rim_17_43", 8.0), ("thin_rim", -180.0)])
def test_load_transfers_beyond_the_path_of_contact_are_found(name, torque):
    """Off the line of action lines of a spur pair reach a little beyond it: on either side another number carries."""
    scene = example(name)
    effects = [effect for effect in scene.effects if effect.name in ("tooth_bending", "gear_body", "hertz")]
    scene = replace(scene, effects=(*effects, OffLineContact()), load=replace(scene.load, torque=torque))
    ends = scene.pair.meshing.phases_at((scene.pair.meshing.path_start, scene.pair.meshing.path_end))
    transfers = [c.phase for c in transitions(scene) if c.side and min(apart(c.phase, at) for at in ends) > 1e-9]
    assert len(transfers) == 2
    phases = (np.array(transfers)[:, None] + 1e-3 * np.array([-1.0, 1.0])).ravel() % 1.0
    solution = solve_patches(assemble(scene, scene_lines(scene, phases)))
    loaded = np.count_nonzero(solution.force.sum(axis=2) > 0, axis=1).reshape(-1, 2)
    assert np.all(loaded[:, 0] != loaded[:, 1])
