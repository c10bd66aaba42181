"""A gear type of one's own: teeth whose root is an ellipse, in one file, registered and simulated like any other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import simulate
from gearbench.compliance.outline import tooth_outline
from gearbench.errors import InputError
from gearbench.geometry.blank import RACK, RackCut, blank_of, register
from gearbench.geometry.gear import Gear
from gearbench.scene_file import parse_scene


@dataclass(frozen=True)
class Ellipse:
    """Quarter of an ellipse in (ψ, R), from the root circle to where the involute leaves the base circle radially.

    R = r_f + h (1 − cos φ), ψ = ψ_e + a (1 − sin φ), φ = 0 … π/2.
    """

    root: float
    base: float
    foot: float
    top: float
    phi_end: float = math.pi / 2

    def radius(self, phi):
        return self.root + (self.base - self.root) * (1 - np.cos(phi))

    def half_angle(self, phi):
        return self.top + (self.foot - self.top) * (1 - np.sin(phi))

    def parameter(self, radius):
        return np.arccos(np.clip(1 - (np.asarray(radius) - self.root) / (self.base - self.root), 0.0, 1.0))

    def along(self, phi):
        h, a = self.base - self.root, self.foot - self.top
        return 2 * h * np.sin(phi / 2) ** 2, h * np.sin(phi), self.half_angle(phi), -a * np.cos(phi)


@dataclass(frozen=True)
class EllipticRoot:
    """Form-ground gear with elliptic roots that take a share of the gap between the teeth, its body on its bore."""

    share: float

    def root_radius(self, gear: Gear) -> float:
        return RackCut().root_radius(gear)

    def root_curve(self, gear: Gear) -> Ellipse:
        if self.root_radius(gear) >= gear.base_radius:
            raise InputError("teeth", gear.teeth, "elliptic roots are for gears whose root lies below the base circle")
        top = float(gear.involute_half_angle(gear.base_radius))
        foot = top + self.share * (math.pi / gear.teeth - top)
        return Ellipse(root=self.root_radius(gear), base=gear.base_radius, foot=foot, top=top)

    def junction(self, gear: Gear) -> float:
        return math.pi / 2

    def is_undercut(self, gear: Gear) -> bool:
        return False

    def support(self, gear: Gear, bore_diameter: float) -> float:
        return RackCut().support(gear, bore_diameter)


register("elliptic", EllipticRoot(0.6))
register("slim", EllipticRoot(0.05))
register("rack_again", RackCut())


def scene(blank, model="solid", teeth=23):
    gear = {"teeth": teeth, "bore_diameter": 20.0, "blank": blank}
    pair = {
        "normal_module": 2.0, "helix_angle": 12.0, "face_width": 20.0,
        "centre_distance": 2 * teeth / math.cos(math.radians(12.0)), "pinion": gear, "wheel": dict(gear),
    }  # fmt: skip
    effects = {"tooth_bending": {"model": model}, "hertz": {}, "off_line_contact": {}}
    if model == "plate":
        effects["tooth_bending"]["fillet"] = True
    else:
        effects["gear_body"] = {}
    return parse_scene({"pair": pair, "load": {"torque": 60.0}, "effects": effects, "resolution": {"positions": 8}})


def test_its_tooth_has_the_area_of_its_outline():
    gear = scene("elliptic").pair.gears[0]
    x, weight, e, slope = tooth_outline(gear, 24)
    R = np.linspace(gear.root_radius, gear.tip_radius, 200_001)
    assert_allclose(2 * weight @ e, np.trapezoid(gear.transverse_thickness(R), R), rtol=1e-6)
    assert_allclose(e, gear.half_angle(gear.root_radius + x) * (gear.root_radius + x), rtol=1e-9)
    step = 1e-6
    there = (x > 0.1) & (x < gear.tooth_height - 0.1)
    at = gear.root_radius + x[there]
    numeric = ((at + step) * gear.half_angle(at + step) - (at - step) * gear.half_angle(at - step)) / (2 * step)
    assert_allclose(slope[there], numeric, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("model", ["plate", "solid"])
def test_it_is_simulated_and_thicker_roots_are_stiffer(model):
    mean = {blank: float(simulate(scene(blank, model))["mesh_stiffness_mean"]) for blank in ("slim", RACK, "elliptic")}
    assert mean["slim"] < 0.99 * mean[RACK]
    assert mean["slim"] < 0.97 * mean["elliptic"]
    assert mean["elliptic"] == pytest.approx(mean[RACK], rel=0.1)


@pytest.mark.slow
def test_its_solid_tooth_on_its_body_is_that_of_finite_elements():
    exact = simulate(scene("elliptic", "finite_elements"))
    found = simulate(scene("elliptic"))
    assert_allclose(found["mesh_stiffness_mean"], exact["mesh_stiffness_mean"], rtol=0.01)


def test_a_blank_like_the_rack_is_the_rack():
    for name in ("transmission_error", "mesh_stiffness"):
        own, rack = (simulate(scene(blank))[name] for blank in ("rack_again", RACK))
        np.testing.assert_array_equal(own, rack)


def test_faults_are_one_line():
    with pytest.raises(InputError, match="below the base circle") as caught:
        scene("elliptic", teeth=60)
    assert caught.value.key == "pair.pinion.teeth"
    with pytest.raises(InputError, match="elliptic"):
        scene("eliptic")
    with pytest.raises(InputError, match="another blank"):
        register("elliptic", EllipticRoot(0.7))
    with pytest.raises(InputError, match="cut by a rack"):
        simulate(scene("elliptic"), outputs=["root_stress"])
    assert blank_of("elliptic") == EllipticRoot(0.6)
