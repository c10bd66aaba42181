"""Gear pairs of Garambois, Perret-Liaudet, Rigaud (2017), Mechanism and Machine Theory 117, 78–95.

Table 1: two validation pairs. Table 2: selected gears of the optimisation example, a reverse gear of ratio 1:1, with
the robust figures the paper prints for them.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from gearbench.effects.base import Effect
from gearbench.effects.crowning import Crowning
from gearbench.effects.hertz import Hertz
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load, Resolution, Scene

TABLE_2 = files("gearbench.library") / "data" / "garambois2017_table2.csv"

CENTRE_DISTANCE, FACE_WIDTH, TORQUE = 38.0, 8.0, 10.0  # mm, mm, N·m


def tooth_model() -> tuple[Effect, ...]:
    """The paper's compliances: 9-unknown plate and a load-dependent Hertz law of the Weber–Banaschek kind."""
    return ToothBending(basis="paper"), Hertz(law="weber_banaschek")


def case(number: int, resolution: Resolution | None = None) -> Scene:
    """Validation pair 1 or 2 of Table 1, without modifications."""
    if number == 1:
        pair = Pair(
            normal_module=12.0,
            pressure_angle=20.0,
            face_width=90.0,
            centre_distance=650.0,
            pinion=Member(teeth=33, addendum=0.99, dedendum=1.25),
            wheel=Member(teeth=75, addendum=0.99, dedendum=1.25),
        )
        load = Load(torque=13200.0)
    elif number == 2:
        pair = Pair(
            normal_module=2.676,
            pressure_angle=20.0,
            helix_angle=25.648,
            face_width=20.0,
            centre_distance=128.0,
            pinion=Member(teeth=17, addendum=1.15, dedendum=1.65),
            wheel=Member(teeth=71, addendum=1.13, dedendum=1.62),
        )
        load = Load(torque=230.0)
    else:
        raise ValueError(f"case {number}: Table 1 has the cases 1 and 2")
    return Scene(
        name=f"case {number}", pair=pair, load=load, effects=tooth_model(), resolution=resolution or Resolution()
    )


@dataclass(frozen=True, kw_only=True)
class Row:
    """A row of Table 2: the design, and the results printed for it.

    Parameters
    ----------
    gear
        Its name in the table.
    module, pressure_angle, teeth, profile_shift, helix_angle, addendum
        Macro-geometry of both gears [mm, °, –, modules, °, modules].
    crowning, tip_relief, tip_relief_length
        Micro-geometry [µm, µm, mm].
    m_k, m_ste, sigma_k, max_k, sigma_ste, max_ste
        Mean, standard deviation and maximum of the RMS values of stiffness [%] and STE [µm].
    """

    gear: str
    module: float
    pressure_angle: float
    teeth: int
    profile_shift: float
    helix_angle: float
    addendum: float
    crowning: float
    tip_relief: float
    tip_relief_length: float
    m_k: float
    m_ste: float
    sigma_k: float
    max_k: float
    sigma_ste: float
    max_ste: float

    def scene(self, *, errors: bool = False, resolution: Resolution | None = None) -> Scene:
        """The gear as a scene, with the paper's manufacturing errors if asked for."""
        member = Member(teeth=self.teeth, addendum=self.addendum, dedendum=1.25)
        pair = Pair(
            normal_module=self.module,
            pressure_angle=self.pressure_angle,
            helix_angle=self.helix_angle,
            face_width=FACE_WIDTH,
            centre_distance=CENTRE_DISTANCE,
            pinion=member,
            wheel=member,
        )
        effects = tooth_model()
        if self.crowning > 0:
            effects += (Crowning(amount=self.crowning),)
        if self.tip_relief > 0 and self.tip_relief_length > 0:  # the table prints one without the other: no relief
            effects += (TipRelief(amount=self.tip_relief, length=self.tip_relief_length),)
        if errors:
            effects += (ManufacturingErrors(preset="garambois2017"),)
        return Scene(
            name=f"gear {self.gear}",
            pair=pair,
            load=Load(torque=TORQUE),
            effects=effects,
            resolution=resolution or Resolution(),
        )


@cache
def table_2() -> tuple[Row, ...]:
    """All known rows of Table 2."""
    with TABLE_2.open(encoding="utf-8") as file:
        return tuple(_row(line) for line in csv.DictReader(file))


def _row(line: dict[str, str]) -> Row:
    names = dict(zip(line, Row.__dataclass_fields__, strict=True))
    kinds = {"gear": str, "teeth": int}
    return Row(**{field: kinds.get(field, float)(line[column]) for column, field in names.items()})


def gear(name: str) -> Row:
    """Row of Table 2 by the name of its gear, e.g. "SC".

    Raises
    ------
    KeyError
        If there is no such row.
    """
    for row in table_2():
        if row.gear == name:
            return row
    raise KeyError(f"gear {name}: Table 2 has {', '.join(row.gear for row in table_2())}")
