"""Errors over the mesh cycle: known signals, known differences; the reference keeps all but the compliance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.effects.crowning import Crowning
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.library.garambois2017 import case
from gearbench.results.cycle import Phases
from gearbench.scene import Resolution
from gearbench.validation.reference import reference_scene
from gearbench.validation.ste_error import cycle_errors, load_share_error, relative_error


def cycle(amplitudes: dict[int, float], mean: float, share: np.ndarray):
    """Dataset of 64 uniform positions: STE and stiffness with the given harmonics."""
    import xarray as xr

    phases = Phases(phase=np.arange(64) / 64, weight=np.full(64, 1 / 64), size=None)
    tau = phases.phase
    # phases differ from harmonic to harmonic: an amplitude does not depend on them
    wave = mean + sum(a * np.cos(2 * np.pi * n * tau + n) for n, a in amplitudes.items())
    data: dict[str, tuple] = {name: ("position", values) for name, values in phases.coordinates.items()}
    for name, factor in (("transmission_error", 1.0), ("mesh_stiffness", 10.0)):
        data[name] = ("position", factor * wave)
        data[f"{name}_mean"] = ((), factor * wave.mean())
        data[f"{name}_peak_to_peak"] = ((), factor * np.ptp(wave))
    data["load_share"] = (("position", "pair"), share)
    return xr.Dataset(data)


def test_errors_of_known_signals():
    even = np.full((64, 2), 0.5)
    fast, reference = cycle({1: 3.0, 2: 1.5, 4: 0.2}, 22.0, even), cycle({1: 2.0, 2: 2.5, 3: 0.5}, 20.0, even)
    found = {name: value for name, (_, value) in cycle_errors(fast, reference).items()}
    for name in ("transmission_error", "mesh_stiffness"):
        assert found[f"{name}_mean_error"] == pytest.approx(10.0, rel=1e-12)
        expected = 100 * (float(fast[f"{name}_peak_to_peak"]) / float(reference[f"{name}_peak_to_peak"]) - 1)
        assert found[f"{name}_peak_to_peak_error"] == pytest.approx(expected, rel=1e-12)
        # relative to the fundamental of the reference: (3 − 2)/2, (1.5 − 2.5)/2, −0.5/2, 0.2/2, 0
        assert_allclose(found[f"{name}_amplitude_error"], [50, -50, -25, 10, 0], atol=1e-10)
    assert_allclose(found["transmission_error_amplitude"], [[3, 1.5, 0, 0.2, 0], [2, 2.5, 0.5, 0, 0]], atol=1e-13)
    assert (found["load_share_error_max"], found["load_share_error_rms"]) == (0, 0)


def test_relative_error_is_signed_and_undefined_for_a_reference_of_zero():
    assert_allclose(relative_error([1.1, 0.9, 1.0], [1.0, 1.0, 0.0]), [10, -10, np.nan], rtol=1e-12)


def test_load_share_errors_count_only_pairs_in_contact():
    """Two positions of weights 3/4 and 1/4; the third pair never touches, the second touches in one model only."""
    share = np.array([[1.0, 0.0, 0.0], [0.6, 0.4, 0.0]])
    reference = np.array([[0.9, 0.1, 0.0], [0.8, 0.2, 0.0]])
    largest, rms = load_share_error(share, reference, np.array([0.75, 0.25]))
    assert largest == pytest.approx(0.2)
    assert rms == pytest.approx(np.sqrt((0.75 * 2 * 0.01 + 0.25 * 2 * 0.04) / (0.75 * 2 + 0.25 * 2)))


def test_the_reference_keeps_all_but_the_compliance_of_the_teeth():
    law, crowning = Hertz(law="yang_sun"), Crowning(amount=4.0)
    scene = replace(
        case(2), effects=(ToothBending(model="solid"), law, crowning), resolution=Resolution(positions=7, segments=9)
    )
    reference = reference_scene(scene, 0.02)
    assert reference.effects == (ToothBending(model="finite_elements", accuracy=0.02), law, crowning)
    assert replace(reference, effects=scene.effects) == scene


def test_a_scene_with_a_body_is_compared_with_teeth_on_a_body():
    from gearbench.effects.gear_body import GearBody

    scene = case(1)
    bores = {"pinion": 200.0, "wheel": 500.0}
    members = {name: replace(getattr(scene.pair, name), bore_diameter=bore) for name, bore in bores.items()}
    scene = replace(scene, pair=replace(scene.pair, **members), effects=(*scene.effects, GearBody(coupled=False)))
    assert reference_scene(scene).effects[:2] == (ToothBending(model="finite_elements"), GearBody())
