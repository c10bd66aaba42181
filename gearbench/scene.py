"""Scene: a pair or train with its load, simulated effects and resolution, as a frozen object."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict, Field, model_validator
from pydantic.dataclasses import dataclass

from gearbench.effects.base import ComplianceEffect, Effect, Effects, GapEffect
from gearbench.errors import InputError, naming
from gearbench.geometry.names import GEARS, PAIR
from gearbench.geometry.pair import Pair
from gearbench.html import notebook_table
from gearbench.loads import Load, WeightedLoad, greatest_load
from gearbench.schema import STRICT, changed, given

if TYPE_CHECKING:
    from gearbench.geometry.planetary import PlanetarySet
    from gearbench.geometry.train import Train
    from gearbench.geometry.train_tables import TrainTables
    from gearbench.system.gearbox import Gearbox, MeshLoads
    from gearbench.system.schema import System
else:  # scenes of a pair alone do not import the classes of trains and systems
    MeshLoads = System = TrainTables = Any

#: Allowed range of the line load over E m_n [–]. Below it, rounding errors dominate; above it, deflections would be
#: many times the size of a tooth.
LOADS = (1e-15, 100.0)
#: Default number of Gauss points on a panel.
DEFAULT_GAUSS_POINTS = 8


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Operation:
    """Speed and lubrication, for friction, efficiency and temperatures; the contact does not depend on them.

    Parameters
    ----------
    speed
        Speed of the pinion [1/min].
    friction_coefficient
        μ of the mesh [–]; by default from the lubricant (ISO/TR 14179-2).
    viscosity
        Dynamic viscosity of the oil at its temperature [mPa·s].
    roughness
        Mean arithmetic roughness R_a of both flanks [µm].
    lubricant_factor
        X_L [–]: 1 for mineral oil. ISO/TR 13989 and 15144-1: 0.8 for polyalphaolefins, 0.7 for polyglycols (0.6 if they
        mix with water), 1.3 for phosphate esters, 1.5 for traction fluids.
    thermal_contact_coefficient
        B_M = √(λ ρ c) of the flanks [N/(mm·s^½·K)]; 13.8 for steel.
    """

    speed: Annotated[float, Field(gt=0.0, le=1e6)] | None = None
    friction_coefficient: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    viscosity: Annotated[float, Field(gt=0.0, le=1e5)] | None = None
    roughness: Annotated[float, Field(gt=0.0, le=100.0)] = 0.4
    lubricant_factor: Annotated[float, Field(gt=0.0, le=10.0)] = 1.0
    thermal_contact_coefficient: Annotated[float, Field(gt=0.0, le=1000.0)] = 13.8

    def __post_init__(self) -> None:
        if self.friction_coefficient is not None and self.viscosity is not None:
            raise InputError("viscosity", self.viscosity, "conflicts with friction_coefficient: give one of the two")

    def at(self, rate: float) -> Operation:
        """Operation of a mesh whose pinion turns ``rate`` times as fast."""
        return self if self.speed is None else changed(self, speed=rate * self.speed)


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Resolution:
    """Resolution of the mesh cycle and of the contact lines.

    Parameters
    ----------
    positions
        Number of uniformly spaced mesh phases. By default Gauss points between the transitions, which converge much
        faster.
    gauss_points
        Gauss points on each panel between two transitions; by default 5, 3 for helical trains whose meshes split each
        other's panels, or 8 for error samples.
    segments
        Segments of constant line load on each contact line.
    accuracy
        Relative accuracy, instead of the other keys: ``simulate`` and ``robust`` choose settings whose estimated error
        is this small. It covers means, RMS, peak-to-peak values and harmonics 1 to 5 of both curves (means and RMS
        values over error samples).
    """

    positions: Annotated[int, Field(ge=1, le=100_000)] | None = None
    gauss_points: Annotated[int, Field(ge=1, le=1000)] | None = None
    segments: Annotated[int, Field(ge=1, le=2000)] = 15
    accuracy: Annotated[float, Field(ge=1e-6, le=0.5)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _one_or_the_other(cls, given: Any) -> Any:
        """Refuse ``segments`` together with ``accuracy``, even if a file gives their default value."""
        if isinstance(given, dict) and given.get("accuracy") is not None and "segments" in given:
            raise InputError("segments", given["segments"], "conflicts with accuracy, which sets it: give one of them")
        return given

    def __post_init__(self) -> None:
        if self.accuracy is not None:
            for key, value, default in (
                ("positions", self.positions, None),
                ("gauss_points", self.gauss_points, None),
                ("segments", self.segments, 15),
            ):
                if value != default:
                    raise InputError(key, value, "conflicts with accuracy, which sets it: give one of them")
        if self.positions is not None and self.gauss_points is not None:
            raise InputError("gauss_points", self.gauss_points, "conflicts with positions: give one of the two")

    @property
    def panel_size(self) -> int | None:
        """Number of Gauss points on a panel between two transitions; None for uniform phases."""
        return None if self.positions is not None else self.gauss_points or DEFAULT_GAUSS_POINTS


@dataclass(frozen=True, kw_only=True, config=ConfigDict(STRICT, arbitrary_types_allowed=True))
class Scene:
    """Complete input of a simulation. An effect is simulated if and only if it is in ``effects``.

    Parameters
    ----------
    name
        Free text.
    pair, load, resolution
        The gear pair, its load, and the resolution.
    loads
        Several loads with different torques, instead of one; ``load`` is then the load with the greatest torque.
    effects
        The effects to simulate, each kind at most once, in any order.
    coast
        Effects of the coast flanks, which carry a negative torque. They replace effects with the same name; all other
        effects are the same on both flanks.
    operation
        Speed and lubrication, for outputs that need them.
    system
        Shafts, bearings or inertias around the pair, if given.
    further
        Scenes of the other meshes, in their order.
    own
        Name of the scene's mesh among those of the system.
    gear_names
        Names of the driver and the driven gear of the pair.
    train
        Gears and meshes, if there are several; ``pair``, ``effects`` and ``coast`` are then those of the first mesh.
    mesh_loads
        Mean loads of the meshes on their shafts, see ``contact.mesh_loads``; never in files.

    Raises
    ------
    InputError
        If an effect appears twice, lacks one that it requires, conflicts with another, or does not fit the pair; if no
        effect adds compliance; or if a load is not allowed. pydantic wraps it in a ``ValidationError``.
    """

    name: str = ""
    pair: Pair
    load: Load
    loads: tuple[WeightedLoad, ...] = ()
    effects: tuple[Effect, ...]
    coast: tuple[Effect, ...] = ()
    resolution: Resolution = Resolution()
    operation: Operation | None = None
    system: System | None = None
    further: tuple[Scene, ...] = ()
    own: str = PAIR
    gear_names: tuple[str, str] = GEARS
    train: TrainTables | None = None
    mesh_loads: MeshLoads | None = None

    def __post_init__(self) -> None:
        if self.train is not None and self.train.first != (self.pair, self.effects, self.coast, self.system):
            allowed = "differ from those of gears and meshes: change the scene of one mesh, scene.meshes[NAME]"
            raise InputError("gears", "other pair, effects or system", allowed)
        names = [effect.name for effect in self.effects]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"effects.{name}", "given twice", "each effect at most once")
        for effect in self.effects:
            for other, reason in effect.requires.items():
                if other not in names:
                    raise InputError(f"effects.{other}", "missing", f"is required by effects.{effect.name}: {reason}")
            for other, reason in effect.conflicts.items():
                if other in names:
                    raise InputError(f"effects.{effect.name}", "given", f"conflicts with effects.{other}: {reason}")
            with naming(below=f"effects.{effect.name}"):
                effect.check(self.pair, self.effects_by_name)
        self._check_loads()
        if not any(isinstance(effect, ComplianceEffect) for effect in self.effects):
            raise InputError("effects", ", ".join(names) or "none", "at least one must add compliance, e.g. hertz")
        self._check_coast()

    def _check_loads(self) -> None:
        torques = [load.torque for load in self.loads]
        if self.loads and self.load != greatest_load(self.loads):
            raise InputError("load", self.load.torque, "conflicts with loads: give one of the two")
        if len(set(torques)) < len(torques):
            raise InputError("loads", torques, "must have different torques")
        low, high = (end / self._load_of_torque for end in LOADS)
        given = {f"loads.{i}.torque": torque for i, torque in enumerate(torques)} or {"load.torque": self.load.torque}
        for key, torque in given.items():
            if not low <= abs(torque) <= high:
                raise InputError(key, torque, f"must lie within {low:.3g} to {high:.3g} N·m for this pair")

    def _check_coast(self) -> None:
        for effect in self.coast:
            key = f"coast.{effect.name}"
            if not (isinstance(effect, GapEffect) and effect.of_flank):
                raise InputError(key, "given", "must be an effect of the flank's shape, e.g. tip_relief")
            if [other.name for other in self.coast].count(effect.name) > 1:
                raise InputError(key, "given twice", "each effect at most once")
            with naming(below=key):
                effect.check(self.pair, self.effects_by_name)

    @property
    def effects_by_name(self) -> Effects:
        """Effects by name."""
        return MappingProxyType({effect.name: effect for effect in self.effects})

    def effect(self, name: str) -> Effect | None:
        """Effect with this name; None if the scene does not have it."""
        return self.effects_by_name.get(name)

    def without(self, name: str) -> Scene:
        """Return the scene without the effect ``name``; the scene itself if it does not have it.

        Raises
        ------
        InputError
            If another effect requires it.
        """
        kept = tuple(effect for effect in self.effects if effect.name != name)
        return self if len(kept) == len(self.effects) else changed(self, effects=kept)

    def under(self, load: Load) -> Scene:
        """Return the scene with a single load.

        Raises
        ------
        InputError
            If the load is not allowed.
        """
        return changed(self, load=load, loads=(), mesh_loads=None)

    @property
    def each_load(self) -> tuple[Scene, ...]:
        """Scenes with a single load, one per load, torques ascending; the scene itself if it has one load."""
        torques = sorted(load.torque for load in self.loads)
        return tuple(self.under(Load(torque=torque)) for torque in torques) or (self,)

    @property
    def single_load(self) -> Scene:
        """The scene itself; raises ``InputError`` if it has several loads."""
        if self.loads:
            allowed = "are for simulate, sweep, robust and optimise: here give one [load]"
            raise InputError("loads", f"{len(self.loads)} loads", allowed)
        return self

    @property
    def one_load(self) -> Scene:
        """The scene itself, if it has one load and one mesh.

        Raises
        ------
        InputError
            If it has several loads or meshes.
        """
        return self.single_load.one_mesh

    @property
    def one_mesh(self) -> Scene:
        """The scene itself, if it has one mesh or is a gearbox with shafts, whose first mesh it describes.

        Raises
        ------
        InputError
            If it has several meshes without a system.
        """
        return self if self.system is not None else self.one_pair

    @property
    def one_pair(self) -> Scene:
        """The scene itself, if it has one mesh; raises ``InputError`` if it has several, on shafts or not."""
        if self.train is not None:
            if self.coupled:
                allowed = (
                    "are for simulate without --report, sweep, robust, hunting, optimise, response, cost: here give one"
                )
            else:
                allowed = "in a row are for simulate without --report, sweep and, with [system], response"
            raise InputError("meshes", f"{len(self.meshes)} meshes", allowed)
        return self

    @cached_property
    def meshes(self) -> Mapping[str, Scene]:
        """Name of a mesh → its scene with the torque and speed there; for a pair, the scene itself.

        Raises
        ------
        InputError
            If the torques of the meshes do not follow from the balance of the shafts.
        """
        if self.train is None:
            return {PAIR: self}
        if self.system is not None:
            of_gearbox = map(self.seen_from, self.gearbox.names)
            gears = [(mesh.driver, mesh.driven) for mesh in self.train.meshes]
            both = zip(self.mesh_names, of_gearbox, gears, strict=True)
            return {name: changed(scene, gear_names=names) for name, scene, names in both}
        train = self.geometry
        meshes, torques = {}, self.train.shares(train)
        for mesh, scene in zip(train.meshes, (self, *self.further), strict=True):
            rate = abs(float(train.own_rate(mesh.name)))
            meshes[mesh.name] = changed(
                scene,
                name=f"{self.name}: {mesh.name}".removeprefix(": "),
                load=Load(torque=torques[mesh.name] * self.load.torque),
                loads=tuple(changed(load, torque=torques[mesh.name] * load.torque) for load in self.loads),
                resolution=self.resolution,
                operation=self.operation and self.operation.at(rate),
                gear_names=mesh.gears,
                train=None,
                further=(),
            )
        return meshes

    @cached_property
    def geometry(self) -> Train:
        """Geometry of a train: gears and meshes in the frame of their axes."""
        assert self.train is not None, "a pair has no train"
        meshes = zip(self.train.meshes, (self, *self.further), strict=True)
        return self.train.train({mesh.label: scene.pair for mesh, scene in meshes})

    @property
    def coupled(self) -> bool:
        """Whether the scene has several meshes that form one contact problem."""
        return self.train is not None and self.train.coupled(self.geometry)

    @property
    def has_random_errors(self) -> bool:
        """Whether errors are drawn: ``[effects.manufacturing_errors]`` or ``[planetary.scatter]``."""
        short = self.planetary
        of_members = short is not None and short.keys.scatter is not None
        return of_members or self.effect("manufacturing_errors") is not None

    @property
    def flank_effects(self) -> tuple[Effect, ...]:
        """Effects of the loaded flanks (drive or coast), and those that follow from temperatures."""
        of_coast = {effect.name: effect for effect in self.coast} if self.load.coast else {}
        return (*{**self.effects_by_name, **of_coast}.values(), *self._thermal_effects())

    def _thermal_effects(self) -> tuple[Effect, ...]:
        pinion, wheel = self.pair.strains
        if pinion == wheel:
            return ()
        from gearbench.effects.thermal_pitch import ThermalPitch

        return (ThermalPitch(),)

    @cached_property
    def acting_effects(self) -> tuple[Effect, ...]:
        """Effects of the loaded flanks, and those of the system's shafts.

        Raises
        ------
        InputError
            If the shafts do not fit the pair, or their bearings do not hold them.
        """
        return self.flank_effects if not self.has_shafts else (*self.flank_effects, *self.shaft_effects())

    @property
    def has_shafts(self) -> bool:
        """Whether the pair sits on elastic shafts."""
        return self.system is not None and bool(self.system.shafts)

    @property
    def _on_shafts(self) -> dict[str, Scene]:
        """Name of a mesh of the system → its scene."""
        names = (PAIR,) if self.system is None else (PAIR, *(mesh.name for mesh in self.system.meshes))
        others = iter(self.further)
        return {name: self if name == self.own else next(others) for name in names}

    @property
    def pairs(self) -> dict[str, Pair]:
        """Name of a mesh of the system → its pair."""
        return {name: scene.pair for name, scene in self._on_shafts.items()}

    @cached_property
    def gearbox(self) -> Gearbox:
        """Gearbox: the shafts of the system, and the pairs that mesh on them."""
        assert self.system is not None, "a gearbox is that of [system]"
        preferred = tuple((name, scene.load.torque) for name, scene in self._on_shafts.items())
        return _gearbox(
            system=self.system,
            pairs=tuple(self.pairs.items()),
            torque=self.load.torque,
            preferred=preferred,
            own=self.own,
            loads=self.mesh_loads,
        )

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """Names of the meshes of the system, or of the train."""
        return tuple(self.pairs) if self.train is None else tuple(mesh.label for mesh in self.train.meshes)

    def seen_from(self, mesh: str) -> Scene:
        """Return the same gearbox with another mesh as the scene's pair, with the torque at that mesh."""
        alone = changed(self, train=None) if self.train is not None else self
        if mesh == self.own:
            return alone
        torques = self.gearbox.torques
        scenes = {
            name: changed(scene, system=None, further=(), own=PAIR, mesh_loads=None, load=Load(torque=torques[name]))
            for name, scene in alone._on_shafts.items()
        }
        scene = scenes.pop(mesh)
        others = tuple(scenes.values())
        return changed(scene, system=self.system, own=mesh, further=others, mesh_loads=self.mesh_loads)

    def shaft_effects(self, own: Any = None, near: Any = ()) -> tuple[Effect, ...]:
        """Effects of the shafts with bearings in equilibrium under ``own``; see ``effects.shafts.system_effects``."""
        from gearbench.effects.shafts import resting_effects, system_effects

        return resting_effects(self.gearbox) if own is None else system_effects(self.gearbox, own, near)

    @property
    def F_bt(self) -> float:
        """Transverse force along the line of action, F_bt = abs(T) / r_b1 [N]."""
        return 1e3 * abs(self.load.torque) / self.pair.gears[0].base_radius

    @property
    def planetary(self) -> PlanetarySet | None:
        """Planetary set of the scene, if it is one."""
        return None if self.train is None else self.train.planetary

    @property
    def F_bn(self) -> float:
        """Force normal to the flank, F_bn = F_bt / cos β_b [N]."""
        return self.F_bt / math.cos(self.pair.meshing.beta_b)

    @property
    def relative_load(self) -> float:
        """Dimensionless mean line load F_bn / (b E m_n) [–]; 5·10⁻⁴ is common for steel."""
        return self._load_of_torque * abs(self.load.torque)

    @property
    def _load_of_torque(self) -> float:
        """``relative_load`` at a torque of 1 N·m."""
        pair = self.pair
        force = 1e3 / (pair.gears[0].base_radius * math.cos(pair.meshing.beta_b))
        E = min(material.E for material in pair.materials)
        return force / (pair.meshing.face_width * E * pair.normal_module)

    def to_mapping(self) -> dict[str, Any]:
        """Scene as nested tables, as in a file, without defaults."""
        tables = given(self if self.mesh_loads is None else changed(self, mesh_loads=None))
        for key in ("further", "own"):
            tables.pop(key, None)
        if self.loads:
            del tables["load"]
        if self.train is not None:
            common = {key: tables[key] for key in tables.keys() - {"pair", "effects", "coast", "gear_names", "train"}}
            return {**common, **{key: table for key, table in self.train.written.items() if table}}
        for name in ("effects", "coast"):
            if effects := getattr(self, name):
                tables[name] = {effect.name: given(effect) for effect in effects}
        return tables

    def to_toml(self) -> str:
        """Scene as the text of a TOML file."""
        import tomli_w

        return tomli_w.dumps(self.to_mapping())

    @property
    def digest(self) -> str:
        """SHA-256 of the TOML text of the scene."""
        return digest(self.to_toml())

    def _repr_html_(self) -> str:
        tables = self.to_mapping()
        given = {**tables["effects"], "resolution": tables.get("resolution", {})}
        rows = {"load": [f"{', '.join(f'{loaded.load.torque:g}' for loaded in self.each_load)} N·m on the pinion"]}
        for name, table in given.items():
            rows[name] = [", ".join(f"{key} = {value}" for key, value in table.items()) or "defaults"]
        return self.pair._repr_html_() + notebook_table(self.name or "scene", (), rows)


@lru_cache(maxsize=16)
def _gearbox(*, pairs: tuple[tuple[str, Pair], ...], preferred: tuple[tuple[str, float], ...], **parts: Any) -> Gearbox:
    """Gearbox that scenes share if they differ in other parts."""
    from gearbench.system.gearbox import Gearbox

    return Gearbox(pairs=dict(pairs), preferred=dict(preferred), **parts)


def check_scene(scene: object) -> None:
    """Refuse an object that is not a ``Scene``.

    Raises
    ------
    TypeError
        If it is not; for a path, says how to read the file.
    """
    if not isinstance(scene, Scene):
        argument = f"read_scene({scene!r})" if isinstance(scene, str | os.PathLike) else "a Scene"
        raise TypeError(f"scene must be a Scene, not {type(scene).__name__}: give {argument}")


def digest(text: str) -> str:
    """SHA-256 of a scene's TOML text."""
    return hashlib.sha256(text.encode()).hexdigest()
