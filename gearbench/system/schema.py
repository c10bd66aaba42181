"""Table ``[system]`` of a scene: shafts with gears, bearings and loads, inertias, damping, further meshes."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError, one_of
from gearbench.geometry.material import Material
from gearbench.geometry.names import PAIR
from gearbench.schema import STRICT
from gearbench.system.bearing import Bearing
from gearbench.system.body import Body

Position = Annotated[float, Field(ge=0.0, le=50000.0)]
Size = Annotated[float, Field(ge=1e-3, le=20000.0)]
#: Largest ratio of the length of a shaft to its smallest diameter; a longer shaft would be a wire.
MOST_SLENDER = 300
Inertia = Annotated[float, Field(ge=0.0, le=1e9)]
Vector = tuple[float, float, float]
Hand = Literal["right", "left"]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ShaftSection:
    """A piece of a shaft, following the piece before it.

    Parameters
    ----------
    length, diameter
        Length and outer diameter [mm].
    end_diameter
        Diameter at its end, if tapered [mm].
    bore
        Inner diameter [mm].
    """

    length: Size
    diameter: Size
    end_diameter: Size | None = None
    bore: Annotated[float, Field(ge=0.0)] = 0.0

    def __post_init__(self) -> None:
        least = min(self.diameter, self.end_diameter or self.diameter)
        if self.bore >= least:
            raise InputError("bore", self.bore, f"must be less than the diameter, {least:g} mm")


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Seat:
    """A gear on a shaft; over its face the shaft bends and twists under the load of its teeth.

    Parameters
    ----------
    gear
        "pinion" (drives) or "wheel"; in a scene of gears and meshes the name of the gear.
    mesh
        Name of a further mesh; by default the pair of this scene.
    name
        Name of the gear, if it takes part in several meshes.
    position
        Middle of the face, from the start of the shaft [mm].
    diameter
        Shaft diameter at the gear [mm], such as the root circle of a pinion cut into its shaft; by default that of the
        sections.
    mass, inertia, transverse_inertia
        Mass and inertias (axial, about a diameter) of the gear body without shaft [kg, kg·m²]; by default a steel disc
        up to the reference circle.
    """

    gear: Literal["pinion", "wheel"]
    mesh: Annotated[str, BeforeValidator(lambda name: name or PAIR)] = PAIR
    name: str = ""
    position: Position
    diameter: Size | None = None
    mass: Inertia | None = None
    inertia: Inertia | None = None
    transverse_inertia: Inertia | None = None


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Coupling:
    """Coupling to a motor or load, at which torque enters or leaves a shaft.

    Parameters
    ----------
    position
        Position on the shaft [mm].
    inertia
        Inertia of motor or load [kg·m²].
    torsional_stiffness
        Stiffness between shaft and inertia [N·m/rad]; rigid by default.
    """

    position: Position
    inertia: Inertia = 0.0
    torsional_stiffness: Annotated[float, Field(gt=0.0, le=1e12)] | None = None


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ShaftLoad:
    """A constant load on a shaft, such as a belt or a weight.

    Parameters
    ----------
    position
        Position on the shaft [mm].
    force
        (x, y, axial) [N]: x from pinion to wheel of this scene's pair, axial towards greater positions.
    moment
        Moment about the same axes [N·m]; the last must be 0.
    """

    position: Position
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.moment[2]:
            raise InputError("moment", list(self.moment), "torque enters by the coupling and the meshes: the last is 0")


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Disc:
    """A rigid disc on a shaft.

    Parameters
    ----------
    position
        Position on the shaft [mm].
    mass
        Mass [kg].
    inertia, transverse_inertia
        Inertia about the axis and about a diameter [kg·m²].
    """

    position: Position
    mass: Inertia = 0.0
    inertia: Inertia = 0.0
    transverse_inertia: Inertia = 0.0


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Ripple:
    """A force or torque on a shaft that varies with an order of its rotation, such as the torque ripple of a motor.

    Parameters
    ----------
    order
        Periods per revolution of the shaft.
    torque
        Amplitude [N·m]; it acts on the inertia of the coupling, unless a position is given.
    force
        Amplitudes (x, y, axial) [N], in phase.
    position
        Position on the shaft [mm]; by default that of the coupling.
    """

    order: Annotated[float, Field(gt=0.0, le=1e4)]
    torque: Annotated[float, Field(ge=0.0)] = 0.0
    force: Vector = (0.0, 0.0, 0.0)
    position: Position | None = None

    def __post_init__(self) -> None:
        if not self.torque and not any(self.force):
            raise InputError("torque", 0.0, "give torque, force, or both")


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Shaft:
    """A shaft; positions count from its start along the shaft axis, in the same direction on all shafts.

    Parameters
    ----------
    name
        Name in results and messages.
    sections
        Pieces, from the start.
    axis
        (x, y) of the axis in the transverse plane [mm], x to the right, y down, seen along increasing positions; by
        default each mesh lies along x.
    gears, bearings, loads, discs
        Parts on the shaft.
    ripples
        Forces and torques that vary with the rotation of the shaft.
    coupling
        Where torque enters or leaves; by default at the start, if the shaft has only one gear.
    material, density
        Steel, 7.85 g/cm³, by default.
    """

    name: str
    sections: Annotated[tuple[ShaftSection, ...], Field(min_length=1)]
    axis: tuple[float, float] | None = None
    gears: tuple[Seat, ...] = ()
    bearings: tuple[Bearing, ...] = ()
    loads: tuple[ShaftLoad, ...] = ()
    discs: tuple[Disc, ...] = ()
    ripples: tuple[Ripple, ...] = ()
    coupling: Coupling | None = None
    material: Material = Material()
    density: Annotated[float, Field(gt=0.0, le=30.0)] = 7.85

    def __post_init__(self) -> None:
        for key in ("gears", "bearings", "loads", "discs"):
            for number, item in enumerate(getattr(self, key)):
                if item.position > self.length:
                    raise self._beyond(f"{key}.{number}.position", item.position)
        for number, ripple in enumerate(self.ripples):
            if (ripple.position or 0.0) > self.length:
                raise self._beyond(f"ripples.{number}.position", ripple.position or 0.0)
            if ripple.position is None and self.coupling is None:
                raise InputError(f"ripples.{number}.position", "missing", "the shaft has no coupling: give a position")
            if not self.gears:
                raise InputError("ripples", "given", "need a gear on the shaft, which determines its speed")
        if self.coupling is not None and self.coupling.position > self.length:
            raise self._beyond("coupling.position", self.coupling.position)
        least = self.length / MOST_SLENDER
        for number, section in enumerate(self.sections):
            for key in ("diameter", "end_diameter"):
                value = getattr(section, key)
                if value is not None and value < least:
                    allowed = f"must be at least {least:.3g} mm, 1/{MOST_SLENDER} of the length of the shaft"
                    raise InputError(f"sections.{number}.{key}", value, allowed)

    def _beyond(self, key: str, value: float) -> InputError:
        """Error for a position that is not on the shaft."""
        return InputError(key, value, f"must lie on the shaft, 0 to {self.length:g} mm")

    @property
    def length(self) -> float:
        """Length of all sections [mm]."""
        return sum(section.length for section in self.sections)


@dataclass(frozen=True, kw_only=True, config=STRICT)
class FurtherMesh:
    """A further mesh on the same shafts, computed from another scene.

    Parameters
    ----------
    name
        Name in results, and for ``mesh`` of a gear.
    scene
        Scene file, without ``[system]``; the shafts determine its torque.
    hand
        Hand of the helix of its pinion.
    phase
        Mesh phase when that of this scene's pair is zero [mesh periods]; by default it follows from the teeth of
        a shared gear, else 0.
    """

    name: Annotated[str, Field(min_length=1)]
    scene: str
    hand: Hand = "right"
    phase: float | None = None


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Wheel:
    """A gear as a rigid wheel that only turns, for systems without shafts.

    Parameters
    ----------
    inertia
        Inertia with everything that turns with it [kg·m²]; by default a steel disc up to the reference circle.
    """

    inertia: Annotated[float, Field(gt=0.0)] | None = None


@dataclass(frozen=True, kw_only=True, config=STRICT)
class System:
    """Surroundings of the pair: shafts, bearings, bodies. Without shafts: two rigid wheels that only turn.

    Parameters
    ----------
    damping_ratio
        Damping ratio of every mode.
    mode_damping
        Damping ratios by frequency instead of ``damping_ratio``: pairs of an ascending frequency [Hz] and a ratio;
        linear between them, constant beyond.
    rotation
        Rotation of the pinion, seen along increasing positions.
    hand
        Hand of the helix of the pinion.
    shafts
        All shafts; each gear is on one.
    meshes
        Further meshes on the same shafts.
    bodies
        Housing and other parts given by matrices, which carry bearings or join shafts.
    pinion, wheel
        Inertias of a system without shafts.
    """

    damping_ratio: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.05
    mode_damping: tuple[tuple[float, Annotated[float, Field(ge=0.0, lt=1.0)]], ...] = ()
    rotation: Literal["clockwise", "counterclockwise"] = "clockwise"
    hand: Hand = "right"
    shafts: tuple[Shaft, ...] = ()
    meshes: tuple[FurtherMesh, ...] = ()
    bodies: tuple[Body, ...] = ()
    pinion: Wheel = Wheel()
    wheel: Wheel = Wheel()

    def __post_init__(self) -> None:
        frequencies = [frequency for frequency, _ in self.mode_damping]
        if any(b <= a for a, b in pairwise([0.0, *frequencies])):
            raise InputError("mode_damping", frequencies, "frequencies must ascend from above 0 Hz")
        for key, items in (("shafts", self.shafts), ("meshes", self.meshes), ("bodies", self.bodies)):
            taken = {PAIR} if key == "meshes" else set()
            for number, item in enumerate(items):
                if item.name in taken:
                    raise InputError(f"{key}.{number}.name", item.name, "given twice: each name at most once")
                taken.add(item.name)
        if not self.shafts:
            for key in ("meshes", "bodies"):
                if getattr(self, key):
                    raise InputError(key, "given", "need the shafts that carry them: [[system.shafts]]")
            return
        self._check_bodies()
        for key in ("pinion", "wheel"):
            if getattr(self, key) != Wheel():
                raise InputError(key, "given", "conflicts with shafts: their gears have the inertia")
        self._check_seats()

    def _check_seats(self) -> None:
        """Check that every gear of every mesh is on one shaft."""
        seats = [(seat.mesh, seat.gear) for shaft in self.shafts for seat in shaft.gears]
        needed = [(name, gear) for name in (PAIR, *(m.name for m in self.meshes)) for gear in ("pinion", "wheel")]
        for seat in seats:
            if seat not in needed:
                raise InputError("shafts.gears.mesh", seat[0], f"must be one of {[m.name for m in self.meshes]}")
        for mesh, gear in needed:
            count = seats.count((mesh, gear))
            if count != 1:
                of = f" of mesh {mesh!r}" if mesh != PAIR else ""
                raise InputError("shafts", f"{gear}{of} on {count} shafts", "must be on one")

    def _check_bodies(self) -> None:
        """Check the names that bearings and joints refer to, and that every body is connected."""
        bodies, shafts = {body.name: body for body in self.bodies}, {shaft.name: shaft for shaft in self.shafts}
        used = {name for name, body in bodies.items() if body.joints}
        for k, shaft in enumerate(self.shafts):
            for b, on in enumerate(bearing.on for bearing in shaft.bearings):
                if on is None:
                    continue
                key = f"shafts.{k}.bearings.{b}.on"
                if on.body not in bodies:
                    raise InputError(f"{key}.body", on.body, one_of(on.body, bodies))
                bodies[on.body].condensed.check(on.node, f"{key}.node")
                used.add(on.body)
        for k, body in enumerate(self.bodies):
            for j, joint in enumerate(body.joints):
                key = f"bodies.{k}.joints.{j}"
                if joint.shaft not in shafts:
                    raise InputError(f"{key}.shaft", joint.shaft, one_of(joint.shaft, shafts))
                if joint.position > (length := shafts[joint.shaft].length):
                    raise InputError(f"{key}.position", joint.position, f"must lie on the shaft, 0 to {length:g} mm")
            if body.name not in used:
                raise InputError(f"bodies.{k}.name", body.name, "the body is unconnected: add a bearing or joint")
