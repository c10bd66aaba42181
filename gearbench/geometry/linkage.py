"""Free rigid motions of the gears of a train: how the approach of each mesh follows from them, what acts on them.

Every shaft, and the carrier where there is one, may move by u = (x, y) in the transverse plane and turn by θ,
clockwise as in ``gearbench.geometry.train``. A mesh whose driver pushes the driven gear along the line of action n
approaches by δ = n·(u_1 − u_2) + t (r_b1 θ_1 + r_b2 θ_2), t the sense in which the driver pushes, r_b2 < 0 of an
internal gear (M1 of docs/theory.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.train import Train

#: Motions of a body.
AXES = ("x", "y", "turn")
#: Stiffness over the greatest below which nothing holds a motion.
_HELD = 1e-9


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A free motion q of a train.

    Parameters
    ----------
    name
        How results call it, e.g. "sun x".
    moved
        (body, "x", "y" or "turn") of all that it moves [mm; rad].
    stiffness
        Of what holds it [N/mm; N·mm/rad]; 0: only the meshes do.
    """

    name: str
    moved: tuple[tuple[str, str], ...]
    stiffness: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Linkage:
    """The meshes of a train on its free motions q: approaches δ = B q + g, balance K q + Bᵀ F = f, forces F ≥ 0.

    Parameters
    ----------
    train
        Its axes stand still: those of planets in the frame of their carrier.
    more
        Free motions beside the turning of the shafts: floating gears, yielding pins.
    carrier, carried
        Name of the body that carries pins, where there is one, and of the shafts on them.
    coast
        Whether the torque on the first driver pushes against its sense of rotation.

    Raises
    ------
    InputError
        Where torque enters or leaves at several shafts, or nothing holds a motion; some only when it is asked for.
    """

    train: Train
    more: tuple[Motion, ...] = ()
    carrier: str | None = None
    carried: tuple[str, ...] = ()
    coast: bool = False

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """Names of the shafts, then of the carrier."""
        shafts = tuple(dict.fromkeys(map(self.train.shaft, self.train.gears)))
        return shafts if self.carrier is None else (*shafts, self.carrier)

    @cached_property
    def ends(self) -> tuple[str, str]:
        """Shafts that torque enters and leaves: all gears on the one drive, all on the other are driven."""
        drive: dict[str, set[bool]] = {}
        for mesh in self.train.meshes:
            for gear in mesh.gears:
                drive.setdefault(self.train.shaft(gear), set()).add(gear == mesh.driver)
        found = [[shaft for shaft, drives in drive.items() if drives == {side}] for side in (True, False)]
        for shafts, what in zip(found, ("enters", "leaves"), strict=True):
            if len(shafts) != 1:
                given = ", ".join(shafts) or "no shaft"
                raise InputError("meshes", f"torque {what} at {given}", "must be one shaft, where paths are parallel")
        return found[0][0], found[1][0]

    @cached_property
    def rates(self) -> dict[str, float]:
        """Speed of each shaft over that of the first driver where the axes stand still."""
        still = replace(self.train, meshes=tuple(replace(m, carrier=None) for m in self.train.meshes), held=())
        return {name: float(rate) for name, rate in still.rates.items()}

    @cached_property
    def motions(self) -> tuple[Motion, ...]:
        """All free motions: every shaft turns but the one that torque leaves, which is held there."""
        turning = [name for name in self.bodies if name not in (self.ends[1], self.carrier)]
        return (*(Motion(name=f"{name} turn", moved=((name, "turn"),)) for name in turning), *self.more)

    @cached_property
    def of_bodies(self) -> NDArray:
        """Approach by the motions of each body, (mesh, body, 3) [mm/mm; mm/rad]."""
        rows = np.zeros((len(self.train.meshes), len(self.bodies), len(AXES)))
        for row, mesh in zip(rows, self.train.meshes, strict=True):
            turn = self.train.turn(mesh.name) * (-1 if self.coast else 1)
            x, y = self.train.across(mesh.name)
            foot = math.atan2(y, x) - turn * mesh.pair.meshing.alpha_wt
            n = turn * np.array([-math.sin(foot), math.cos(foot)])
            for gear, body, sign in zip(mesh.gears, mesh.pair.gears, (1, -1), strict=True):
                at = self.bodies.index(self.train.shaft(gear))
                row[at] += [*(sign * n), turn * body.base_radius]
        return rows

    @cached_property
    def moved(self) -> NDArray:
        """Motions of the bodies by the free ones, (motion, body, 3)."""
        found = np.zeros((len(self.motions), len(self.bodies), len(AXES)))
        for row, motion in zip(found, self.motions, strict=True):
            for body, axis in motion.moved:
                row[self.bodies.index(body), AXES.index(axis)] = 1.0
        return found

    @cached_property
    def rows(self) -> NDArray:
        """B (mesh, motion)."""
        return np.einsum("mba,qba->mq", self.of_bodies, self.moved)

    @cached_property
    def stiffness(self) -> NDArray:
        """K (motion, motion)."""
        return np.diag([motion.stiffness for motion in self.motions])

    def force(self, torque: float) -> NDArray:
        """External force f on each motion under the ``torque`` on the first driver [N·m], (motion,) [N; N·mm]."""
        first = self.train.meshes[0]
        sense = self.train.turn(first.name) * (-1 if self.coast else 1)
        f = np.zeros(len(self.motions))
        f[self.input] = sense * 1e3 * abs(torque)
        return f

    @property
    def input(self) -> int:
        """Number of the motion that torque enters at: the turning of the first driver."""
        first = self.train.meshes[0]
        if self.train.shaft(first.driver) != self.ends[0]:
            raise InputError("meshes", first.name, f"its driver must be on {self.ends[0]}, where torque enters")
        return [motion.moved for motion in self.motions].index(((self.ends[0], "turn"),))

    def even_forces(self, torque: float) -> NDArray:
        """Force of each mesh [N], (mesh,), where parallel paths share alike: the least squares of all that balance.

        Raises
        ------
        InputError
            If some are not positive.
        """
        turning = np.array([len(motion.moved) == 1 and motion.moved[0][1] == "turn" for motion in self.motions])
        rows, f = self.rows[:, turning], self.force(torque)[turning]
        F = np.linalg.lstsq(rows.T, f, rcond=None)[0]
        if not np.allclose(rows.T @ F, f, atol=1e-9 * np.abs(f).max()) or np.any(1e-9 * F.max() >= F):
            raise InputError("meshes", "torques do not balance", "each mesh's driver must drive its driven gear")
        return np.round(F / F.max(), 12) * F.max()  # paths that are alike have the same to the last digit

    def check(self) -> None:
        """Refuse motions that neither meshes nor springs hold.

        Raises
        ------
        InputError
            Naming the first of them.
        """
        B, K = self.rows, self.stiffness
        size = np.sqrt(np.einsum("mq,mq->q", B, B) + np.diag(K) / max(np.diag(K).max(initial=0.0), 1.0))
        size = np.where(size > 0, size, 1.0)
        whole = B.T @ B + K / max(np.diag(K).max(initial=0.0), 1.0)
        values, vectors = np.linalg.eigh(whole / np.outer(size, size))
        if values[0] < _HELD * values[-1]:
            worst = self.motions[int(np.argmax(np.abs(vectors[:, 0])))]
            raise InputError("gears", worst.name, "nothing holds it: neither its meshes nor a stiffness")

    def on_bodies(self, force: NDArray) -> NDArray:
        """Force and torque of meshes with the ``force`` (…, mesh) [N] on each body, (…, body, 3) [N; N·mm]."""
        return self.carried_on(-np.einsum("...m,mba->...ba", force, self.of_bodies))

    def carried_on(self, loads: NDArray) -> NDArray:
        """Force and torque on each body (…, body, 3), where pins pass the forces on what they carry to the carrier."""
        found = loads.copy()
        for name in self.carried:
            own, (x, y) = found[..., self.bodies.index(name), :], self.train.places[name]
            found[..., -1, :2] += own[..., :2]
            found[..., -1, 2] += x * own[..., 1] - y * own[..., 0]
        return found

    def displaced(self, places: Mapping[str, NDArray]) -> NDArray:
        """Approach of each mesh where bodies stand beside their places by (x, y) [mm], (mesh,)."""
        found = np.zeros(len(self.train.meshes))
        for name, place in places.items():
            found += self.of_bodies[:, self.bodies.index(name), :2] @ place
        return found
