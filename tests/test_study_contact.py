"""The stored curves of the contact finite elements: fast teeth with contact off the line keep to them. No CalculiX."""

from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
import xarray as xr

from fem_reference.contact.cycle import widened
from fem_reference.contact.result import PhaseResult
from gearbench.contact.assemble import scene_lines
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.results.netcdf import load
from gearbench.scene import Load
from gearbench.solution import solve_lines
from studies.s08_contact import checks, figures
from studies.s08_contact.data import CASES, RELIEF_PHASES, RELIEF_TORQUES, fast, scene
from studies.s08_contact.findings import harmonics, levels, off_line


@pytest.fixture(scope="module")
def kept() -> xr.Dataset:
    """The stored Dataset: docs/validation.md stands on it."""
    with resources.as_file(resources.files("studies.s08_contact") / "dataset.nc") as path:
        return load(path)


def test_stored_curves_keep_their_limits(kept):
    for text, holds in checks(kept):
        assert holds, text


def test_fast_teeth_off_the_line_keep_to_the_stored_curves(kept):
    """As they are today, not as they were when the curves were stored."""
    for row in range(kept.sizes["design"]):
        here = kept.isel(design=row)
        found = fast(CASES[str(here.case.values)].scene, float(here.torque), kept.sizes["position"], OffLineContact())
        np.testing.assert_allclose(found.mesh_phase, here.mesh_phase, atol=1e-12)
        for text, holds in off_line(here.assign(off_line_transmission_error=found.transmission_error)):
            assert holds, text


def test_relieved_teeth_keep_to_finite_elements_of_finite_width():
    """From a tenth to twice the torque. Where the STE is all but flat (10, 50 N·m) 0.03 µm are more than 3 %."""
    with resources.as_file(resources.files("studies.s08_contact") / "relief.nc") as path:
        exact = load(path)
    given, phase = scene("spur_relief"), exact.mesh_phase.values
    assert (tuple(phase), tuple(exact.torque.values)) == (RELIEF_PHASES, RELIEF_TORQUES)
    assert str(exact.attrs["scene"]) == given.to_toml()
    for torque, fe in zip(RELIEF_TORQUES, exact.transmission_error.values, strict=True):
        here = replace(given, load=Load(torque=torque), effects=(*given.effects, OffLineContact()))
        found = solve_lines(here, scene_lines(here, phase), np.full(8, 1 / 8)).cycle.transmission_error
        assert np.sqrt(((found - fe) ** 2).mean()) < 0.005 * fe.mean()
        assert np.ptp(found) == pytest.approx(np.ptp(fe), abs=max(0.03 * np.ptp(fe), 0.035))
        assert found.std() == pytest.approx(fe.std(), abs=max(0.03 * fe.std(), 0.01))


def test_a_curve_beyond_a_limit_is_found(kept):
    worse = kept.copy(deep=True)
    worse["off_line_transmission_error"][0] = worse["line_transmission_error"][0]
    failed = [text for text, holds in checks(worse) if not holds]
    assert any("residual" in text for text in failed)
    assert any("RMS" in text for text in failed)
    worse = kept.copy(deep=True)
    worse["transmission_error"][0] *= 1.02
    assert any("mean" in text and "another program" in text for text, holds in checks(worse) if not holds)


def test_levels_and_harmonics_in_closed_form():
    phase = 2 * np.pi * (np.arange(20) + 0.5) / 20
    curve = 3 + 2 * np.cos(phase + 0.3) + 0.5 * np.sin(4 * phase)
    np.testing.assert_allclose(harmonics(curve), [2, 0, 0, 0.5, 0], atol=1e-12)
    assert levels(curve)["mean"] == pytest.approx(3)
    assert levels(curve)["RMS"] == pytest.approx(np.sqrt((2**2 + 0.5**2) / 2))


def test_free_faces_widen_deflections_not_gaps():
    """Springs in parallel behind gaps: softer by a factor, the same as by hand."""
    stiffness, gaps, force, factor = np.array([2e5, 3e5]), np.array([2e-3, 5e-3]), 8e3, 1.03
    q, soft = ((force + k @ gaps) / k.sum() for k in (stiffness, stiffness / factor))
    one = PhaseResult(approach=[q], stiffness=[stiffness.sum()], share={}, radius={})
    np.testing.assert_allclose(widened([one], np.array([[force]]), factor), [[soft]], rtol=1e-12)
    assert soft < factor * q


def test_figures_come_from_the_stored_dataset(kept, tmp_path):
    figures(kept, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["curves.png"]
