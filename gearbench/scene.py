"""The scene: a pair, its load, the effects that are simulated, and how finely. A TOML file and a frozen object."""

from __future__ import annotations

import hashlib
import math
from functools import cached_property
from types import MappingProxyType
from typing import Annotated, Any

from pydantic import ConfigDict, Field, model_validator
from pydantic.dataclasses import dataclass

from gearbench.effects.base import ComplianceEffect, Effect, Effects
from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.notebook import scene_html
from gearbench.schema import STRICT, given

#: Line load over E m_n that a scene may have: below, rounding rules; above, teeth would be pressed through many times.
LOADS = (1e-15, 100.0)
#: Gauss points on each panel unless a scene says otherwise.
DEFAULT_GAUSS_POINTS = 8


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Load:
    """Load of the pair.

    Parameters
    ----------
    torque
        On the pinion [N·m].
    """

    torque: Annotated[float, Field(gt=0.0)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Resolution:
    """How finely the mesh cycle and the contact lines are resolved.

    Parameters
    ----------
    positions
        Number of uniformly spaced mesh phases. Absent: Gauss points between the transition phases, which converge
        much faster, because the stiffness jumps where a pair enters or leaves.
    gauss_points
        Gauss points on each panel between two transitions, where ``positions`` is absent; 8 unless given.
    segments
        Segments of constant line load on each contact line.
    accuracy
        Relative accuracy of means and RMS values, in place of the others: ``simulate`` and ``robust`` choose the
        cheapest settings that meet it. Peak-to-peak values and line loads are not part of it.
    """

    positions: Annotated[int, Field(ge=1, le=100_000)] | None = None
    gauss_points: Annotated[int, Field(ge=1, le=1000)] | None = None
    segments: Annotated[int, Field(ge=1, le=2000)] = 15
    accuracy: Annotated[float, Field(ge=1e-6, le=0.5)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _one_or_the_other(cls, given: Any) -> Any:
        """In a file even segments that equal the default are given."""
        if isinstance(given, dict) and given.get("accuracy") is not None and "segments" in given:
            raise InputError("segments", given["segments"], "conflicts with accuracy, which chooses it")
        return given

    def __post_init__(self) -> None:
        if self.accuracy is not None:
            for key, value, default in (
                ("positions", self.positions, None),
                ("gauss_points", self.gauss_points, None),
                ("segments", self.segments, 15),
            ):
                if value != default:
                    raise InputError(key, value, "conflicts with accuracy, which chooses it")
        if self.positions is not None and self.gauss_points is not None:
            raise InputError("gauss_points", self.gauss_points, "conflicts with positions: give one of the two")

    @property
    def panel_size(self) -> int | None:
        """Gauss points on each panel between two transitions; None where the phases are uniform."""
        return None if self.positions is not None else self.gauss_points or DEFAULT_GAUSS_POINTS


@dataclass(frozen=True, kw_only=True, config=ConfigDict(STRICT, arbitrary_types_allowed=True))
class Scene:
    """Everything a simulation needs. An effect is simulated if and only if it is in ``effects``.

    Parameters
    ----------
    name
        Free text.
    pair, load, resolution
        The gear pair, its load, and the resolution.
    effects
        The effects to simulate, each kind at most once, in any order.
    system
        ``gearbench.system.schema.System``: what the pair is built into, where the scene says so.
    further
        Scenes of the further meshes of the system, in their order.

    Raises
    ------
    InputError
        If an effect appears twice, lacks one it requires, meets one it excludes, or does not fit the pair; or if
        nothing adds compliance. Wrapped by pydantic's ``ValidationError``.
    """

    name: str = ""
    pair: Pair
    load: Load
    effects: tuple[Effect, ...]
    resolution: Resolution = Resolution()
    # Any, because scenes without a system do not import its classes
    system: Any = None
    further: tuple[Any, ...] = ()

    def __post_init__(self) -> None:
        names = [effect.name for effect in self.effects]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"effects.{name}", "given twice", "each effect at most once")
        for effect in self.effects:
            for other, reason in effect.requires.items():
                if other not in names:
                    raise InputError(f"effects.{effect.name}", "alone", f"requires effects.{other}: {reason}")
            for other, reason in effect.conflicts.items():
                if other in names:
                    raise InputError(f"effects.{effect.name}", "given", f"conflicts with effects.{other}: {reason}")
            try:
                effect.check(self.pair, self.effects_by_name)
            except InputError as error:
                raise error.within(f"effects.{effect.name}") from None
        low, high = (end / self._load_of_torque for end in LOADS)
        if not low <= self.load.torque <= high:
            raise InputError(
                "load.torque", self.load.torque, f"must lie within {low:.3g} to {high:.3g} N·m for this pair"
            )
        if not any(isinstance(effect, ComplianceEffect) for effect in self.effects):
            raise InputError("effects", ", ".join(names) or "none", "at least one must add compliance, e.g. hertz")

    @property
    def effects_by_name(self) -> Effects:
        """The effects by their names."""
        return MappingProxyType({effect.name: effect for effect in self.effects})

    def effect(self, name: str) -> Effect | None:
        """The effect called ``name``, or None where the scene does not ask for it."""
        return self.effects_by_name.get(name)

    @cached_property
    def acting_effects(self) -> tuple[Effect, ...]:
        """The effects, and what the shafts of the system add to them.

        Raises
        ------
        InputError
            If the shafts do not fit the pair, or their bearings do not hold them.
        """
        return self.effects if not self.has_shafts else (*self.effects, *self.shaft_effects())

    @property
    def has_shafts(self) -> bool:
        """Whether the pair sits on elastic shafts."""
        return self.system is not None and bool(self.system.shafts)

    @property
    def pairs(self) -> dict[str, Pair]:
        """Name of each mesh of the system → its pair; the scene's own has none."""
        names = () if self.system is None else (mesh.name for mesh in self.system.meshes)
        return {"": self.pair} | {name: scene.pair for name, scene in zip(names, self.further, strict=True)}

    @cached_property
    def gearbox(self) -> Any:
        """The shafts of the system and how the pairs mesh on them, ``gearbench.system.gearbox.Gearbox``."""
        from gearbench.system.gearbox import Gearbox

        meshes = zip(self.system.meshes, self.further, strict=True)
        wished = {mesh.name: scene.load.torque for mesh, scene in meshes}
        return Gearbox(system=self.system, pairs=self.pairs, torque=self.load.torque, wished=wished)

    def shaft_effects(self, own: Any = None) -> tuple[Effect, ...]:
        """Effects of the shafts, their bearings at rest under ``own``: see ``effects.shafts.system_effects``."""
        from gearbench.effects.shafts import system_effects

        return system_effects(self.gearbox, own=own)

    @property
    def F_bt(self) -> float:
        """F_bt = T / r_b1, transverse, along the line of action [N]."""
        return 1e3 * self.load.torque / self.pair.gears[0].base_radius

    @property
    def F_bn(self) -> float:
        """F_bn = F_bt / cos β_b, normal to the flank [N]."""
        return self.F_bt / math.cos(self.pair.meshing.beta_b)

    @property
    def relative_load(self) -> float:
        """F_bn / (b E m_n), the mean line load in terms of module and elasticity [–]; 5·10⁻⁴ is common for steel."""
        return self._load_of_torque * self.load.torque

    @property
    def _load_of_torque(self) -> float:
        """``relative_load`` under 1 N·m."""
        pair = self.pair
        force = 1e3 / (pair.gears[0].base_radius * math.cos(pair.meshing.beta_b))
        return force / (pair.face_width * pair.material.E * pair.normal_module)

    def to_mapping(self) -> dict[str, Any]:
        """The scene as nested tables, as in a file; defaults are left out."""
        tables = given(self)
        tables.pop("effects", None)
        tables.pop("further", None)
        tables["effects"] = {effect.name: given(effect) for effect in self.effects}
        return tables

    def to_toml(self) -> str:
        """The scene as the text of a TOML file."""
        import tomli_w

        return tomli_w.dumps(self.to_mapping())

    @property
    def digest(self) -> str:
        """SHA-256 of the scene's TOML text."""
        return digest(self.to_toml())

    def _repr_html_(self) -> str:
        return scene_html(self)


def digest(text: str) -> str:
    """SHA-256 of a scene's TOML text."""
    return hashlib.sha256(text.encode()).hexdigest()
