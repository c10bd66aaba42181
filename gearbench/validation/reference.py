"""Reference of a scene: same pair, load, gaps and contact law, but smooth compliance by finite elements."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

from numpy.typing import NDArray

from gearbench.compliance.flank import FlankCompliance
from gearbench.contact.size import contact_memory
from gearbench.effects.base import Dense, Effects, FlankPair, LowRank, ToothCompliance
from gearbench.effects.gear_body import GearBody
from gearbench.effects.teeth import Tooth
from gearbench.effects.tooth_bending import ToothBending, tooth_bending
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene

if TYPE_CHECKING:
    from fem_reference.refinement import Level


def smooth_effects(scene: Scene) -> tuple[ToothCompliance, ...]:
    """Effects of ``scene`` with compliance that is smooth over the flank: all but the local contact law."""
    return tuple(effect for effect in scene.effects if isinstance(effect, ToothCompliance))


def reference_scene(scene: Scene, accuracy: float = 0.01) -> Scene:
    """Replace the smooth compliances of a pair or set by finite elements, with gear bodies if the scene has them.

    Parameters
    ----------
    accuracy
        Relative error of the compliance.

    Raises
    ------
    InputError
        If the scene already uses finite elements, has no smooth compliance, or has several loads.
    """
    one = scene.single_load if scene.coupled else scene.single_load.one_pair
    if tooth_bending(one.effects_by_name, "finite_elements"):
        raise InputError("effects.tooth_bending.model", "finite_elements", "is the reference: give a fast model")
    smooth = smooth_effects(scene)
    if not smooth:
        raise InputError("effects", "no smooth compliance", "nothing to compare: add tooth_bending")
    bodies = [GearBody()] if scene.effect(GearBody.name) is not None else []
    if scene.coupled:
        tables, names = scene.to_mapping(), {effect.name for effect in smooth}
        kept = {name: table for name, table in tables["effects"].items() if name not in names}
        by_finite_elements = {"model": "finite_elements", "accuracy": accuracy}
        more = {ToothBending.name: by_finite_elements} | {body.name: {} for body in bodies}
        return parse_scene({**tables, "effects": {**more, **kept}})
    others = [effect for effect in scene.effects if effect not in smooth]
    return replace(scene, effects=(ToothBending(model="finite_elements", accuracy=accuracy), *bodies, *others))


def finite_elements(reference: Scene) -> ToothBending:
    """Tooth bending effect of a reference."""
    tooth = tooth_bending(reference.effects_by_name, "finite_elements")
    assert tooth is not None
    return tooth


def reference_memory(reference: Scene, positions: int) -> float:
    """Predicted peak memory of a reference at a number of mesh phases, to a factor of two [bytes].

    Raises
    ------
    AccuracyError, MemoryBudgetError
        If there is no reference of this accuracy.
    """
    meshes = tuple(reference.meshes.values()) if reference.coupled else (reference,)
    return max(
        max([contact_memory(each, positions), *(level.memory for level in missing_levels(each))]) for each in meshes
    )


def missing_levels(reference: Scene) -> list[Level]:
    """Levels of the finite elements of the reference of a pair that are not on disk yet; raises as ``levels``."""
    return finite_elements(reference).missing_levels(reference.pair, reference.effects_by_name)


def fe_flanks(reference: Scene) -> tuple[FlankCompliance, FlankCompliance]:
    """Compliances of the loaded flanks of pinion and wheel of a reference."""
    tooth, beside, coast = finite_elements(reference), reference.effects_by_name, reference.load.coast
    pinion, wheel = (tooth.flank(reference.pair, index, beside, coast) for index in (0, 1))
    return pinion, wheel


@dataclass(frozen=True, kw_only=True)
class SolvedTeeth(Tooth):
    """Teeth with given flank compliances, for a reference whose finite elements are solved.

    Parameters
    ----------
    both
        FlankPair of pinion and wheel.
    """

    both: tuple[FlankCompliance, FlankCompliance]

    name: ClassVar[str] = ToothBending.name
    summary: ClassVar[str] = ToothBending.summary
    source: ClassVar[str] = ToothBending.source

    @property
    def by_finite_elements(self) -> bool:
        """Whether the teeth are finite elements: they are."""
        return True

    @property
    def solid_order(self) -> None:
        """None: the fast model's ring is not joined to these teeth."""
        return None

    def compliance(self, lines: ContactLines, effects: Effects) -> LowRank | Dense:
        """Factors of both teeth concatenated, or the dense matrix of all pairs if the gears have bodies."""
        return FlankPair(both=self.both, coupled=GearBody.name in effects).on(lines)

    def flank(self, pair: Pair, index: int, effects: Effects, coast: bool = False) -> FlankCompliance:
        """The given flank of a gear."""
        return self.both[index]

    def tooth_factor(self, pair: Pair, index: int, height: NDArray, y: NDArray, effects: Effects) -> NDArray:
        """Factor Ψ of one tooth; see ``ToothCompliance``."""
        return self.both[index].factor(height, y)


def solved_reference(reference: Scene) -> Scene:
    """Return ``reference`` with its solved flanks inside; it cannot be written to a file."""
    return _with_flanks(reference, fe_flanks(reference))


def finest_level(reference: Scene) -> Scene:
    """Return ``reference`` with the flanks of the finest level alone, without the extrapolation from the last two.

    The difference from ``solved_reference`` is the error bar of the compliance.
    """
    pinion, wheel = (
        flank if flank.correction is None else replace(flank, blocks=flank.blocks - flank.correction)
        for flank in fe_flanks(reference)
    )
    return _with_flanks(reference, (pinion, wheel))


def _with_flanks(reference: Scene, flanks: tuple[FlankCompliance, FlankCompliance]) -> Scene:
    kept = [effect for effect in reference.effects if effect.name != ToothBending.name]
    return replace(reference, effects=(SolvedTeeth(both=flanks), *kept))
