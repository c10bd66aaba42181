"""Tables ``[gears.NAME]`` and ``[[meshes]]`` of a file, and their conversion to one gear pair per mesh."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass as table

from gearbench.errors import InputError, one_of
from gearbench.geometry.linkage import Linkage
from gearbench.geometry.names import AT_RING, CARRIER, GEARS, PAIR, PLANET, SHARED
from gearbench.geometry.pair import Length, Member, Pair
from gearbench.geometry.planetary import PlanetarySet, expanded
from gearbench.geometry.thickness import Deviation
from gearbench.geometry.train import Mesh, Train
from gearbench.schema import STRICT, as_table, given, read

#: Keys of ``[[meshes]]`` that ``[pair]`` has too.
OF_PAIR = ("centre_distance", "centre_distance_upper", "centre_distance_lower", "backlash")

#: Torque below which a body passes on none, relative to that on the first driver.
_NO_TORQUE = 1e-9


@table(frozen=True, kw_only=True, config=STRICT)
class TrainGear(Member):
    """``[gears.NAME]`` describes a gear; tables below it, e.g. ``[gears.NAME.tip_relief]``, are effects of its flanks.

    ``coast`` holds the effects of the other flanks, which an idler loads in its further meshes.

    Parameters
    ----------
    normal_module, face_width
        m_n and b [mm].
    pressure_angle, helix_angle
        α_n and β [°].
    shaft
        Name of the shaft that it shares with other gears, if the file has no ``[system]``.
    """

    normal_module: Annotated[float, Field(ge=0.05, le=200.0)]
    face_width: Length = field(kw_only=True)
    pressure_angle: Annotated[float, Field(ge=5.0, le=40.0)] = 20.0
    helix_angle: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    shaft: str = ""


@table(frozen=True, kw_only=True, config=STRICT)
class TrainMesh:
    """Each item of ``[[meshes]]`` describes two gears in mesh.

    Parameters
    ----------
    name
        Name in results; by default "DRIVER to DRIVEN".
    driver, driven
        Names of the gears.
    flank
        Flanks that touch under positive torque, "drive" by default in the first mesh. It determines the other meshes:
        an idler drives with the flank on which it is not driven.
    centre_distance, centre_distance_upper, centre_distance_lower, backlash
        As for a pair [mm, µm, µm, mm].
    direction
        Direction from the axis of the driver to the teeth that mesh, clockwise from x [°]: towards the axis of an
        external driven gear, away from that of a ring.
    phase
        Mesh phase relative to the first mesh [mesh periods]; by default it follows from the teeth.
    hand
        Hand of the driver's helix in a gearbox, if no gear shared with an earlier mesh determines it. That of the first
        mesh is ``system.hand``.
    """

    driver: str
    driven: str
    name: str = ""
    flank: Literal["drive", "coast"] | None = None
    centre_distance: Length
    centre_distance_upper: Deviation = 0.0
    centre_distance_lower: Deviation = 0.0
    backlash: Annotated[float, Field(ge=0.0)] | None = None
    direction: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0
    phase: float | None = None
    hand: Literal["right", "left"] = "right"

    @property
    def label(self) -> str:
        """Name of the mesh; by default "DRIVER to DRIVEN"."""
        return self.name or f"{self.driver} to {self.driven}"


@dataclass(frozen=True, kw_only=True)
class TrainTables:
    """The gears and meshes of a scene as given in its file.

    Parameters
    ----------
    tables
        Tables "gears", "meshes", "effects", "coast" and "system" of the file.
    gears, meshes
        The first two tables as objects, without the effects of the flanks.
    planetary
        The planetary set, if the file has the short form ``[planetary]``.
    first
        Pair, effects, coast effects and system of the scene; None until they are known.
    """

    tables: Mapping[str, Any] = field(hash=False)
    gears: Mapping[str, TrainGear] = field(hash=False)
    meshes: tuple[TrainMesh, ...]
    first: tuple[Any, ...] | None = field(default=None, compare=False)
    planetary: PlanetarySet | None = None

    @property
    def written(self) -> dict[str, Any]:
        """The tables to write to a file; the short form ``[planetary]`` replaces gears and meshes."""
        short = () if self.planetary is None else ("gears", "meshes")
        return {key: table for key, table in self.tables.items() if key not in short}

    @classmethod
    def of(cls, tables: Mapping[str, Any], effects: Collection[str]) -> TrainTables:
        """Read the tables of a file; ``effects`` are the names of all effects. Raises ``InputError`` with the key."""
        short = None
        if "planetary" in tables:
            for key in ("gears", "meshes", "system"):
                if key in tables:
                    raise InputError(key, "given", "conflicts with planetary: give one of the two")
            short, more = expanded(tables["planetary"])
            tables = {**tables, **more}
        try:
            return cls._of(tables, effects, short)
        except InputError as error:
            raise error if short is None else in_set(error) from None

    @classmethod
    def _of(cls, tables: Mapping[str, Any], effects: Collection[str], short: PlanetarySet | None) -> TrainTables:
        tables_of_gears, listed = as_table("gears", tables.get("gears", {})), tables.get("meshes")
        if not isinstance(listed, list | tuple) or not listed:
            raise InputError("meshes", listed, "must be one or more tables: [[meshes]]")
        known = {field.name for field in fields(TrainGear)}
        gears = {}
        for name, keys in tables_of_gears.items():
            table = as_table(f"gears.{name}", keys)
            if unknown := [key for key in table if key not in {*known, *effects, "coast"}]:
                raise InputError(f"gears.{name}.{unknown[0]}", "unknown key", one_of(unknown[0], sorted(known)))
            gears[name] = read(TrainGear, {key: value for key, value in table.items() if key in known}, f"gears.{name}")
        meshes = tuple(read(TrainMesh, mesh, f"meshes.{number}") for number, mesh in enumerate(listed))
        for number, mesh in enumerate(meshes):
            for key in ("driver", "driven"):
                if (gear := getattr(mesh, key)) not in gears:
                    raise InputError(f"meshes.{number}.{key}", gear, one_of(gear, gears))
        if idle := set(gears) - {gear for mesh in meshes for gear in (mesh.driver, mesh.driven)}:
            raise InputError(f"gears.{min(idle)}", "in no mesh", "must be the driver or the driven gear of one")
        parts = {key: table for key, table in tables.items() if key in PARTS}
        return cls(tables=parts, gears=gears, meshes=meshes, planetary=short)

    def pairs(self) -> dict[str, Pair]:
        """Name of each mesh → its two gears as a pair.

        Profile shifts that are not given follow from the meshes in their order. A gear keeps the shift from its first
        mesh.
        """
        shifts: dict[str, float] = {}
        pairs: dict[str, Pair] = {}
        for number, mesh in enumerate(self.meshes):
            names = (mesh.driver, mesh.driven)
            if self.planetary is not None and number % self.planetary.keys.number:  # all planets are equal
                pairs[mesh.label] = pairs[self.meshes[number - 1].label]
                continue
            both = [self.gears[name] for name in names]
            for key in SHARED:
                if getattr(both[0], key) != getattr(both[1], key):
                    allowed = f"must be that of its mate {names[0]}, {getattr(both[0], key):g}"
                    raise InputError(f"gears.{names[1]}.{key}", getattr(both[1], key), allowed)
            table = {key: getattr(both[0], key) for key in (*SHARED, "face_width")}
            table |= {key: value for key, value in given(mesh).items() if key in OF_PAIR}
            for label, name, gear in zip(GEARS, names, both, strict=True):
                known_shift = {"profile_shift": shifts[name]} if name in shifts else {}
                keys_of_gear = {key: value for key, value in given(gear).items() if key not in (*SHARED, "shaft")}
                table[label] = known_shift | keys_of_gear
            table["pinion"].pop("face_width")
            if table["face_width"] == table["wheel"]["face_width"]:
                table["wheel"].pop("face_width")
            try:
                pairs[mesh.label] = pair = read(Pair, table, "pair")
            except InputError as error:
                raise self.named(error, number) from None
            shifts |= zip(names, pair.profile_shifts, strict=True)
        return pairs

    def flanks(self, number: int, *, coast: bool) -> dict[str, Any]:
        """Effects of a mesh by name: common effects, and those of either gear on its drive or ``coast`` flank."""
        sides = ("effects", "coast") if coast else ("effects",)
        effects = {name: dict(table) for side in sides for name, table in self.tables.get(side, {}).items()}
        known = {field.name for field in fields(TrainGear)}
        mesh = self.meshes[number]
        for label, gear in zip(GEARS, (mesh.driver, mesh.driven), strict=True):
            drive = {k: v for k, v in self.tables["gears"][gear].items() if k not in known and k != "coast"}
            other = as_table(f"gears.{gear}.coast", self.tables["gears"][gear].get("coast", {}))
            if alone := other.keys() - drive.keys():
                allowed = f"needs {min(alone)} of the drive flank too, of amount 0, say"
                raise InputError(f"gears.{gear}.coast.{min(alone)}", "given", allowed)
            for name, value in {**drive, **(other if coast else {})}.items():
                common = effects.setdefault(name, {})
                if common.keys() - set(GEARS):
                    raise InputError(f"gears.{gear}.{name}", "given", f"conflicts with effects.{name} of both gears")
                common[label] = value
        return effects

    def train(self, pairs: Mapping[str, Pair]) -> Train:
        """Train built from ``pairs``, the gear pair of each mesh by name."""
        keys = ("driver", "driven", "direction", "phase")
        tables = ((m.label, {key: getattr(m, key) for key in keys}) for m in self.meshes)
        if self.planetary is not None:
            carried = tuple(Mesh(name=name, pair=pairs[name], carrier=CARRIER, **table) for name, table in tables)
            short = self.planetary
            held, timed = (short.keys.held,), short.second_gears
            return Train(meshes=carried, shafts=self._shafts, axes=short.axes, held=held, timed=timed)
        meshes = tuple(Mesh(name=name, pair=pairs[name], **table) for name, table in tables)
        return Train(meshes=meshes, shafts=self._shafts, axes=self._axes)

    def coupled(self, train: Train) -> bool:
        """Whether the meshes form one contact problem: in a planetary set, or with parallel paths."""
        return self.planetary is not None or ("system" not in self.tables and train.parallel)

    def linkage(self, train: Train, *, coast: bool = False) -> Linkage:
        """Coupling of the meshes by rigid motions."""
        short = self.planetary
        return Linkage(train=train, coast=coast) if short is None else short.linkage(train, coast=coast)

    def offset(self, linkage: Linkage) -> NDArray:
        """Approach added to each mesh by position and thickness errors of the bodies, (mesh,) [mm]."""
        return np.zeros(len(self.meshes)) if self.planetary is None else self.planetary.offset(linkage)

    def shares(self, train: Train) -> dict[str, float]:
        """Mesh → torque on its driver relative to the first driver; parallel paths are assumed to share evenly."""
        if not self.coupled(train):
            return train.torques()
        force = self.linkage(train).even_forces(1.0)
        return {m.name: 1e-3 * F * m.pair.gears[0].base_radius for m, F in zip(train.meshes, force, strict=True)}

    def passed_on(self, train: Train) -> dict[str, float]:
        """Body → torque that it passes on, divided by that on the first driver; only bodies that pass on any."""
        linkage, shares = self.linkage(train), self.shares(train)
        force = np.array([shares[mesh.name] / mesh.pair.gears[0].base_radius for mesh in train.meshes])
        torques = zip(linkage.bodies, np.abs(linkage.on_bodies(force)[:, 2]), strict=True)
        ends = {train.shaft(train.meshes[0].driver), *train.held}
        return {name: float(torque) for name, torque in torques if name not in ends and torque > _NO_TORQUE}

    @property
    def _shafts(self) -> dict[str, str]:
        """Gear → its shaft, for gears that share a shaft or sit on a shaft of the system."""
        shaft_of = {name: gear.shaft for name, gear in self.gears.items() if gear.shaft}
        for number, shaft in enumerate(self.tables.get("system", {}).get("shafts", ())):
            for seat in shaft.get("gears", ()):
                if (gear := seat.get("gear")) not in self.gears:
                    raise InputError(f"system.shafts.{number}.gears.gear", gear, one_of(str(gear), self.gears))
                shaft_of[gear] = shaft.get("name", "")
        return shaft_of

    @property
    def _axes(self) -> dict[str, tuple[float, float]]:
        shafts = self.tables.get("system", {}).get("shafts", ())
        return {shaft.get("name", ""): tuple(shaft["axis"]) for shaft in shafts if "axis" in shaft}

    def system(self, train: Train, table: Mapping[str, Any]) -> dict[str, Any]:
        """The table ``system`` in the form for pairs: one seat per gear and mesh, and a list of the further meshes.

        Missing axes follow from the directions of the meshes.
        """
        if "meshes" in table:
            raise InputError("system.meshes", "given", "conflicts with the meshes of the scene: give one of the two")
        first, hand = self.meshes[0].label, table.get("hand", "right")
        seats: dict[str, list[dict[str, Any]]] = {}
        for mesh in self.meshes:
            for label, gear in zip(GEARS, (mesh.driver, mesh.driven), strict=True):
                place = {"gear": label, "mesh": PAIR if mesh.label == first else mesh.label, "name": gear}
                seats.setdefault(gear, []).append(place)
        shafts = []
        for shaft in table.get("shafts", ()):
            gears = [{**seat, **place} for seat in shaft.get("gears", ()) for place in seats[seat["gear"]]]
            axis = train.places[shaft["name"]].tolist() if gears else shaft.get("axis", [0.0, 0.0])
            shafts.append({**shaft, "gears": gears, "axis": axis})
        hands = train.hands({mesh.label: hand if mesh.label == first else mesh.hand for mesh in self.meshes})
        further = [{"name": m.label, "scene": "", "hand": hands[m.label]} for m in self.meshes[1:]]
        for further_mesh, mesh in zip(further, self.meshes[1:], strict=True):
            further_mesh |= {} if mesh.phase is None else {"phase": mesh.phase}
        return {**table, "shafts": shafts, "meshes": further}

    def coast(self, train: Train) -> dict[str, bool]:
        """Mesh → whether its coast flanks touch; raises ``InputError`` if ``flank`` of a mesh contradicts this."""
        touches = train.coast
        first = self.meshes[0].flank == "coast"
        for number, mesh in enumerate(self.meshes):
            touches[mesh.label] ^= first
            side = "coast" if touches[mesh.label] else "drive"
            if mesh.flank not in (None, side):
                raise InputError(
                    f"meshes.{number}.flank",
                    mesh.flank,
                    f"must be {side}: a tooth lies between its flanks",
                )
        return touches

    def named(self, error: InputError, number: int) -> InputError:
        """Translate the key of an error in the pair of mesh ``number`` to the key in the file."""
        mesh = self.meshes[number]
        head, _, rest = error.key.partition(".")
        names = dict(zip(GEARS, (mesh.driver, mesh.driven), strict=True))
        parts = rest.split(".")
        key = error.key
        if head == "pair" and parts[0] in names:
            key = ".".join(["gears", names[parts[0]], *parts[1:]])
        elif head == "pair":
            key = f"gears.{mesh.driver}.{rest}" if parts[0] not in OF_PAIR else f"meshes.{number}.{rest}"
        elif head in ("effects", "coast") and len(parts) > 1 and parts[1] in names:
            key = ".".join(["gears", names[parts[1]], *(["coast"] * (head == "coast")), parts[0], *parts[2:]])
        value, allowed = error.value, error.allowed
        for label, name in names.items():
            value = value.replace(f"pair.{label}.", f"gears.{name}.") if isinstance(value, str) else value
            allowed = allowed.replace(f"pair.{label}.", f"gears.{name}.")
        if self.planetary is None:
            return InputError(key, value, allowed, error.file)
        if key == f"meshes.{number}.centre_distance":
            value = f"{self.planetary.centre_distance:g}"
            value += "" if self.planetary.keys.centre_distance else ", from the tooth numbers"
        return in_set(InputError(key, value, allowed, error.file))


def in_set(error: InputError) -> InputError:
    """Translate the keys of an error in the gears or meshes of a set to the keys in ``[planetary]``."""
    head, _, rest = error.key.partition(".")
    name, _, below = rest.partition(".")
    if name.startswith("planet "):
        name = AT_RING if name.endswith("at ring") else PLANET
    if head == "gears" and name:
        key = f"planetary.{below}" if below in SHARED and name != AT_RING else f"planetary.{name}.{below}"
    else:
        key = f"planetary.{below}" if head == "meshes" and below else error.key
    # a message may name a key that is missing
    value, allowed = error.value, error.allowed
    for pattern, name in (
        (r"\bgears\.planet \d+ at ring\.", f"planetary.{AT_RING}."),
        (r"\bgears\.(sun|planet|ring)[ \d]*\.", r"planetary.\1."),
    ):
        value = re.sub(pattern, name, value) if isinstance(value, str) else value
        allowed = re.sub(pattern, name, allowed)
    return InputError(key, value, allowed, error.file)


#: Tables that define a train, in place of the table "pair".
PARTS = ("gears", "meshes", "planetary", "effects", "coast", "system")
