"""Settings of the page: a few numbers of a scene."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gearbench.effects.base import Effect
from gearbench.effects.crowning import Crowning
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.tip_relief import TipRelief
from gearbench.scene import Load, Scene


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The numbers that sliders set.

    Parameters
    ----------
    crowning
        C_β [µm].
    relief_amount, relief_length
        Tip relief f [µm] and L [mm].
    torque
        On the pinion [N·m].
    iso_class
        Class of the manufacturing errors; None where the scene has none, or none that follow from a class.
    """

    crowning: float
    relief_amount: float
    relief_length: float
    torque: float
    iso_class: int | None

    @classmethod
    def of(cls, scene: Scene) -> Settings:
        """The numbers of a scene."""
        crowning, relief, errors = (scene.effect(n) for n in ("crowning", "tip_relief", "manufacturing_errors"))
        relieved = (relief.amount, relief.length) if isinstance(relief, TipRelief) else (0.0, 0.0)
        amount, length = (x or 0.0 for x in (relieved if all(relieved) else (0.0, 0.0)))
        return cls(
            crowning=(crowning.amount or 0.0) if isinstance(crowning, Crowning) else 0.0,
            relief_amount=amount,
            relief_length=length,
            torque=scene.load.torque,
            iso_class=errors.convention().iso_class if isinstance(errors, ManufacturingErrors) else None,
        )

    def applied(self, scene: Scene) -> Scene:
        """``scene`` with these numbers; the others stay as they are.

        Raises
        ------
        InputError
            If they do not fit the pair. May be wrapped by pydantic's ``ValidationError``.
        """
        now = Settings.of(scene)
        if self == now:
            return scene
        effects = {effect.name: effect for effect in scene.effects}
        if self.crowning != now.crowning:
            _put(effects, "crowning", Crowning(amount=self.crowning) if self.crowning else None)
        if (self.relief_amount, self.relief_length) != (now.relief_amount, now.relief_length):
            _put(effects, "tip_relief", self._relief(scene))
        errors = effects.get("manufacturing_errors")
        if isinstance(errors, ManufacturingErrors) and self.iso_class != now.iso_class:
            effects["manufacturing_errors"] = replace(errors.convention(), iso_class=self.iso_class)
        return replace(scene, load=Load(torque=self.torque), loads=(), effects=tuple(effects.values()))

    def _relief(self, scene: Scene) -> TipRelief | None:
        if not (self.relief_amount and self.relief_length):
            return None
        before = scene.effect("tip_relief")
        amount, length = self.relief_amount, self.relief_length
        if isinstance(before, TipRelief) and before.amount is not None:
            return replace(before, amount=amount, length=length)
        return TipRelief(amount=amount, length=length)


def _put(effects: dict[str, Effect], name: str, effect: Effect | None) -> None:
    """Set an effect, or take it out."""
    effects.pop(name, None)
    if effect is not None:
        effects[name] = effect
