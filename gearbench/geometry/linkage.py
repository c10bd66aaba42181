"""Free rigid motions of the gears of a train, the approach of each mesh due to them, and the loads on the bodies.

Every shaft, and the carrier of a planetary set, can move by u = (x, y) in the transverse plane and turn by θ, clockwise
as in ``gearbench.geometry.train``. The driver of a mesh pushes the driven gear along the line of action n in the sense
t = ±1. The approach of the mesh is δ = n·(u_1 − u_2) + t (r_b1 θ_1 + r_b2 θ_2), with r_b2 < 0 for an internal gear (M1
of docs/theory.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.train import Train

#: Degrees of freedom of a body.
AXES = ("x", "y", "turn")
#: Smallest eigenvalue of the scaled stiffness, relative to the largest, below which a motion counts as unsupported.
_HELD = 1e-9


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A free motion q of a train.

    Parameters
    ----------
    name
        Name in results, e.g. "sun x".
    moved
        Degrees of freedom that move together by q: (body, "x", "y" or "turn") [mm; rad].
    stiffness
        Stiffness of its support [N/mm; N·mm/rad]; 0 if only the meshes hold it.
    """

    name: str
    moved: tuple[tuple[str, str], ...]
    stiffness: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Linkage:
    """Coupling of the meshes by free motions q: approach δ = B q + g, equilibrium K q + Bᵀ F = f, F ≥ 0 (M2).

    F are the mesh forces, f the external forces, K the stiffness of the supports. Errors give g; it is not kept here.

    Parameters
    ----------
    train
        The train, with fixed axes: those of planets are fixed in the frame of their carrier.
    additional_motions
        Free motions in addition to the rotations of the shafts: floating gears, flexible pins.
    carrier, carried
        Name of the body that carries the pins (None without one), and names of the shafts on the pins.
    coast
        Whether the torque on the first driver acts against its sense of rotation.
    twisted
        Gear → torsional stiffness between it and its shaft [N·mm/rad]; other gears are rigid on their shafts.

    Raises
    ------
    InputError
        If torque enters or leaves at several shafts, or a motion is unsupported. Some checks run only when a property
        is used.
    """

    train: Train
    additional_motions: tuple[Motion, ...] = ()
    carrier: str | None = None
    carried: tuple[str, ...] = ()
    coast: bool = False
    twisted: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """Names of the shafts, followed by twisted gears, which turn relative to their shafts, and the carrier."""
        shafts = (*dict.fromkeys(map(self.train.shaft, self.train.gears)), *self.twisted)
        return shafts if self.carrier is None else (*shafts, self.carrier)

    def body(self, gear: str) -> str:
        """Body that turns with a gear: its shaft, or the gear itself if it is twisted."""
        return gear if gear in self.twisted else self.train.shaft(gear)

    @property
    def radii(self) -> dict[str, float]:
        """Body → base radius of its gear, the last if it has several; of the carrier, the distance of the pins [mm]."""
        radii = dict.fromkeys(self.bodies, abs(self.train.meshes[0].pair.centre_distance))
        for mesh in self.train.meshes:
            both = zip(mesh.gears, mesh.pair.gears, strict=True)
            radii |= {self.body(name): abs(gear.base_radius) for name, gear in both}
        return radii

    @cached_property
    def ends(self) -> tuple[str, str]:
        """Input and output shaft: all gears on the input shaft drive, all on the output shaft are driven."""
        drive: dict[str, set[bool]] = {}
        for mesh in self.train.meshes:
            for gear in mesh.gears:
                drive.setdefault(self.train.shaft(gear), set()).add(gear == mesh.driver)
        candidates = [[shaft for shaft, drives in drive.items() if drives == {side}] for side in (True, False)]
        for shafts, verb in zip(candidates, ("enters", "leaves"), strict=True):
            if len(shafts) != 1:
                given = ", ".join(shafts) or "no shaft"
                allowed = "must be a single shaft if paths are parallel: give a pair for each further torque"
                raise InputError("meshes", f"torque {verb} at {given}", allowed)
        return candidates[0][0], candidates[1][0]

    @cached_property
    def rates(self) -> dict[str, float]:
        """Shaft → signed speed relative to the first driver, with all axes fixed."""
        still = replace(self.train, meshes=tuple(replace(m, carrier=None) for m in self.train.meshes), held=())
        return {name: float(rate) for name, rate in still.rates.items()}

    @cached_property
    def motions(self) -> tuple[Motion, ...]:
        """All free motions: rotations of all shafts but the fixed output shaft, then ``additional_motions``."""
        turning = [name for name in self.bodies if name not in (self.ends[1], self.carrier)]
        stiffnesses = ((name, self.twisted.get(name, 0.0)) for name in turning)
        turns = (Motion(name=f"{name} turn", moved=((name, "turn"),), stiffness=k) for name, k in stiffnesses)
        return (*turns, *self.additional_motions)

    @cached_property
    def of_bodies(self) -> NDArray:
        """Approach of each mesh per unit motion of each body in ``AXES``, (mesh, body, 3) [mm/mm; mm/rad]."""
        rows = np.zeros((len(self.train.meshes), len(self.bodies), len(AXES)))
        for row, mesh in zip(rows, self.train.meshes, strict=True):
            turn = self.train.turn(mesh.name) * (-1 if self.coast else 1)
            x, y = self.train.across(mesh.name)
            # direction of the interference point, the foot of the perpendicular from the driver's centre to the line n
            foot = math.atan2(y, x) - turn * mesh.pair.meshing.alpha_wt
            n = turn * np.array([-math.sin(foot), math.cos(foot)])
            for gear, body, sign in zip(mesh.gears, mesh.pair.gears, (1, -1), strict=True):
                shaft = self.bodies.index(self.train.shaft(gear))
                row[shaft] += [*(sign * n), turn * body.base_radius]
                if gear in self.twisted:
                    row[self.bodies.index(gear), 2] += turn * body.base_radius
        return rows

    @cached_property
    def moved(self) -> NDArray:
        """Motion of each body per unit of each free motion, (motion, body, 3)."""
        motions = np.zeros((len(self.motions), len(self.bodies), len(AXES)))
        for row, motion in zip(motions, self.motions, strict=True):
            for body, axis in motion.moved:
                row[self.bodies.index(body), AXES.index(axis)] = 1.0
        return motions

    @cached_property
    def rows(self) -> NDArray:
        """B: approach of each mesh per unit of each free motion, (mesh, motion)."""
        return np.einsum("mba,qba->mq", self.of_bodies, self.moved)

    @cached_property
    def stiffness(self) -> NDArray:
        """K: stiffness of the supports, diagonal, (motion, motion)."""
        return np.diag([motion.stiffness for motion in self.motions])

    def force(self, torque: float) -> NDArray:
        """External force f on each motion under the ``torque`` on the first driver [N·m], (motion,) [N; N·mm]."""
        f = np.zeros(len(self.motions))
        f[self.input] = self.sense * 1e3 * abs(torque)
        return f

    @property
    def sense(self) -> int:
        """Sense, ±1, in which the torque turns the input."""
        return self.train.turn(self.train.meshes[0].name) * (-1 if self.coast else 1)

    @property
    def input(self) -> int:
        """Index of the motion on which the input torque acts: the rotation of the first driver."""
        first = self.train.meshes[0]
        if self.train.shaft(first.driver) != self.ends[0]:
            raise InputError("meshes", first.name, f"its driver must be on {self.ends[0]}, where torque enters")
        return [motion.moved for motion in self.motions].index(((self.ends[0], "turn"),))

    def even_forces(self, torque: float) -> NDArray:
        """Force of each mesh [N], (mesh,), if parallel paths share evenly: the least-norm forces in equilibrium.

        Raises
        ------
        InputError
            If there is no equilibrium, or a force is not positive.
        """
        turning = np.array([m.moved[0][1] == "turn" and not m.stiffness for m in self.motions])
        rows, f = self.rows[:, turning], self.force(torque)[turning]
        F = np.linalg.lstsq(rows.T, f, rcond=None)[0]
        if not np.allclose(rows.T @ F, f, atol=1e-9 * np.abs(f).max()) or np.any(1e-9 * F.max() >= F):
            raise InputError(
                "meshes", "torques do not balance", "in every mesh torque must flow from the driver to the driven gear"
            )
        return np.round(F / F.max(), 12) * F.max()  # equal paths get exactly equal forces

    def check(self) -> None:
        """Refuse motions that neither meshes nor springs hold.

        Raises
        ------
        InputError
            With the name of the least supported motion.
        """
        B, K = self.rows, self.stiffness
        # only zero matters: meshes have stiffness 1, supports theirs relative to the stiffest, the diagonal is scaled
        # to 1
        total = B.T @ B + K / max(np.diag(K).max(initial=0.0), 1.0)
        size = np.sqrt(np.diag(total))
        size = np.where(size > 0, size, 1.0)
        values, vectors = np.linalg.eigh(total / np.outer(size, size))
        if values[0] < _HELD * values[-1]:
            # if a gear floats unsupported, shafts that only it holds turn freely too: name the gear, the cause
            floats = np.array([motion.stiffness == 0 and motion in self.additional_motions for motion in self.motions])
            worst = self.motions[int(np.argmax(np.abs(vectors[:, 0]) * (floats if floats.any() else 1.0)))]
            raise InputError("gears", worst.name, "nothing holds it: neither its meshes nor a stiffness")

    def on_bodies(self, force: NDArray) -> NDArray:
        """Force and torque on each body due to the mesh forces ``force`` (…, mesh) [N], (…, body, 3) [N; N·mm]."""
        return self.carried_on(-np.einsum("...m,mba->...ba", force, self.of_bodies))

    def carried_on(self, loads: NDArray) -> NDArray:
        """Force and torque on each body, (…, body, 3), after pins transmit the forces on carried bodies to the carrier.

        ``loads`` (…, body, 3) are the forces and torques without this transmission.
        """
        total = loads.copy()
        for name in self.carried:
            load, (x, y) = total[..., self.bodies.index(name), :], self.train.places[name]
            total[..., -1, :2] += load[..., :2]
            total[..., -1, 2] += x * load[..., 1] - y * load[..., 0]
        return total

    def displaced(self, places: Mapping[str, NDArray]) -> NDArray:
        """Approach of each mesh, (mesh,) [mm], if bodies are displaced by ``places``: body → (x, y) [mm]."""
        approach = np.zeros(len(self.train.meshes))
        for name, place in places.items():
            approach += self.of_bodies[:, self.bodies.index(name), :2] @ place
        return approach
