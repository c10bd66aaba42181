"""Manufacturing errors: shapes, signs, amplitudes and distributions."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats

from gearbench.contact.assemble import assemble
from gearbench.effects.distributions import DISTRIBUTIONS
from gearbench.effects.manufacturing_errors import PRESETS, ErrorKind, ManufacturingErrors
from gearbench.errors import InputError
from gearbench.geometry.action import contact_lines
from gearbench.library.garambois2017 import gear
from gearbench.scene_file import parse_scene
from gearbench.tolerances import gear_tolerances

PAIR = gear("24").scene().pair
KINDS = ("profile_slope", "profile_form", "helix_slope", "helix_form", "inclination", "deviation")


def only(kind: str, **options) -> ManufacturingErrors:
    return ManufacturingErrors(**{kind: ErrorKind(amplitude=4.0, **options)})


def dense_lines():
    return contact_lines(PAIR, np.linspace(0, 1, 400, endpoint=False), 60)


@pytest.mark.parametrize("kind", KINDS[:4])
@pytest.mark.parametrize("gear_name", ["pinion", "wheel"])
def test_shapes_span_a_micrometre_and_are_zero_in_the_middle(kind, gear_name):
    lines = dense_lines()
    gap = only(kind, gear=gear_name).modes(lines)[np.repeat(lines.active[..., None], 60, axis=-1)]
    # segment centres come within half a segment, 1/120 of the face, of the edges: 4/120 of a parabola
    ends = [-0.5e-3, 0.5e-3] if kind.endswith("slope") else [0.0, 1e-3]
    assert_allclose([gap.min(), gap.max()], ends, atol=4e-5)


def test_signs_positive_is_missing_at_the_tip_and_at_the_ends():
    lines = dense_lines()
    r1, r2 = lines.radii
    for index, (name, radius) in enumerate((("pinion", r1), ("wheel", r2))):
        slope = only("profile_slope", gear=name).modes(lines)[..., 0]
        assert np.corrcoef(slope[lines.active].ravel(), radius[lines.active].ravel())[0, 1] > 0.99
        barrel = only("profile_form", gear=name).modes(lines)[..., 0]
        assert barrel[radius == radius[lines.active].max()].min() > 0.9e-3
        start, end = PAIR.meshing.active_radii[index]
        middle = np.abs(radius - (start + end) / 2) < 0.02 * (end - start)
        # the middle of the radius is not quite the middle of the roll length: (2 · 0.11)² of 1 µm at most
        assert barrel[middle].max() < 5.2e-5
    lead = only("helix_slope", gear="pinion").modes(lines)[..., 0]
    assert_allclose(lead, 1e-3 * (lines.y / PAIR.face_width - 0.5), atol=1e-17)
    assert_allclose(
        only("helix_form", gear="pinion", sign=-1).modes(lines), -only("helix_form", gear="pinion").modes(lines)
    )


@pytest.mark.parametrize("kind", ["profile_slope", "profile_form"])
def test_profile_shapes_are_linear_and_parabolic_in_the_coordinate_asked_for(kind):
    lines = dense_lines()
    degree = 1 if kind == "profile_slope" else 2
    for along, x in (("roll", lines.u), ("radius", lines.radii[0])):
        errors = replace(only(kind, gear="pinion"), along=along)
        active = np.broadcast_to(lines.active[..., None], lines.shape)
        y, x = errors.modes(lines)[..., 0][active], x[active]
        fit = np.polynomial.Polynomial.fit(x, y, degree)
        assert_allclose(fit(x), y, atol=1e-14)


def test_axis_errors_are_the_misalignment_effect():
    from gearbench.effects.misalignment import Misalignment

    lines = dense_lines()
    for kind in ("inclination", "deviation"):
        assert_allclose(only(kind).modes(lines)[..., 0], Misalignment(**{kind: 1.0}).gap(lines), rtol=1e-14)


def test_amplitudes_come_from_the_class_and_edition():
    errors = ManufacturingErrors(iso_class=6, edition="1995", **{kind: ErrorKind() for kind in KINDS})
    tolerance = gear_tolerances(PAIR.gears[0], 6, "1995")
    amplitude = {mode.name: mode.amplitude for mode in errors.error_modes(PAIR)}
    assert amplitude["profile_slope_pinion"] == tolerance.profile_slope
    assert amplitude["profile_form_wheel"] == tolerance.profile_form
    assert amplitude["helix_slope_wheel"] == tolerance.helix_slope
    assert amplitude["inclination"] == tolerance.helix_total
    assert amplitude["deviation"] == tolerance.helix_total / 2
    assert len(amplitude) == 10
    exchanged = replace(errors, profile_slope=ErrorKind(tolerance="profile_form"))
    assert exchanged.error_modes(PAIR)[0].amplitude == tolerance.profile_form


def test_each_tooth_its_own_error_moves_only_its_own_pair():
    lines = dense_lines()
    shared, own = only("helix_form", gear="pinion"), only("helix_form", gear="pinion", drawn="tooth")
    modes = own.modes(lines)
    assert modes.shape[-1] == len(lines.index)
    assert_allclose(modes.sum(axis=-1), shared.modes(lines)[..., 0], rtol=1e-14)
    for i in range(len(lines.index)):
        others = np.delete(modes[..., i], i, axis=1)
        assert not others.any()


@pytest.mark.parametrize(("name", "law"), DISTRIBUTIONS.items(), ids=DISTRIBUTIONS.keys())
def test_distributions_have_the_moments_they_state(name, law):
    u = (np.arange(200_000) + 0.5) / 200_000
    values = law.quantile(u)
    expected = {
        "uniform": stats.uniform(0, 1),
        "uniform_two_sided": stats.uniform(-1, 2),
        "normal": stats.truncnorm(-3, 3, 0.5, 1 / 6),
        "normal_two_sided": stats.truncnorm(-3, 3, 0.0, 1 / 3),
    }
    if name == "fixed":
        assert_array_equal(values, 1.0)
        return
    # midpoint rule of the quantile function: 1e-5 for 2e5 points
    assert_allclose([values.mean(), values.std()], [expected[name].mean(), expected[name].std()], atol=1e-5)
    assert_allclose(values, expected[name].ppf(u), atol=1e-9)
    assert_allclose(law.mean, expected[name].mean(), atol=1e-12)


def test_the_scene_is_simulated_at_the_mean_errors():
    scene = gear("24").scene(errors=True)
    lines = contact_lines(scene.pair, [0.3], 5)
    errors = scene.effect("manufacturing_errors")
    plain = replace(scene, effects=scene.effects[:-1])
    extra = (assemble(scene, lines).gap - assemble(plain, lines).gap) * assemble(scene, lines).length_scale
    assert_allclose(extra.reshape(lines.shape), errors.modes(lines) @ errors.mean(scene.pair), atol=1e-15)


def test_the_preset_is_its_convention_written_out():
    lines = dense_lines()
    assert_array_equal(ManufacturingErrors(preset="garambois2017").modes(lines), PRESETS["garambois2017"].modes(lines))


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({}, "effects.manufacturing_errors"),
        ({"preset": "garambois"}, "effects.manufacturing_errors.preset"),
        ({"preset": "garambois2017", "iso_class": 6}, "effects.manufacturing_errors.iso_class"),
        ({"preset": "garambois2017", "helix_form": {}}, "effects.manufacturing_errors.helix_form"),
        ({"profile_slope": {}}, "effects.manufacturing_errors.profile_slope.amplitude"),
        ({"iso_class": 13, "profile_slope": {}}, "effects.manufacturing_errors.iso_class"),
        ({"iso_class": 12, "profile_slope": {}}, "effects.manufacturing_errors.iso_class"),
        ({"iso_class": 6, "profile_slope": {"distribution": "gamma"}}, "profile_slope.distribution"),
        ({"iso_class": 6, "profile_slope": {"amplitude": -1.0}}, "profile_slope.amplitude"),
        ({"iso_class": 6, "edition": "2020", "profile_slope": {}}, "effects.manufacturing_errors.edition"),
    ],
)
def test_bad_input_names_its_key(table, key):
    tables = gear("24").scene().to_mapping()
    tables["effects"]["manufacturing_errors"] = table
    with pytest.raises(InputError) as caught:
        parse_scene(tables)
    assert key in caught.value.key
    assert "\n" not in str(caught.value)
