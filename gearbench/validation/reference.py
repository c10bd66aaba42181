"""The reference of a scene: the same pair, load, gaps and contact law, its smooth compliance by finite elements."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from gearbench.effects.base import ToothCompliance
from gearbench.effects.fe_compliance import BODY_EFFECTS, FeCompliance
from gearbench.errors import InputError
from gearbench.scene import Scene


def smooth_effects(scene: Scene) -> tuple[ToothCompliance, ...]:
    """Effects of ``scene`` that add compliance which spreads over the flank: all but the law of the local contact."""
    return tuple(effect for effect in scene.effects if isinstance(effect, ToothCompliance))


def support(scene: Scene) -> Literal["clamped", "rim"]:
    """How the reference of ``scene`` is held: "rim" where an effect of the scene stands for the gear body."""
    return "rim" if any(scene.effect(name) is not None for name in BODY_EFFECTS) else "clamped"


def reference_scene(scene: Scene, accuracy: float = 0.01) -> Scene:
    """``scene`` with its smooth compliances replaced by ``fe_compliance``; all else stays.

    Parameters
    ----------
    accuracy
        Relative error of the compliance that the meshes are refined to.

    Raises
    ------
    InputError
        If there is nothing to compare: the scene runs on finite elements, or has no smooth compliance; or if the
        reference needs bores that the pair does not have.
    """
    if scene.effect(FeCompliance.name) is not None:
        raise InputError(f"effects.{FeCompliance.name}", "given", "is the reference: give a scene with a fast model")
    smooth = smooth_effects(scene)
    if not smooth:
        raise InputError("effects", "no smooth compliance", "nothing to compare: add tooth_bending")
    held = support(scene)
    for name, member in (("pinion", scene.pair.pinion), ("wheel", scene.pair.wheel)):
        if held == "rim" and member.bore_diameter is None:
            raise InputError(f"pair.{name}.bore_diameter", "missing", "the reference with the gear body needs it")
    others = tuple(effect for effect in scene.effects if effect not in smooth)
    return replace(scene, effects=(FeCompliance(support=held, accuracy=accuracy), *others))


def finite_elements(reference: Scene) -> FeCompliance:
    """The ``fe_compliance`` of a reference."""
    effect = reference.effect(FeCompliance.name)
    assert isinstance(effect, FeCompliance)
    return effect
