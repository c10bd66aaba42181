"""Three-way comparison with contact finite elements: what it refuses, and what it says; curves from closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from fem_reference.contact.spatial import SpatialSettings
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.errors import InputError
from gearbench.results.netcdf import open_result
from gearbench.validation import contact
from studies.s08_contact.data import scene


@pytest.fixture
def cycle(monkeypatch) -> list[int]:
    """In place of the contact finite elements a curve that is known: 1.01 times the fast one; calls are counted.

    The wheel stands at the uniform phases, the fast teeth half-way between it and the pinion, which is ahead by it.
    """
    calls = []

    def known(scene, phases, *, settings, report):
        assert isinstance(settings, SpatialSettings)  # spur pairs have their free faces too
        report("phase 1 of 1")
        calls.append(phases)
        wheel = (np.arange(phases) + 0.5) / phases
        ste = np.zeros(phases)
        for _ in range(6):  # each step gains the slope of the curve over the base pitch
            fast = contact.model_cycle(scene, wheel + 1e-3 * ste / scene.pair.meshing.base_pitch / 2)
            ste = 1.01 * fast.transmission_error
        share = np.zeros((phases, 2))
        share[:, 0], share[0, 1] = 1.0, 0.25
        share[0, 0] = 0.75
        found = xr.Dataset(
            {
                "transmission_error": ("position", ste),
                "mesh_stiffness": ("position", fast.mesh_stiffness / 1.01),
                "transmission_error_uncertainty": 0.02,
                "load_share": (("position", "pair"), share),
            },
            coords={"mesh_phase": ("position", wheel), "pair_index": ("pair", [0, -1])},
        )
        return found.assign_attrs(wall_time_s=1.0, method="known")

    monkeypatch.setattr("fem_reference.contact.cycle.contact_cycle", known)
    # finite elements on lines: the fast teeth
    monkeypatch.setattr(contact, "reference_scene", lambda scene, accuracy: scene)
    return calls


def test_parts_add_up_and_load_outside_the_path_is_seen(cycle, tmp_path):
    found = contact.compare_contact(scene("spur"), 4)
    assert cycle == [4]
    assert list(found.model.values) == ["fast", "off_line", "lines", "contact"]
    np.testing.assert_allclose(found.residual[3], 0, atol=1e-15)
    ste = found.transmission_error
    np.testing.assert_allclose(ste.sel(model="contact"), 1.01 * ste.sel(model="fast"), rtol=1e-12)
    np.testing.assert_allclose(found.residual[0], found.residual[2])
    assert 0.01 < float(found.residual[0]) < 0.0102
    # pair −1 is before the path at every phase
    np.testing.assert_allclose(found.share_outside_path, [0.25, 0, 0, 0])
    first, second, third = contact.findings(found)
    assert f"{100 * float(found.residual[1]):.2f} % off" in third
    assert "fast model 1.0" in first
    assert "+0.000 µm compliance" in second
    written = contact.write([found, found], tmp_path)
    assert sorted(path.name for path in written) == ["contact-1.nc", "contact-1.png", "contact-2.nc", "contact-2.png"]
    assert open_result(tmp_path / "contact-1.nc").attrs["method"] == "known"


def test_scenes_without_a_comparison_are_refused():
    one = scene("spur")
    fast = replace(one, effects=tuple(effect for effect in one.effects if effect.name != "gear_body"))
    with pytest.raises(InputError, match=r"spur\.toml.*gear_body"):
        contact.check(fast, "spur.toml")
    pair = replace(one.pair, wheel=replace(one.pair.wheel, bore_diameter=None))
    bare = replace(fast, pair=pair)
    with pytest.raises(InputError, match="bore_diameter"):
        contact.check(bare)
    contact.check(one)


def test_a_scene_with_contact_off_the_line_is_compared_as_it_is(cycle):
    one = scene("spur")
    found = contact.compare_contact(replace(one, effects=(*one.effects, OffLineContact())), 4)
    assert list(found.model.values) == ["fast", "lines", "contact"]
    assert len(contact.findings(found)) == 2
