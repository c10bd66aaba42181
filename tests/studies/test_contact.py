"""The stored curves of the contact finite elements: fast teeth with contact off the line keep to them. No CalculiX."""

import numpy as np
import pytest

from fem_reference.contact.cycle import halfway, widened
from fem_reference.contact.result import PhaseResult
from gearbench.compliance.edge import edge_softening
from gearbench.effects.hertz import law_table
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.results.netcdf import open_result
from studies.s08_contact.data import CASES, fast, scene
from studies.s08_contact.findings import harmonics, levels, off_line
from studies.s08_contact.width import WIDE
from studies.s08_contact.width import checks as checks_of_width
from tests.support.paths import ROOT
from tests.support.stored import stored


def test_fast_teeth_off_the_line_keep_to_the_stored_curves():
    """As they are today, not as they were when the curves were stored."""
    kept = stored("s08_contact")
    for row in range(kept.sizes["design"]):
        here = kept.isel(design=row)
        given = CASES[str(here.case.values)].scene
        found = fast(given, float(here.torque), halfway(here, given.pair), OffLineContact()).transmission_error
        for text, holds in off_line(here.assign(off_line_transmission_error=("position", found))):
            assert holds, text


@pytest.mark.parametrize("name", WIDE)
def test_light_loads_reliefs_and_helices_keep_to_finite_elements_of_finite_width(name):
    """Mean, RMS, peak-to-peak and harmonics 1 to 5 of every curve, by the fast teeth as they are today."""
    exact = open_result(ROOT / "studies" / "s08_contact" / f"{name}.nc")
    expected = [(which, torque) for which, torques in WIDE[name].curves.items() for torque in torques]
    assert list(zip(exact.case.values, exact.torque.values, strict=True)) == expected
    found = checks_of_width(exact)
    assert len(found) == 9 * len(expected)
    for text, holds in found:
        assert holds, text


def test_bending_of_tilted_tips_does_not_matter(monkeypatch):
    """Tips that touch beyond the path bend less by some 36 χ c₁ than the fast teeth know: 0.5 % of the RMS at most.

    At twice the torque, where they are tilted most; see "Tips in the contact law" of docs/theory.md.
    """

    def stiffer(gear, c, mean, count, roll, tilt, rho, line_load):
        a, h = edge_softening(gear, c, mean, count, roll, tilt, rho, line_load)
        return a - 36 * c * tilt, h

    here, phases, before = scene("spur"), (np.arange(100) + 0.5) / 100, None
    for law in (edge_softening, stiffer):
        monkeypatch.setattr("gearbench.compliance.edge.edge_softening", law)
        law_table.cache_clear()
        found = fast(here, 200.0, phases, OffLineContact()).transmission_error
        before = found if before is None else before
    law_table.cache_clear()
    assert 0 < np.abs(found - before).max() < 0.3
    assert found.mean() == pytest.approx(before.mean(), rel=0.001)
    assert 1e-4 < abs(found.std() / before.std() - 1) < 0.005
    np.testing.assert_allclose(harmonics(found), harmonics(before), atol=0.02 * harmonics(before)[0])


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
