"""The reference of a scene: the same pair, load, gaps and contact law, its smooth compliance by finite elements."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from gearbench.effects.base import Effect, ToothCompliance
from gearbench.effects.gear_body import GearBody
from gearbench.effects.tooth_bending import ToothBending, tooth_bending
from gearbench.errors import InputError
from gearbench.geometry.role import Role
from gearbench.scene import Scene

if TYPE_CHECKING:
    from gearbench.compliance.flank import FlankCompliance


def smooth_effects(scene: Scene) -> tuple[ToothCompliance, ...]:
    """Effects of ``scene`` that add compliance which spreads over the flank: all but the law of the local contact."""
    return tuple(effect for effect in scene.effects if isinstance(effect, ToothCompliance))


def reference_scene(scene: Scene, accuracy: float = 0.01) -> Scene:
    """``scene`` with its smooth compliances replaced by finite elements, on gear bodies where it has some.

    Parameters
    ----------
    accuracy
        Relative error of the compliance that the meshes are refined to.

    Raises
    ------
    InputError
        If there is nothing to compare: the scene runs on finite elements, or has no smooth compliance.
    """
    if tooth_bending(scene.effects_by_name, "finite_elements"):
        raise InputError("effects.tooth_bending.model", "finite_elements", "is the reference: give a fast model")
    smooth = smooth_effects(scene)
    if not smooth:
        raise InputError("effects", "no smooth compliance", "nothing to compare: add tooth_bending")
    kept: list[Effect] = [effect for effect in scene.effects if effect not in smooth]
    if scene.effect(GearBody.name) is not None:
        kept.insert(0, GearBody())
    return replace(scene, effects=(ToothBending(model="finite_elements", accuracy=accuracy), *kept))


def finite_elements(reference: Scene) -> ToothBending:
    """The tooth of a reference."""
    tooth = tooth_bending(reference.effects_by_name, "finite_elements")
    assert tooth is not None
    return tooth


def meshed_flanks(reference: Scene) -> tuple[FlankCompliance, FlankCompliance]:
    """Compliances of the flanks of pinion and wheel of a reference."""
    tooth, beside = finite_elements(reference), reference.effects_by_name
    return tooth.flank(reference.pair, Role.PINION, beside), tooth.flank(reference.pair, Role.WHEEL, beside)
